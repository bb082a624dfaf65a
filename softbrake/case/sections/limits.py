"""Section `limits`: bounds that the answer of a drop is to keep. They change nothing of the drop."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from softbrake.case.keys import Key
from softbrake.case.section import Draft, Section
from softbrake.case.sections.output import CFC
from softbrake.case.units import Dimension, parse_quantity, unit_of, unit_size
from softbrake.case.yaml_nodes import Node, join

if TYPE_CHECKING:
    from softbrake.case.case import Case

ANSWERS = {  # of Summary that may have a bound
    "impact_velocity": Dimension.SPEED,
    "rebound_velocity": Dimension.SPEED,
    "lowest_height": Dimension.LENGTH,
    "peak_deceleration": Dimension.ACCELERATION,
    "peak_pressure": Dimension.PRESSURE,
    "peak_temperature": Dimension.TEMPERATURE,
    "peak_tension_generatrix": Dimension.TENSION,
    "peak_tension_hoop": Dimension.TENSION,
    "peak_tension_belt": Dimension.TENSION,
    "fabric_margin": Dimension.RATIO,
    "belt_margin": Dimension.RATIO,
}
EXAMPLES = {
    Dimension.SPEED: "1.5 m/s",
    Dimension.LENGTH: "5 cm",
    Dimension.ACCELERATION: "8 g",
    Dimension.PRESSURE: "60 kPa",
    Dimension.TEMPERATURE: "400 K",
    Dimension.TENSION: "30 kN/m",
    Dimension.RATIO: "2",
}
FORMER = {"minimum_height": "lowest_height"}  # names that are read as well
CLASSED = ("peak_deceleration", "peak_tension_generatrix", "peak_tension_hoop", "peak_tension_belt")  # that a class filters
_FIRST = next(iter(ANSWERS))
_BOUND = re.compile(r"\s*(<=|>=|≤|≥)\s*(.*?)\s*(?:\bat\s+CFC\s*([0-9]+)\s*)?", re.DOTALL)


@dataclass(frozen=True)
class Limit:
    """A bound of one answer."""

    name: str  # of ANSWERS
    at_most: bool  # else at least
    value: float  # SI
    quantity: str  # as it was given
    cfc: int | None = None  # channel frequency class of SAE J211 of the peak; None for that of the answer

    def __str__(self) -> str:
        return f"{'<=' if self.at_most else '>='} {self.quantity}{'' if self.cfc is None else f' at CFC {self.cfc}'}"

    @property
    def column(self) -> str:
        """Name of the answer, with its class."""
        return self.name if self.cfc is None else f"{self.name}_cfc{self.cfc}"

    @property
    def unit(self) -> str:
        """Unit in which the bound was given; SI where it was given in none."""
        return unit_of(self.quantity) or ANSWERS[self.name].unit

    def in_unit(self, value: float, form: str = ".4g") -> str:
        """A value (SI) of the answer in the unit of the bound."""
        return f"{value / unit_size(self.unit, ANSWERS[self.name]):{form}} {self.unit}".rstrip()


def limit_of(name: str, text: str) -> Limit:
    """Read a bound such as `<= 8 g at CFC 60` of an answer. Raises ValueError, which says in words what is wrong."""
    match = _BOUND.fullmatch(text)
    if match is None:
        raise ValueError(f"'{text}' is no bound")
    sign, quantity, cfc = match.groups()
    value = parse_quantity(quantity, ANSWERS[name])
    if value < 0.0:
        raise ValueError(f"{quantity} is out of range")
    if cfc is not None and name not in CLASSED:
        raise ValueError(f"no class filters {name}")
    if cfc is not None and int(cfc) not in CFC:
        raise ValueError(f"unknown class {cfc}, known are {', '.join(map(str, CFC))}")
    return Limit(name, sign in "<=≤", value, quantity, None if cfc is None else int(cfc))


def limits_of(written: Mapping[str, str]) -> tuple[Limit, ...]:
    """The limits of a resolved case, as `case_to_dict` writes them."""
    return tuple(limit_of(name, text) for name, text in written.items())


def lacking(name: str, case: Case) -> str:
    """What a case lacks to have an answer; empty where it has it."""
    lumped = case.model.fidelity == "lumped"
    if (name.startswith("peak_tension") or name.endswith("_margin")) and lumped:
        return "a lumped case has no shell, and so no tensions"
    if name in ("peak_tension_belt", "belt_margin") and not case.belts:
        return "the case has no belts"
    if name == "fabric_margin" and case.fabric.strength is None:
        return "the fabric has no strength; fabric.strength is expected"
    if name == "belt_margin" and all(belt.strength is None for belt in case.belts):
        return "no belt has a strength; belts.strength is expected"
    if name in ("peak_pressure", "peak_temperature") and case.gas is None:
        return "the pressure of the case is given; a case with gas is expected"
    if name == "rebound_velocity" and case.time.after == "stop":
        return "the run ends at a full stop; time.after: rebound is expected"
    return ""


class _LimitsSection(Section):
    def read(self, draft: Draft) -> tuple[Limit, ...]:
        """Bounds of answers, in the order of ANSWERS; former names of answers are read as today's."""
        node = self.node(draft)
        if node is None:
            return ()
        if not isinstance(node.value, dict):
            draft.fault(node.place, self.name, "not a mapping", f"answers with bounds such as '{_example(_FIRST)}' are expected")
            return ()
        draft.mapping(node, self.name, (), others=(*ANSWERS, *FORMER))
        limits: dict[str, Limit] = {}
        for written, item in node.value.items():
            name, where = FORMER.get(written, written), join(self.name, written)
            if name not in ANSWERS:
                continue
            try:
                if not isinstance(item.value, str):
                    raise ValueError("no bound")
                limit = limit_of(name, item.value)
            except ValueError as error:
                draft.fault(item.place, where, str(error), f"a bound such as '{_example(name)}' is expected")
                continue
            if name in limits:
                draft.fault(item.key, where, f"given besides {name}", "one bound of an answer is expected")
            limits[name] = limit
        return tuple(limits[name] for name in ANSWERS if name in limits)

    def build(self, draft: Draft) -> tuple[Limit, ...]:
        """The limits."""
        limits: tuple[Limit, ...] = draft.values(self.name)
        return limits

    def check(self, draft: Draft, case: Case) -> None:
        """Tell of limits on answers that a case cannot have."""
        for limit in case.limits:
            if fault := lacking(limit.name, case):
                names = [limit.name, *(former for former, name in FORMER.items() if name == limit.name)]
                place, where = draft.last_given(*(join(self.name, name) for name in names))
                draft.fault(place, where, *(fault.split("; ", 1) if "; " in fault else (fault, "no such limit is expected")))

    def written(self, part: tuple[Limit, ...]) -> dict[str, str]:
        """A bound by the name of its answer."""
        return {limit.name: str(limit) for limit in part}

    def give_way(self, members: dict[str, Node], name: str) -> None:
        """Drop the other name of an answer."""
        for other in [one for one in members if one != name and FORMER.get(one, one) == FORMER.get(name, name)]:
            members.pop(other)

    def schema(self) -> dict[str, Any]:
        """Texts that begin with a sign."""
        schema = super().schema()
        for key in schema["properties"].values():
            key["pattern"] = "^\\s*(<=|>=|≤|≥)"
        return schema


def _example(name: str) -> str:
    sign = ">=" if name == "lowest_height" or name.endswith("_margin") else "<="
    return f"{sign} {EXAMPLES[ANSWERS[name]]}" + (" at CFC 60" if name == "peak_deceleration" else "")


_MEANINGS = {
    "impact_velocity": "0 of a cargo that stops above the ground",
    "rebound_velocity": "upwards; 0 without rebound",
    "lowest_height": "of the upper cover",
    "peak_deceleration": "net of gravity; 1 kHz one-way without a class",
    "peak_pressure": "of the gas, gauge",
    "peak_temperature": "of the gas",
    "fabric_margin": "fabric.strength over its largest tension, less 1",
    "belt_margin": "likewise, of the belts",
}
LIMITS = _LimitsSection(
    "limits",
    tuple,
    tuple(Key(name, str, _MEANINGS.get(name, "largest"), f'"{_example(name)}"') for name in ANSWERS),
    optional=True,
    begun=False,
)
