"""Section `pressure`: the law of the excess pressure over time, and whether a shell can be inflated by it at the start."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from typing import Any, Literal

from softbrake.case.checker import Values, last_given, listed
from softbrake.case.full_stop import full_stop
from softbrake.case.keys import Key, mapping_schema
from softbrake.case.section import Draft, MayBeNone, Part
from softbrake.case.sections.shell import Shell
from softbrake.case.units import Dimension
from softbrake.case.yaml_nodes import Node, join


@dataclass(frozen=True)
class Pressure(Part):
    """Excess pressure law: constant, Eq. (2.10) or a table; damped by Eq. (2.11)."""

    law: Literal["constant", "sine", "table"]
    value: float  # Pa: the constant, or P_max of (2.10); 0 for a table
    peak_time: float  # s, of P_max (sine), else 0
    end_time: float  # s, end of the pressure (sine), else 0
    times: tuple[float, ...]  # s, increasing (table), else empty
    values: tuple[float, ...]  # Pa, same length as times
    damping: float  # s/m, nu^n of (2.11)

    @property
    def start(self) -> float:
        """At t = 0, Pa."""
        return {"constant": self.value, "sine": 0.0, "table": self.values[0] if self.values else 0.0}[self.law]

    @property
    def largest(self) -> float:
        """Of the law, Pa."""
        return max(self.value, *self.values, 0.0)

    def key(self, field: str) -> Key | None:
        """Only those of its law."""
        return next((key for key in (LAW, *LAWS.get(self.law, ())) if key.name == field), None)

    def steady(self, value: float) -> Pressure:
        """Return a constant pressure (Pa) in place of the law."""
        return replace(self, law="constant", value=value, peak_time=0.0, end_time=0.0, times=(), values=())


_DAMPING = Key("damping", Dimension.INVERSE_SPEED, "nu^n of (2.11): moving cloth feels less", "0 s/m", default=0.0, least=0)
_TIMES = Key("times", Dimension.TIME, "increasing (table)", "[0 s, 0.1 s]", required=True, least=0, many=True)
_VALUES = Key("values", Dimension.PRESSURE, "the last one holds on (table)", "[0 kPa, 15 kPa]", required=True, least=0, many=True)
LAWS = {
    "constant": (Key("value", Dimension.PRESSURE, "excess pressure (constant)", "15696 Pa", required=True, least=0), _DAMPING),
    "sine": (
        Key("peak_time", Dimension.TIME, "of the largest pressure (sine)", "0.1 s", required=True, above=0),
        Key("end_time", Dimension.TIME, "end of the pressure (sine)", "0.2 s", computed="full stop, 2 height/velocity", above=0),
        Key("value", Dimension.PRESSURE, "largest pressure (sine)", "32 kPa", computed="full stop, section 2.2", least=0),
        _DAMPING,
    ),
    "table": (
        _TIMES,
        _VALUES,
        _DAMPING,
    ),
}
LAW = Key("law", tuple(LAWS), "over time; sine is (2.10)", "constant", required=True)
_NONE = Pressure("constant", 0.0, 0.0, 0.0, (), (), 0.0)


def constant(value: float) -> Pressure:
    """Return the law of a constant pressure, Pa."""
    return replace(_NONE, value=value)


class _PressureSection(MayBeNone):
    def read(self, draft: Draft) -> Values:
        """Keys of the law that is given; none of a case with gas."""
        node = draft.members.get(self.name)
        if node is None:
            if not {self.name, "gas"} & (draft.members.keys() | draft.meant):
                expected = (
                    "a section such as 'pressure: {law: constant, value: 15696 Pa}' or 'gas: {pressure: 15.7 kPa}' is expected"
                )
                draft.fault(draft.root.place, "", "'pressure' and 'gas' are missing", expected)
            return {}
        if "gas" in draft.members:
            place, where = draft.last_given(self.name, "gas")
            other = "gas" if where == self.name else self.name
            draft.fault(place, where, f"given besides {other}", "either 'pressure' or 'gas' is expected")
        members = node.value if isinstance(node.value, dict) else {}
        law = members["law"].value if "law" in members else None
        if not isinstance(law, str) or law not in LAWS:
            draft.mapping(node, self.name, self.keys, complete=False)
            if isinstance(node.value, dict) and "law" not in members:
                draft.missing(node, self.name, LAW)
            return {}
        keys = (LAW, *LAWS[law])
        foreign = list(dict.fromkeys(key.name for key in self.keys if key.name not in {key.name for key in keys}))
        for name in (name for name in members if name in foreign):
            fault = f"not a key of the {law} law"
            draft.fault(members[name].key, join(self.name, name), fault, f"{listed(keys)} are expected")
        values = draft.mapping(node, self.name, keys, others=foreign)
        if law == "table":
            draft.table(node, self.name, values, _TIMES, _VALUES)
        elif law == "sine" and _full_stop_known(draft):
            _complete_sine(draft, node, values)
        if draft.values("").get("initial") == "inflated" and not draft.faults:
            check_inflatable(draft, replace(_NONE, **values).start, f"the {law} law", "a pressure at t = 0")
        return values

    def build(self, draft: Draft) -> Pressure | None:
        """The law with what it does not use empty."""
        return replace(_NONE, **draft.values(self.name)) if self.name in draft.members else None

    def written(self, part: Pressure) -> Values:
        """Keys of the law alone."""
        values = asdict(part)
        given = {name: values[name] for name in ("law", *(key.name for key in LAWS[part.law]))}
        return {name: list(value) if isinstance(value, tuple) else value for name, value in given.items()}

    def needed(self) -> list[Key]:
        """Those of a constant pressure."""
        return [key for key in (LAW, *LAWS["constant"]) if key.required]

    def schema(self) -> dict[str, Any]:
        """One of the laws."""
        return {"oneOf": [_law_schema(law) for law in LAWS]}


PRESSURE = _PressureSection(
    "pressure",
    Pressure,
    (LAW, *{key.meaning: key for keys in LAWS.values() for key in keys}.values()),
    physical=True,
)


def _law_schema(law: str) -> dict[str, Any]:
    section = mapping_schema((LAW, *LAWS[law]))
    section["properties"]["law"] = {"const": law, "description": LAW.meaning}
    return section


def _full_stop_known(draft: Draft) -> bool:
    shell, cargo = draft.values("shell"), draft.values("cargo")
    return {"height", "upper_diameter"} <= shell.keys() and {"mass", "velocity"} <= cargo.keys() and "gravity" in draft.values("")


def _complete_sine(draft: Draft, node: Node, values: Values) -> None:
    """Defaults of the sine law, of a full stop by section 2.2."""
    shell, cargo, gravity = draft.values("shell"), draft.values("cargo"), draft.values("")["gravity"]
    stop = full_stop(cargo["mass"], cargo["velocity"], gravity, shell["height"], Shell(**shell).mean_diameter)
    assert isinstance(node.value, dict)
    if "value" not in node.value:
        values["value"] = stop.largest
    if "end_time" not in node.value:
        values["end_time"] = stop.end_time
    if {"peak_time", "end_time"} <= values.keys() and values["end_time"] <= values["peak_time"]:
        place, where = last_given(node, "pressure", ["peak_time", "end_time"])
        fault = f"peak_time {values['peak_time']:.6g} s is not before end_time {values['end_time']:.6g} s"
        draft.fault(place, where, fault, "peak_time < end_time is expected")


def check_inflatable(draft: Draft, start: float, what: str, expected: str) -> None:
    """A shell is inflated by the pressure (Pa, gauge) it starts with."""
    place, where = last_given(draft.root, "", ["initial"])
    if draft.values("model")["fidelity"] == "lumped":
        fault = "the lumped model has no shell to inflate"
        draft.fault(place, where, fault, "initial: unloaded or another fidelity is expected")
    elif start <= 0.0:
        draft.fault(place, where, f"{what} starts without pressure", f"initial: unloaded, or {expected} is expected")
