"""The case: one drop, checked and in SI units, of the sections of a case file."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import Any, Literal

from softbrake.case.full_stop import FullStop, full_stop
from softbrake.case.keys import Key
from softbrake.case.section import Draft, Part, Section
from softbrake.case.sections.belts import BELTS, Belt
from softbrake.case.sections.cargo import CARGO, Cargo
from softbrake.case.sections.contact import CONTACT, PARTS
from softbrake.case.sections.fabric import FABRIC, Fabric
from softbrake.case.sections.numerics import GRID, MODEL, TIME, Grid, ModelChoice, Time
from softbrake.case.sections.output import OUTPUT, Output
from softbrake.case.sections.pressure import PRESSURE, Pressure
from softbrake.case.sections.shell import SHELL, Shell
from softbrake.case.sections.sweep import SWEEP
from softbrake.case.sections.top import TOP
from softbrake.case.units import Dimension


@dataclass(frozen=True)
class Case(Part):
    """One drop, checked and in SI units. `load_case` makes one, `dataclasses.replace` another one."""

    title: str
    gravity: float  # m/s^2, downwards
    shell: Shell
    fabric: Fabric
    belts: tuple[Belt, ...]
    cargo: Cargo
    contact: tuple[str, ...]  # what stops the fabric, of contact.PARTS
    initial: Literal["unloaded", "inflated"]  # shape at first contact
    friction: float  # Coulomb's coefficient on ground and cover
    tolerance: float | None  # relative, of the impact velocity: then fidelity, grid and Courant number are chosen
    pressure: Pressure
    grid: Grid
    time: Time
    model: ModelChoice
    output: Output
    insists: bool = False  # whether an answer that misses the tolerance is a failure: where the case names one

    where, keys = TOP.name, {key.name: key for key in TOP.keys}  # of fields outside of sections

    def __post_init__(self) -> None:
        """Raise ValueError where a field cannot be."""
        super().__post_init__()
        for section in SECTIONS:
            value = getattr(self, section.name, None)
            if not isinstance(value, (Part, tuple)):
                raise ValueError(f"{section.name}: {value!r} is no section of a case")
        if strange := [part for part in self.contact if part not in PARTS]:
            raise ValueError(f"contact: {strange[0]!r} is no part; {', '.join(PARTS)} are expected")

    @property
    def free_fall_velocity(self) -> float:
        """Of the cargo after falling the shell's height unbraked, m/s."""
        return math.sqrt(self.cargo.velocity**2 + 2.0 * self.gravity * self.shell.height)

    @property
    def full_stop(self) -> FullStop:
        """Section 2.2: what stops the cargo over the shell's height."""
        return full_stop(self.cargo.mass, self.cargo.velocity, self.gravity, self.shell.height, self.shell.diameter)

    @property
    def without_contact(self) -> list[str]:
        """Paths of inputs that do nothing, for the contact that they belong to is not asked for, or no fabric is there."""
        parts = () if self.model.fidelity == "lumped" else self.contact
        cargo, idle = self.cargo, []
        if self.friction > 0.0 and "ground" not in parts and "cover" not in parts:
            idle.append("friction")
        if "cargo" not in parts:
            idle += ["cargo.diameter"] if cargo.diameter != self.shell.diameter else []
            idle += ["cargo.height"] if cargo.height is not None else []
        return idle


# In the order of the fields of Case, each of its field's name. That of messages and documents has `contact` and `sweep` first.
SECTIONS: tuple[Section, ...] = (SHELL, FABRIC, BELTS, CARGO, CONTACT, PRESSURE, GRID, TIME, MODEL, OUTPUT)
MAPPINGS = tuple(section for section in SECTIONS if section is not CONTACT)
_BY_NAME = {section.name: section for section in SECTIONS}
ALL = {section.name: section for section in (TOP, CONTACT, SWEEP, *MAPPINGS)}  # what a case file may have


def complete(draft: Draft) -> Case | None:
    """Return the case of a draft; None if there are faults, which the draft has."""
    for name in ("", *_BY_NAME):
        draft.values(name)
    if draft.faults:
        return None
    return Case(**draft.built(""), **{name: draft.built(name) for name in _BY_NAME})


def case_to_dict(case: Case) -> dict[str, Any]:
    """The resolved case in SI numbers, in the sections of a case file: written as JSON, it is one that gives an equal Case."""
    left_out = {"insists"} if case.insists else {"insists", "tolerance"}
    values = {field.name: getattr(case, field.name) for field in fields(case) if field.name not in left_out}
    return {name: _BY_NAME[name].written(value) if name in _BY_NAME else value for name, value in values.items()}


def key_at(path: str) -> Key | None:
    """The key of a dotted path, as of an override; None if there is none."""
    *parents, name = path.split(".")
    section = TOP if not parents else _BY_NAME.get(parents[0])
    keys = () if section is None else section.keys if len(parents) < 2 else section.each if len(parents) == 2 else ()
    return next((key for key in keys if key.name == name), None)


def is_quantity(path: str) -> bool:
    """Whether a dotted path is one number that the drop itself depends on, not its computation."""
    key, section = key_at(path), TOP if "." not in path else _BY_NAME.get(path.split(".")[0])
    if key is None or section is None or not section.physical or (section is TOP and key.idle):
        return False
    return isinstance(key.kind, Dimension) and not key.many
