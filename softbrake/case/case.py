"""The case: one drop, checked and in SI units, of the sections of a case file."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace
from functools import cache
from typing import Any, Literal

from softbrake.case.full_stop import FullStop, full_stop
from softbrake.case.keys import Key
from softbrake.case.section import Draft, MayBeNone, Part, Section
from softbrake.case.sections.ambient import AMBIENT, Ambient
from softbrake.case.sections.belts import BELTS, Belt
from softbrake.case.sections.cargo import CARGO, Cargo
from softbrake.case.sections.contact import CONTACT, PARTS
from softbrake.case.sections.fabric import FABRIC, Fabric
from softbrake.case.sections.gas import GAS, Gas
from softbrake.case.sections.inflator import INFLATOR, Inflator
from softbrake.case.sections.limits import LIMITS, Limit
from softbrake.case.sections.numerics import GRID, MODEL, TIME, Grid, ModelChoice, Time
from softbrake.case.sections.output import OUTPUT, Output
from softbrake.case.sections.permeability import PERMEABILITY, Permeability
from softbrake.case.sections.pressure import PRESSURE, Pressure, constant
from softbrake.case.sections.shell import SHELL, Shell
from softbrake.case.sections.sweep import SWEEP
from softbrake.case.sections.top import TOP
from softbrake.case.sections.vents import VENTS, Vent
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
    leakage: float  # effective part of the free wall area
    tolerance: float | None  # relative, of the impact velocity: then fidelity, grid and Courant number are chosen
    pressure: Pressure | None  # either a law or gas
    gas: Gas | None
    ambient: Ambient
    vents: tuple[Vent, ...]
    permeability: Permeability | None
    inflator: Inflator | None
    grid: Grid
    time: Time
    model: ModelChoice
    output: Output
    limits: tuple[Limit, ...] = ()  # on the answer; nothing of the drop
    insists: bool = False  # whether an answer that misses the tolerance is a failure: where the case names one

    where, keys = TOP.name, {key.name: key for key in TOP.keys}  # of fields outside of sections

    def __post_init__(self) -> None:
        """Raise ValueError where a field cannot be."""
        super().__post_init__()
        for section in SECTIONS:
            value = getattr(self, section.name, None)
            if not (isinstance(value, (Part, tuple)) or (value is None and section.name in NONE_ALLOWED)):
                raise ValueError(f"{section.name}: {value!r} is no section of a case")
        if strange := [part for part in self.contact if part not in PARTS]:
            raise ValueError(f"contact: {strange[0]!r} is no part; {', '.join(PARTS)} are expected")
        if (self.pressure is None) == (self.gas is None):
            raise ValueError("pressure, gas: exactly one of them is expected")

    @property
    def filling(self) -> Pressure:
        """The law that the shell starts with: that of the pressure, or the constant one that inflates it with gas."""
        if self.pressure is not None:
            return self.pressure
        assert self.gas is not None
        return constant(max(self.gas.pressure, 0.0))

    def under(self, pressure: Pressure) -> Case:
        """Return the case, unloaded at first, under a pressure law instead of its own or its gas."""
        case = replace(self, pressure=pressure, gas=None, initial="unloaded")
        if self.gas is None:
            return case
        time = replace(self.time, after="stop")
        return replace(case, vents=(), leakage=0.0, permeability=None, inflator=None, time=time)

    @property
    def free_fall_velocity(self) -> float:
        """Of the cargo after falling the shell's height unbraked, m/s."""
        return math.sqrt(self.cargo.velocity**2 + 2.0 * self.gravity * self.shell.height)

    @property
    def full_stop(self) -> FullStop:
        """Section 2.2: what stops the cargo over the shell's height."""
        return full_stop(self.cargo.mass, self.cargo.velocity, self.gravity, self.shell.height, self.shell.mean_diameter)

    @property
    def without_effect(self) -> list[str]:
        """Paths of inputs that do nothing, for the contact, the fabric or the gas that they belong to is not there."""
        parts = () if self.model.fidelity == "lumped" else self.contact
        cargo, idle = self.cargo, []
        if self.friction > 0.0 and "ground" not in parts and "cover" not in parts:
            idle.append("friction")
        if "cargo" not in parts:
            idle += ["cargo.diameter"] if cargo.diameter != self.shell.upper_diameter else []
            idle += ["cargo.height"] if cargo.height is not None else []
        if self.gas is None and self.ambient != Ambient():
            idle.append("ambient")
        return idle


_OF_GAS = (PRESSURE, GAS, AMBIENT, VENTS, PERMEABILITY, INFLATOR)
# In the order of the fields of Case, each of its field's name. That of messages and documents has `contact` and `sweep` first.
SECTIONS: tuple[Section, ...] = (SHELL, FABRIC, BELTS, CARGO, CONTACT, *_OF_GAS, GRID, TIME, MODEL, OUTPUT, LIMITS)
MAPPINGS = tuple(section for section in SECTIONS if section is not CONTACT)
NONE_ALLOWED = tuple(section.name for section in SECTIONS if isinstance(section, MayBeNone))
_BY_NAME = {section.name: section for section in SECTIONS}
ALL = {section.name: section for section in (TOP, CONTACT, SWEEP, *MAPPINGS)}  # what a case file may have


def complete(draft: Draft) -> Case | None:
    """Return the case of a draft; None if there are faults, which the draft has."""
    for name in ("", *_BY_NAME):
        draft.values(name)
    if draft.faults:
        return None
    case = Case(**draft.built(""), **{name: draft.built(name) for name in _BY_NAME})
    LIMITS.check(draft, case)
    return None if draft.faults else case


def case_to_dict(case: Case, known: dict[tuple[str, int], Any] | None = None) -> dict[str, Any]:
    """The resolved case in SI numbers, in the sections of a case file: written as JSON, it is one that gives an equal Case.

    What belongs to gas is left out where it says nothing. known: sections written before, by name and the identity of their
    part, which the caller keeps alive; cases of one file share most of them.
    """
    known = {} if known is None else known

    def written(name: str, part: Any) -> Any:
        if (name, id(part)) not in known:
            known[name, id(part)] = _BY_NAME[name].written(part)
        return known[name, id(part)]

    left_out = {"insists"} if case.insists else {"insists", "tolerance"}
    left_out |= {"ambient"} if case.gas is None and case.ambient == Ambient() else set()
    left_out |= {name for name in ("vents", "leakage", "limits", *NONE_ALLOWED) if not getattr(case, name)}
    values = {field.name: getattr(case, field.name) for field in fields(case) if field.name not in left_out}
    return {name: written(name, value) if name in _BY_NAME else value for name, value in values.items()}


@cache
def key_at(path: str) -> Key | None:
    """The key of a dotted path, as of an override, also of an item of a list; None if there is none."""
    names = path.split(".")
    section = TOP if len(names) == 1 else _BY_NAME.get(names.pop(0))
    keys = () if section is None else section.keys
    if section is not None and section.each and len(names) > 1:
        keys, names = section.each, names[1:]
    key = None
    for name in names:
        if key is not None and key.many:
            key, keys = replace(key, many=False) if name.isdecimal() else None, ()
        else:
            key = next((one for one in keys if one.name == name), None)
            keys = key.parts if key is not None else ()
    return key


def is_quantity(path: str) -> bool:
    """Whether a dotted path is one number that the drop itself depends on, not its computation."""
    key, section = key_at(path), TOP if "." not in path else _BY_NAME.get(path.split(".")[0])
    if key is None or section is None or not section.physical or (section is TOP and key.idle):
        return False
    return isinstance(key.kind, Dimension) and not key.many
