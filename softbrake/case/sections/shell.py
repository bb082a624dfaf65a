"""Section `shell`: the unloaded wall between the covers, by the shape of its generatrix."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Any, Literal, get_args

from softbrake.case.checker import Values, last_given, listed
from softbrake.case.generatrix import Generatrix, bulging, straight, through, zone
from softbrake.case.keys import Key, mapping_schema
from softbrake.case.section import Draft, Part, Section
from softbrake.case.units import Dimension
from softbrake.case.yaml_nodes import join

Profile = Literal["cylinder", "cone", "barrel", "sphere", "table"]
NEAR = 1e-9  # relative, of lengths that are the same


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
    diameters: tuple[float, ...] = ()  # m, of the wall there, as many
    length: float | None = None  # m, unloaded, of the generatrix; None: that of the profile

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
        """The profile, m."""
        return generatrix_of(self.profile, asdict(self))

    @property
    def slack(self) -> float:
        """Unloaded length of the generatrix over that of the profile."""
        return 1.0 if self.length is None else self.length / self.generatrix.length

    @property
    def wall(self) -> float:
        """Length of the profile from cover to cover, m."""
        return self.generatrix.length

    @property
    def mean_diameter(self) -> float:
        """Of the cylinder of the same height and volume, m."""
        return self.diameter if self.profile == "cylinder" else self.generatrix.mean_diameter


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
    "diameters", Dimension.LENGTH, "of the wall there (table)", "[0.5 m, 0.7 m, 0.4 m]", required=True, above=0, many=True
)
_LENGTH = Key("length", Dimension.LENGTH, "of the cloth from cover to cover", "0.7 m", computed="the profile's", above=0)
PROFILES: dict[str, tuple[Key, ...]] = {
    "cylinder": (_DIAMETER, _HEIGHT, _LENGTH),
    "cone": (_LOWER, _UPPER, _HEIGHT, _LENGTH),
    "barrel": (_LOWER, _UPPER, _HEIGHT, _BULGE, _LENGTH),
    "sphere": (_BALL, _LOWER, _UPPER, _LENGTH),
    "table": (_HEIGHTS, _DIAMETERS, _LENGTH),
}
PROFILE = Key("profile", get_args(Profile), "of the unloaded wall", "cylinder", default="cylinder")


def generatrix_of(profile: str, values: Values) -> Generatrix:
    """Return the generatrix of a profile by the values of its keys. Raises ValueError: what is wrong; what is allowed."""
    if profile == "cylinder":
        return straight(values["height"], 0.5 * values["diameter"], 0.5 * values["diameter"])
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
    return {"height": generatrix.height, **ends, **shell, "diameter": 2.0 * generatrix.widest}


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
        if profile == "table":
            draft.table(node, self.name, shell, _HEIGHTS, _DIAMETERS)
            if shell.get("heights", (0.0,))[0] != 0.0:
                place, where = last_given(node, self.name, ["heights"])
                draft.fault(place, f"{where}.0", "the lower cover lies on the ground", "0 m is expected")
        if len(draft.faults) > told:
            return {name: value for name, value in shell.items() if profile == "cylinder" and name != "profile"}
        try:
            generatrix = generatrix_of(profile, shell)
        except ValueError as error:
            fault, _, allowed = str(error).partition("; ")
            place, where = last_given(node, self.name, [key.name for key in PROFILES[profile]])
            draft.fault(place, where, fault, f"{allowed} is expected")
            return {}
        if shell.get("length", generatrix.length) < generatrix.length * (1.0 - NEAR):
            place, where = last_given(node, self.name, ["length"])
            fault = f"the cloth is shorter than the profile, {generatrix.length:.6g} m"
            draft.fault(place, where, fault, f"a length of {generatrix.length:.6g} m or more is expected")
        return completed(shell)

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
        """A cylinder, and that there are others."""
        keys = (*PROFILES["cylinder"], PROFILE)
        return [f"{self.name}:", *(key.starter("  ", key.required) for key in keys)]


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
