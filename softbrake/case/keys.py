"""Table of the keys of a case file: it feeds the checks, the messages, the JSON Schema and the starter case."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from softbrake.case.units import PATTERN, Dimension, parse_quantity


@dataclass(frozen=True)
class Key:
    """One key. Bounds and default in SI units; a key that is neither required nor has a default may be left out."""

    name: str
    kind: Dimension | type[int] | type[str] | tuple[str, ...] | tuple[int, ...]  # quantity, integer, text or one of these
    meaning: str
    example: str  # value as the starter case writes it
    default: float | int | str | None = None
    computed: str = ""  # in words, a default that depends on other keys
    required: bool = False
    above: float | None = None
    least: float | None = None
    most: float | None = None
    many: bool = False  # a list of such values
    auto: str = ""  # the word auto is allowed; what a number looks like
    begun: bool = False  # stands in the starter case though it may be left out

    @property
    def wanted(self) -> str:
        """What is allowed for one value."""
        if isinstance(self.kind, tuple):
            return " or ".join(map(str, self.kind))
        phrase = {int: "an integer", str: "a text"}[self.kind] if isinstance(self.kind, type) else self.kind.phrase
        limits = ((">", self.above), (">=", self.least), ("<=", self.most))
        bounds = " and ".join(f"{sign} {bound:g}" for sign, bound in limits if bound is not None)
        return ("auto or " if self.auto else "") + f"{phrase} {bounds}".rstrip() + f" such as '{self.auto or self.example}'"

    def convert(self, value: Any) -> float | int | str:
        """SI value of a scalar of the file; ValueError says in words what is wrong with it."""
        if value is None:
            raise ValueError("no value")
        if isinstance(value, (list, dict)):
            raise ValueError(f"{'a list' if isinstance(value, list) else 'a mapping'} is not one value")
        shown = f"'{value}'" if isinstance(value, str) else str(value).lower()
        if self.auto and value == "auto":
            return "auto"
        if isinstance(self.kind, tuple):
            if value not in self.kind or not isinstance(value, (str, int)):
                raise ValueError(f"unknown value {shown}")
            return value
        if self.kind is str:
            if not isinstance(value, str):
                raise ValueError(f"{shown} is not a text (quote it)")
            return value
        number = self._number(value, shown)
        if number and not 1e-30 < abs(number) < 1e30:  # so that no formula over- or underflows later
            raise ValueError(f"{shown[:40]} is not between 1e-30 and 1e30 in SI units")
        if (
            (self.above is not None and number <= self.above)
            or (self.least is not None and number < self.least)
            or (self.most is not None and number > self.most)
        ):
            raise ValueError(f"{shown} is out of range")
        return number

    def _number(self, value: str | float | bool, shown: str) -> float | int:
        if isinstance(value, bool):
            raise ValueError(f"{shown} is not a number")
        if isinstance(value, str):
            if not isinstance(self.kind, Dimension):
                raise ValueError(f"{shown} is not an integer")
            return parse_quantity(value, self.kind)
        try:
            number = float(value)
        except OverflowError:
            number = math.inf
        if not math.isfinite(number):
            raise ValueError(f"{shown[:40]} is not a finite number")
        if self.kind is not int:
            return number
        if number != int(number):
            raise ValueError(f"{shown} is not an integer")
        return int(value)


Alternatives = tuple[tuple[tuple[str, ...], ...], ...]  # choices; of each, exactly one group of keys must be given
_DAMPING = Key("damping", Dimension.INVERSE_SPEED, "nu^n of (2.11): moving cloth feels less", "0 s/m", default=0.0, least=0)
_BELT = (
    Key("layers", Dimension.RATIO, "layers of the shell's fabric in a belt", "5", above=0),
    Key("stiffness", Dimension.FORCE, "instead of layers: force per unit elongation", "1.7 kN", above=0),
    Key("line_density", Dimension.LINE_DENSITY, "with stiffness", "4.2 g/m", above=0),
    Key("width", Dimension.LENGTH, "of a belt along the generatrix", "16.667 mm", required=True, above=0),
    Key(
        "strength",
        Dimension.TENSION,
        "tension per width that it bears, for a margin",
        "150 kN/m",
        computed="layers times fabric.strength",
        above=0,
    ),
)
BELTS = (Key("count", int, "belts at uniform spacing; 0 is allowed", "3", required=True, least=0), *_BELT)
LISTED_BELT = (
    Key("height", Dimension.LENGTH, "of the belt's middle above the lower cover", "0.3 m", required=True, above=0),
    *_BELT,
)
PRESSURE = {
    "constant": (Key("value", Dimension.PRESSURE, "excess pressure (constant)", "15696 Pa", required=True, least=0), _DAMPING),
    "sine": (
        Key("peak_time", Dimension.TIME, "of the largest pressure (sine)", "0.1 s", required=True, above=0),
        Key("end_time", Dimension.TIME, "end of the pressure (sine)", "0.2 s", computed="full stop, 2 height/velocity", above=0),
        Key("value", Dimension.PRESSURE, "largest pressure (sine)", "32 kPa", computed="full stop, section 2.2", least=0),
        _DAMPING,
    ),
    "table": (
        Key("times", Dimension.TIME, "increasing (table)", "[0 s, 0.1 s]", required=True, least=0, many=True),
        Key("values", Dimension.PRESSURE, "at these times (table)", "[0 kPa, 15 kPa]", required=True, least=0, many=True),
        _DAMPING,
    ),
}
LAW = Key("law", tuple(PRESSURE), "over time; sine is (2.10)", "constant", required=True)

# Courant coefficient by the damping ratio of the shortest wave; of drops at most 2 % gain energy (docs/validation/stability.md):
# the bound is that of a taut shell; fabric that gets slack and taut again feeds waves near it, unless viscosity eats them.
AUTO_COURANT = ((0.03, 0.95), (0.01, 0.75), (0.003, 0.6), (0.0, 0.35))
FINE, COARSE = 18, 12  # cells in a radius: of a default grid, and below which a shell is too coarse
HOOP = 120  # cells around the hoop by default: 19 in a radius, in whole vectors
BETWEEN_BELTS = 6  # least cells of a default grid between two belts, or a belt and a cover, where that is not 4 times finer
CONTACT = ("ground", "belts", "cover", "cargo", "axis", "folds")  # what stops the fabric
CFC = (60, 180, 600, 1000)  # channel frequency classes of SAE J211
SHEAR = 0.05  # of the smaller of E11 and E22: default of G12
UNKNOWN_CONTACT = {"full": ("axis",), "axisymmetric": (), "lumped": (), "auto": ()}  # by fidelity
CONTACT_SETS = {
    "full": ("ground", "cover", "cargo", "axis", "folds"),
    "solid": ("ground", "cover", "cargo"),
    "paper": ("ground", "belts"),
}
TOP = (
    Key("title", str, "heads the results", "My drop", computed="name of the file"),
    Key("gravity", Dimension.ACCELERATION, "downwards", "9.80665 m/s^2", default=9.80665, least=0),
    Key(
        "tolerance",
        Dimension.RATIO,
        "of the impact velocity; chooses fidelity, grid, step",
        "1 %",
        computed="none; fidelity: auto aims at 2 %",
        above=0,
        most=0.5,
    ),
    Key("initial", ("unloaded", "inflated"), "shape at first contact", "unloaded", default="unloaded"),
    Key("friction", Dimension.RATIO, "Coulomb's coefficient of fabric on ground and cover", "0.3", default=0.0, least=0),
)
SECTIONS: dict[str, tuple[Key, ...]] = {
    "shell": (
        Key("diameter", Dimension.LENGTH, "of the unloaded shell and of the covers", "0.5 m", required=True, above=0),
        Key("height", Dimension.LENGTH, "cutting height between the covers", "0.6 m", required=True, above=0),
    ),
    "fabric": (
        Key("E", Dimension.TENSION, "modulus, both ways", "20 kN/m", above=0),
        Key("E11", Dimension.TENSION, "instead of E: along the generatrix", "20 kN/m", above=0),
        Key("E22", Dimension.TENSION, "instead of E: around the hoop", "20 kN/m", above=0),
        Key(
            "nu12",
            Dimension.RATIO,
            "Poisson's ratio: hoop contraction over generatrix stretch",
            "0.25",
            computed="nu21 E22/E11, or 0",
            least=0,
            begun=True,
        ),
        Key("nu21", Dimension.RATIO, "instead, the other way", "0.25", computed="nu12 E11/E22", least=0),
        Key("G12", Dimension.TENSION, "shear modulus", "1 kN/m", computed="5 % of E, of the smaller one", least=0),
        Key("areal_density", Dimension.AREAL_DENSITY, "unloaded", "0.05 kg/m^2", required=True, above=0),
        Key("damping_ratio", Dimension.RATIO, "of critical damping of the breathing hoop", "3 %", least=0),
        Key("viscosity", Dimension.VISCOSITY, "instead: tension per stretch rate", "0.2 N*s/m", least=0),
        Key(
            "law",
            ("tension_field", "nominal_tension", "true_tension"),
            "(2.9) is true_tension",
            "tension_field",
            default="tension_field",
        ),
        Key(
            "slack",
            ("cut", "compression"),
            "it carries nothing, or compression",
            "cut",
            default="cut",
        ),
        Key("strength", Dimension.TENSION, "tension that it bears, for a margin", "30 kN/m", above=0),
    ),
    "belts": BELTS,
    "cargo": (
        Key("mass", Dimension.MASS, "of the falling body", "100 kg", required=True, above=0),
        Key("velocity", Dimension.SPEED, "downwards, at first contact", "6 m/s", required=True, above=0),
        Key("diameter", Dimension.LENGTH, "of the body on the cover", "0.4 m", computed="shell.diameter", above=0),
        Key("height", Dimension.LENGTH, "of the body on the cover", "0.5 m", computed="no top", above=0),
    ),
    "pressure": (LAW, *{key.meaning: key for keys in PRESSURE.values() for key in keys}.values()),
    "grid": (
        Key(
            "generatrix",
            int,
            "cells along the generatrix",
            "44",
            computed="an 18th of the radius long, or by belts",
            least=4,
            most=10_000,
        ),
        Key("hoop", int, "cells around the hoop", "120", computed="120", least=8, most=10_000),
    ),
    "time": (
        Key(
            "courant",
            Dimension.RATIO,
            "part of the longest stable step (3.3), or auto",
            "auto",
            default="auto",
            above=0,
            auto="0.5",
        ),
        Key("end", Dimension.TIME, "of the run, if nothing stops it before", "1 s", default=1.0, above=0),
    ),
    "model": (
        Key("scheme", ("edge", "cell"), "cell is (3.2) as printed", "edge", default="edge"),
        Key(
            "fidelity",
            tuple(UNKNOWN_CONTACT),
            "level",
            "auto",
            computed="auto, full on a grid given",
        ),
    ),
    "output": (
        Key("snapshot_interval", Dimension.TIME, "between pictures of the shell", "2 ms", computed="time.end/150", above=0),
        Key("history_interval", int, "steps between rows of the history", "1", default=1, least=1),
        Key("cfc", CFC, "channel frequency class (SAE J211) of filtered peaks", "180", default=180),
    ),
}
SWEEP = (
    Key("mode", ("grid", "zip", "lhs"), "every combination, side by side, or a Latin hypercube", "grid", default="grid"),
    Key("samples", int, "runs of a Latin hypercube", "100", least=1, most=1_000_000),
    Key("seed", int, "of its random numbers", "1", default=0, least=0),
)
PHYSICS = ("shell", "fabric", "belts", "cargo", "pressure")  # sections that describe the drop, not its computation
OPTIONAL_SECTIONS = {"belts", "grid", "time", "model", "output"}
ALTERNATIVES: dict[str, Alternatives] = {
    "fabric": ((("E",), ("E11", "E22")), (("damping_ratio",), ("viscosity",))),
    "belts": ((("layers",), ("stiffness", "line_density")),),
}
_CONTACT = "what stops the fabric: full, solid, paper, or parts"


def key_at(path: str) -> Key | None:
    """The key of a dotted path, as of an override; None if there is none."""
    *parents, name = path.split(".")
    section = parents[0] if parents else ""
    keys = LISTED_BELT if section == "belts" and len(parents) == 2 else SECTIONS.get(section, ()) if parents[1:] == [] else ()
    return next((key for key in (keys if section else TOP) if key.name == name), None)


def needed(section: str) -> list[Key]:
    """The keys of the shortest section: the required ones and the first of alternatives."""
    first = {name for groups in ALTERNATIVES.get(section, ()) for name in groups[0]}
    keys = (LAW, *PRESSURE["constant"]) if section == "pressure" else SECTIONS[section]
    return [key for key in keys if key.required or key.name in first]


def schema() -> dict[str, Any]:
    """JSON Schema (draft 2020-12) of a case file."""
    properties: dict[str, Any] = {key.name: _value_schema(key) for key in TOP}
    for name, keys in SECTIONS.items():
        properties[name] = _section_schema(keys, ALTERNATIVES.get(name, ()))
    stack = properties["belts"]
    choices = {"required": ["width"], "allOf": stack.pop("allOf")}
    stack |= {"required": ["count"], "if": {"properties": {"count": {"const": 0}}}, "else": choices}
    listed = {"type": "array", "items": _section_schema(LISTED_BELT, ALTERNATIVES["belts"])}
    properties["belts"] = {"description": "ring belts; none when left out", "oneOf": [stack, listed]}
    some: dict[str, Any] = {"type": "array", "items": {"enum": list(CONTACT)}, "uniqueItems": True}
    properties["contact"] = {"description": _CONTACT, "oneOf": [{"enum": [*CONTACT_SETS, *CONTACT]}, some]}
    properties["pressure"] = {"oneOf": [_pressure_schema(law) for law in PRESSURE]}
    axis = {"description": "START:STOP:COUNT, also :log, or a list of values", "type": ["string", "array"], "minItems": 1}
    sweep = _section_schema(SWEEP, ())
    sweep["properties"]["vary"] = {"description": "values by key, as fabric.E", "type": "object", "additionalProperties": axis}
    properties["sweep"] = sweep | {"description": "what `softbrake sweep` varies; else not read", "required": ["vary"]}
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "softbrake case file",
        "type": "object",
        "properties": properties,
        "required": [name for name in SECTIONS if name not in OPTIONAL_SECTIONS],
        "additionalProperties": False,
        "$defs": {"quantity": {"type": "string", "pattern": PATTERN}},
    }


def _pressure_schema(law: str) -> dict[str, Any]:
    section = _section_schema((LAW, *PRESSURE[law]), ())
    section["properties"]["law"] = {"const": law, "description": LAW.meaning}
    return section


def _section_schema(keys: tuple[Key, ...], alternatives: Alternatives) -> dict[str, Any]:
    section: dict[str, Any] = {
        "type": "object",
        "properties": {key.name: _value_schema(key) for key in keys},
        "required": [key.name for key in keys if key.required],
        "additionalProperties": False,
    }
    if alternatives:
        section["allOf"] = [{"oneOf": [_only(group, groups) for group in groups]} for groups in alternatives]
    return section


def _only(group: tuple[str, ...], groups: tuple[tuple[str, ...], ...]) -> dict[str, Any]:
    others = [{"required": [name]} for other in groups if other != group for name in other]
    return {"required": list(group), "not": {"anyOf": others}}


def _value_schema(key: Key) -> dict[str, Any]:
    value: dict[str, Any]
    if isinstance(key.kind, tuple):
        value = {"enum": list(key.kind)}
    elif key.kind is str:
        value = {"type": "string"}
    else:
        bounds = {"exclusiveMinimum": key.above, "minimum": key.least, "maximum": key.most}
        value = {"type": "integer" if key.kind is int else "number"} | {k: v for k, v in bounds.items() if v is not None}
        if isinstance(key.kind, Dimension):
            words = [{"const": "auto"}] if key.auto else []
            value = {"anyOf": [value, *words, {"$ref": "#/$defs/quantity"}]}
    if key.many:
        value = {"type": "array", "minItems": 2, "items": value}
    value["description"] = _describe(key)
    if key.default is not None:
        value["default"] = key.default
    elif not key.many:
        value["examples"] = [int(key.example) if key.kind is int else key.example]
    return value


def _describe(key: Key) -> str:
    """Meaning, words or SI unit, and default of a key in one line."""
    unit = f" [{key.kind.unit}]" if isinstance(key.kind, Dimension) and key.kind.unit else ""
    words = f" ({' | '.join(map(str, key.kind))})" if isinstance(key.kind, tuple) else ""
    default = f"{key.default:.7g}" if isinstance(key.default, (int, float)) else key.computed or key.default
    return key.meaning + words + unit + (f"; default {default}" if default else "")


def starter() -> str:
    """Text of a case file to begin with, one comment a key: meaning, SI unit, default."""
    lines = [
        "# yaml-language-server: $schema=case.schema.json",
        "# The schema for your editor: softbrake schema > case.schema.json. A bare number is in the unit in brackets.",
    ]
    lines += [_starter_line(key, "", key.name in ("title", "gravity")) for key in TOP]
    lines.append("contact: full".ljust(34) + f"# {_CONTACT}")
    for name, keys in SECTIONS.items():
        live = [key for key in keys if key in needed(name) or key.default is not None or key.begun] if name != "belts" else []
        lines.append(f"{'' if live else '# '}{name}:")
        lines += [_starter_line(key, "  ", key in live) for key in keys]
    return "\n".join(lines) + "\n"


def _starter_line(key: Key, indent: str, live: bool) -> str:
    return f"{indent}{'' if live else '# '}{key.name}: {key.example}".ljust(34) + f"# {_describe(key)}"
