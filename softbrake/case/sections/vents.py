"""Section `vents`: a list of openings of the bag."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from softbrake.case.checker import Values, last_given
from softbrake.case.keys import Key, mapping_schema
from softbrake.case.section import Draft, Part, Section
from softbrake.case.sections.gas import check_flow
from softbrake.case.units import Dimension
from softbrake.case.yaml_nodes import Node, join


@dataclass(frozen=True)
class Vent(Part):
    """Orifice of the bag. It opens once, at first where nothing is said, and closes once, for good."""

    area: float  # m^2
    discharge: tuple[float, ...]  # coefficient, at the pressure ratios
    pressure_ratio: tuple[float, ...]  # ambient over inside, increasing; the first and the last coefficient hold beyond
    opens_at_pressure: float | None  # Pa, gauge
    opens_at_time: float | None  # s
    opens_at_height: float | None  # m, of the upper cover
    closes_at_pressure: float | None  # Pa, gauge
    closes_at_height: float | None  # m
    inflow: bool  # whether it lets ambient gas in

    def key(self, field: str) -> Key | None:
        """Those of nested keys too; `inflow` is a word in a file."""
        return _FIELDS.get(field)


_AREA = Key("area", Dimension.AREA, "open", "300 cm^2", required=True, above=0)
_RATIOS = Key(
    "pressure_ratio", Dimension.RATIO, "ambient over inside, increasing", "[0.5, 1]", required=True, least=0, most=1, many=True
)
_COEFFICIENTS = Key(
    "coefficient", Dimension.RATIO, "at each ratio; linear between", "[0.75, 0.6]", required=True, above=0, most=1, many=True
)
_PRESSURE = Key("pressure", Dimension.PRESSURE, "gauge, that it exceeds", "60 kPa", least=0)
_TIME = Key("time", Dimension.TIME, "since first contact", "30 ms", least=0)
_HEIGHT = Key("height", Dimension.LENGTH, "of the cover on its way down", "0.4 m", above=0)
_FALLING = Key("pressure", Dimension.PRESSURE, "gauge, that it falls below", "20 kPa", least=0)
_EACH = (
    _AREA,
    Key(
        "discharge",
        Dimension.RATIO,
        "coefficient, or a table over the pressure ratio",
        "0.6",
        required=True,
        above=0,
        most=1,
        parts=(_RATIOS, _COEFFICIENTS),
    ),
    Key(
        "opens",
        ("always",),
        "when it opens: always, or once at a pressure, time or height",
        "{pressure: 60 kPa}",
        default="always",
        parts=(_PRESSURE, _TIME, _HEIGHT),
        one_part=True,
    ),
    Key(
        "closes",
        ("never",),
        "when it closes, for good: never, or at a pressure or height",
        "{pressure: 20 kPa}",
        default="never",
        parts=(_FALLING, _HEIGHT),
        one_part=True,
    ),
    Key("inflow", ("none", "allowed"), "of ambient gas, where the pressure is below ambient's", "none", default="none"),
)
_FIELDS = {
    "area": _AREA,
    "discharge": _COEFFICIENTS,
    "pressure_ratio": _RATIOS,
    "opens_at_pressure": _PRESSURE,
    "opens_at_time": _TIME,
    "opens_at_height": _HEIGHT,
    "closes_at_pressure": _FALLING,
    "closes_at_height": _HEIGHT,
}


class _VentsSection(Section):
    def read(self, draft: Draft) -> list[Values]:
        """Values of each vent, as far as they are without faults."""
        node = draft.members.get(self.name)
        if node is None:
            return []
        if not isinstance(node.value, list):
            draft.fault(node.place, self.name, "not a list", f"a list such as [{{{EXAMPLE}}}] is expected")
            return []
        if node.value:
            check_flow(draft, self.name)
        vents = []
        for number, item in enumerate(node.value):
            path = join(self.name, number)
            vents.append(draft.mapping(item, path, self.each))
            if isinstance(item.value, dict):
                _check(draft, item, path, vents[-1])
        return vents

    def build(self, draft: Draft) -> tuple[Vent, ...]:
        """Each vent with its nested keys."""
        return tuple(_vent(values) for values in draft.values(self.name))

    def written(self, part: tuple[Vent, ...]) -> list[Values]:
        """A list, of nested keys those that are not as by default."""
        return [_written(vent) for vent in part]

    def schema(self) -> dict[str, Any]:
        """A list."""
        items = mapping_schema(self.each)
        return {"description": "openings that let gas out; none when left out", "type": "array", "items": items}

    def starter(self) -> list[str]:
        """One vent with every key, as a comment."""
        first, *others = self.each
        return [f"# {self.name}:", first.starter("  # - ", True), *(key.starter("  #   ", True) for key in others)]


VENTS = _VentsSection("vents", Vent, (), each=_EACH, optional=True, physical=True, begun=False)
EXAMPLE = ", ".join(f"{key.name}: {key.example}" for key in _EACH if key.required)


def _vent(values: Values) -> Vent:
    discharge, opens, closes = values["discharge"], values["opens"], values["closes"]
    table = discharge if isinstance(discharge, dict) else {"coefficient": (discharge,), "pressure_ratio": (0.0,)}
    opening = opens if isinstance(opens, dict) else {}
    closing = closes if isinstance(closes, dict) else {}
    return Vent(
        area=values["area"],
        discharge=table["coefficient"],
        pressure_ratio=table["pressure_ratio"],
        opens_at_pressure=opening.get("pressure"),
        opens_at_time=opening.get("time"),
        opens_at_height=opening.get("height"),
        closes_at_pressure=closing.get("pressure"),
        closes_at_height=closing.get("height"),
        inflow=values["inflow"] == "allowed",
    )


def _written(vent: Vent) -> Values:
    table = {"pressure_ratio": list(vent.pressure_ratio), "coefficient": list(vent.discharge)}
    opens = {"pressure": vent.opens_at_pressure, "time": vent.opens_at_time, "height": vent.opens_at_height}
    closes = {"pressure": vent.closes_at_pressure, "height": vent.closes_at_height}
    return {
        "area": vent.area,
        "discharge": table if len(vent.discharge) > 1 else vent.discharge[0],
        "opens": {name: value for name, value in opens.items() if value is not None} or "always",
        "closes": {name: value for name, value in closes.items() if value is not None} or "never",
        "inflow": "allowed" if vent.inflow else "none",
    }


def _check(draft: Draft, node: Node, path: str, vent: Values) -> None:
    """No wider than the cover; thresholds on the shell, and in the order of a drop."""
    shell = draft.values("shell")
    if "diameter" in shell and "area" in vent and vent["area"] > (cover := math.pi / 4.0 * shell["diameter"] ** 2):
        place, where = last_given(node, path, ["area"])
        fault = f"{vent['area']:.6g} m^2 is wider than the cover"
        draft.fault(place, where, fault, f"an area up to that of the cover, {cover:.6g} m^2, is expected")
    assert isinstance(node.value, dict)
    if isinstance(table := vent.get("discharge"), dict):
        draft.table(node.value["discharge"], join(path, "discharge"), table, _RATIOS, _COEFFICIENTS)
    opens, closes = ({} if isinstance(vent.get(name, ""), str) else vent[name] for name in ("opens", "closes"))
    for name, values in (("opens", opens), ("closes", closes)):
        if "height" in shell and values.get("height", 0.0) > shell["height"]:
            place, where = last_given(node.value[name], join(path, name), ["height"])
            fault = f"{values['height']:.6g} m is above the shell"
            draft.fault(place, where, fault, f"a height up to shell.height, {shell['height']:g} m, is expected")
    for name, unit in (("pressure", "Pa"), ("height", "m")):
        if name in opens and name in closes and opens[name] <= closes[name]:
            ends = [last_given(node.value[end], join(path, end), [name]) for end in ("opens", "closes")]
            place, where = max(ends, key=lambda end: end[0].order)
            fault = f"it opens at {opens[name]:.6g} {unit} and closes at {closes[name]:.6g} {unit}"
            draft.fault(place, where, fault, f"a {name} of opening above that of closing is expected")
