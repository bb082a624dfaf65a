"""Section `shell`: the unloaded wall between the covers, by the shape of its generatrix."""

from __future__ import annotations

import math
from bisect import bisect_right
from dataclasses import asdict, dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any, Literal, get_args

from softbrake.case.checker import Values, last_given, listed
from softbrake.case.generatrix import Generatrix, Place, bulging, hung, straight, through, zone
from softbrake.case.keys import Key, mapping_schema
from softbrake.case.section import Draft, Part, Section
from softbrake.case.units import Dimension
from softbrake.case.yaml_nodes import join

Profile = Literal["cylinder", "cone", "barrel", "sphere", "table", "pattern"]


@dataclass(frozen=True)
class Shell(Part):
    """Wall between two covers; of a profile those fields that it has no key for follow from the others."""

    diameter: float  # m, largest of the unloaded wall
    height: float  # m, of the upper cover at first contact
    profile: Profile = "cylinder"
    lower_diameter: float = 0.0  # m, of the covers; 0 until the profile is known: as the wall's
    upper_diameter: float = 0.0
    bulge: float = 0.0  # m, radius of the generatrix of a barrel; 0 of others
    heights: tuple[float, ...] = ()  # m, from 0 on, increasing (table), else empty
    lengths: tuple[float, ...] = ()  # m, of cloth from the lower cover, from 0 on, increasing (pattern), else empty
    diameters: tuple[float, ...] = ()  # m, of the unloaded hoops there, as many

    def __post_init__(self) -> None:
        """Covers of a cylinder are as wide as it. Raises ValueError."""
        if self.profile == "cylinder":
            object.__setattr__(self, "lower_diameter", self.diameter)
            object.__setattr__(self, "upper_diameter", self.diameter)
        super().__post_init__()

    def key(self, field: str) -> Key | None:
        """Only those of its profile."""
        return next((key for key in PROFILES[self.profile] if key.name == field), None)

    @cached_property
    def generatrix(self) -> Generatrix:
        """Where the wall is at first, m: as long as its cloth, but of a pattern."""
        return generatrix_of(self.profile, asdict(self))

    @property
    def wall(self) -> float:
        """Length of the cloth from cover to cover, m."""
        return self.lengths[-1] if self.lengths else self.generatrix.length

    @property
    def area(self) -> float:
        """Of the cloth, m^2."""
        if not self.lengths:
            return self.generatrix.area
        pieces = zip(pairwise(self.lengths), pairwise(self.diameters), strict=True)
        return sum(0.5 * math.pi * (one + other) * (stop - start) for (start, stop), (one, other) in pieces)

    @property
    def mean_diameter(self) -> float:
        """Of the cylinder of the same height and volume, m."""
        return self.diameter if self.profile == "cylinder" else self.generatrix.mean_diameter

    def at(self, along: float) -> Place:
        """Height and radius (m) at first of the cloth so far (m) from the lower cover."""
        if not self.lengths:
            return self.generatrix.at(along)
        piece, share = self._piece(along)
        return self.generatrix.pieces[piece].at(share * self.generatrix.pieces[piece].length)

    def hoop(self, along: float) -> float:
        """Unloaded radius (m) of the cloth so far (m) from the lower cover."""
        if not self.lengths:
            return self.generatrix.at(along)[1]
        piece, share = self._piece(along)
        one, other = self.diameters[piece : piece + 2]
        return 0.5 * (one + share * (other - one))

    def along(self, height: float) -> float:
        """How far (m of cloth) from the lower cover the wall first has a height (m) at first."""
        return self.wall * height / self.height if self.lengths else self.generatrix.along(height)

    def _piece(self, along: float) -> tuple[int, float]:
        """Number of the piece of a pattern, and how far along it, 0 to 1."""
        piece = min(max(bisect_right(self.lengths, along) - 1, 0), len(self.lengths) - 2)
        start, stop = self.lengths[piece : piece + 2]
        return piece, (along - start) / (stop - start)


_DIAMETER = Key("diameter", Dimension.LENGTH, "of the unloaded shell and of the covers", "0.5 m", required=True, above=0)
_BALL = Key("diameter", Dimension.LENGTH, "of the ball (sphere)", "1.2 m", required=True, above=0)
_HEIGHT = Key("height", Dimension.LENGTH, "cutting height between the covers", "0.6 m", required=True, above=0)
_LOWER = Key("lower_diameter", Dimension.LENGTH, "of the cover on the ground", "0.6 m", required=True, above=0)
_UPPER = Key("upper_diameter", Dimension.LENGTH, "of the cover under the cargo", "0.5 m", required=True, above=0)
_BULGE = Key("bulge", Dimension.LENGTH, "radius of the generatrix, an arc (barrel)", "0.5 m", required=True, above=0)
_HEIGHTS = Key(
    "heights", Dimension.LENGTH, "from 0 on, increasing (table)", "[0 m, 0.2 m, 0.6 m]", required=True, least=0, many=True
)
_DIAMETERS = Key(
    "diameters", Dimension.LENGTH, "of the unloaded hoops there", "[0.5 m, 0.7 m, 0.4 m]", required=True, above=0, many=True
)
_LENGTHS = Key("lengths", Dimension.LENGTH, "of cloth, from 0 (pattern)", "[0 m, 0.5 m, 1 m]", required=True, least=0, many=True)
PROFILES: dict[str, tuple[Key, ...]] = {
    "cylinder": (_DIAMETER, _HEIGHT),
    "cone": (_LOWER, _UPPER, _HEIGHT),
    "barrel": (_LOWER, _UPPER, _HEIGHT, _BULGE),
    "sphere": (_BALL, _LOWER, _UPPER),
    "table": (_HEIGHTS, _DIAMETERS),
    "pattern": (_HEIGHT, _LENGTHS, _DIAMETERS),
}
PROFILE = Key("profile", get_args(Profile), "of the unloaded wall", "cylinder", default="cylinder")


def generatrix_of(profile: str, values: Values) -> Generatrix:
    """Return the generatrix of a profile by the values of its keys. Raises ValueError: what is wrong; what is allowed."""
    if profile == "cylinder":
        return straight(values["height"], 0.5 * values["diameter"], 0.5 * values["diameter"])
    if profile == "pattern":
        return hung(values["height"], values["lengths"], values["diameters"])
    if profile == "table":
        return through([(z, 0.5 * diameter) for z, diameter in zip(values["heights"], values["diameters"], strict=True)])
    lower, upper = 0.5 * values["lower_diameter"], 0.5 * values["upper_diameter"]
    if profile == "sphere":
        return zone(values["diameter"], lower, upper)
    if profile == "barrel":
        return bulging(values["height"], lower, upper, values["bulge"])
    return straight(values["height"], lower, upper)


def completed(values: Values) -> Values:
    """Return fields of a Shell of the values of a profile's keys. Raises ValueError as `generatrix_of`."""
    shell = {"profile": "cylinder", **values}
    if shell["profile"] == "cylinder":
        return shell | {"lower_diameter": shell["diameter"], "upper_diameter": shell["diameter"]}
    generatrix = generatrix_of(shell["profile"], shell)
    ends = {"lower_diameter": 2.0 * generatrix.at(0.0)[1], "upper_diameter": 2.0 * generatrix.at(generatrix.length)[1]}
    widest = max(shell["diameters"]) if shell["profile"] == "pattern" else 2.0 * generatrix.widest
    return {"height": generatrix.height, **ends, **shell, "diameter": widest}


def shell_of(written: Values) -> Shell:
    """The shell of a resolved case, as a result file has it."""
    fields: Values = {name: tuple(value) if isinstance(value, list) else value for name, value in completed(written).items()}
    return Shell(**fields)


class _ShellSection(Section):
    def read(self, draft: Draft) -> Values:
        """Keys of the profile that is given, with what follows of them: diameter, height, diameters of the covers."""
        node = self.node(draft)
        if node is None:
            return {}
        members = node.value if isinstance(node.value, dict) else {}
        profile = members["profile"].value if "profile" in members else "cylinder"
        if not isinstance(profile, str) or profile not in PROFILES:
            draft.mapping(node, self.name, self.keys, complete=False)
            return {}
        keys = (PROFILE, *PROFILES[profile])
        own = {key.name for key in keys}
        foreign = list(dict.fromkeys(key.name for key in self.keys if key.name not in own))
        for name in (name for name in members if name in foreign):
            fault = f"not a key of the profile {profile}"
            draft.fault(members[name].key, join(self.name, name), fault, f"{listed(keys)} are expected")
        told = len(draft.faults)
        shell = draft.mapping(node, self.name, keys, others=foreign)
        if profile in ("table", "pattern"):
            rising = _HEIGHTS if profile == "table" else _LENGTHS
            draft.table(node, self.name, shell, rising, _DIAMETERS)
            if shell.get(rising.name, (0.0,))[0] != 0.0:
                place, where = last_given(node, self.name, [rising.name])
                draft.fault(place, f"{where}.0", "not at the lower cover", "0 m is expected")
        if len(draft.faults) > told:
            return {name: value for name, value in shell.items() if profile == "cylinder" and name != "profile"}
        try:
            return completed(shell)
        except ValueError as error:
            fault, _, allowed = str(error).partition("; ")
            place, where = last_given(node, self.name, [key.name for key in PROFILES[profile]])
            draft.fault(place, where, fault, f"{allowed} is expected")
            return {}

    def written(self, part: Shell) -> Values:
        """Keys of the profile alone."""
        values = {"profile": part.profile} | {key.name: getattr(part, key.name) for key in PROFILES[part.profile]}
        return {name: list(value) if isinstance(value, tuple) else value for name, value in values.items() if value is not None}

    def needed(self) -> list[Key]:
        """Those of a cylinder."""
        return [key for key in PROFILES["cylinder"] if key.required]

    def schema(self) -> dict[str, Any]:
        """One of the profiles."""
        return {"oneOf": [_profile_schema(profile) for profile in PROFILES]}

    def starter(self) -> list[str]:
        """A cylinder; keys of other profiles as comments."""
        keys = {key.name: key for key in (*reversed(self.keys), *PROFILES["cylinder"])}
        own = [key.name for key in PROFILES["cylinder"]]
        shown = [keys[name] for name in (*own, *(key.name for key in self.keys if key.name not in own))]
        return [f"{self.name}:", *(key.starter("  ", key.name in own) for key in dict.fromkeys(shown))]


def _profile_schema(profile: str) -> dict[str, Any]:
    section = mapping_schema((PROFILE, *PROFILES[profile]))
    section["properties"]["profile"] = {"const": profile, "description": PROFILE.meaning}
    if profile != "cylinder":
        section["required"] = ["profile", *section["required"]]
    return section


SHELL = _ShellSection(
    "shell",
    Shell,
    (PROFILE, *{key.meaning: key for keys in PROFILES.values() for key in keys}.values()),
    physical=True,
)
