"""Section `belts`: ring belts at uniform spacing, or a list of belts."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from softbrake.case.checker import Checker, Values, last_given
from softbrake.case.keys import Key, mapping_schema
from softbrake.case.section import Draft, Part, Section
from softbrake.case.sections.shell import Shell
from softbrake.case.units import Dimension
from softbrake.case.yaml_nodes import Node, join


@dataclass(frozen=True)
class Belt(Part):
    """Ring belt sewn on the fabric, Eq. (2.3); acts besides the fabric below it."""

    height: float  # m, of the belt's middle above the lower cover, unloaded
    stiffness: float  # N, E2: force per unit elongation
    line_density: float  # kg/m, unloaded
    width: float  # m, reduced width
    strength: float | None = None  # N/m, tension N22 that it bears


_BELT = (
    Key("layers", Dimension.RATIO, "layers of the shell's fabric in a belt", "5", above=0),
    Key("stiffness", Dimension.FORCE, "force per unit elongation", "1.7 kN", above=0, instead="layers"),
    Key(
        "line_density", Dimension.LINE_DENSITY, "mass per length, unloaded; with stiffness", "4.2 g/m", above=0, instead="layers"
    ),
    Key("width", Dimension.LENGTH, "of a belt along the generatrix", "16.667 mm", required=True, above=0),
    Key(
        "strength",
        Dimension.TENSION,
        "tension per width that it bears, for a margin",
        "150 kN/m",
        computed="layers times fabric.strength",
        above=0,
        idle=True,
    ),
)
_COUNT = Key("count", int, "belts at uniform spacing; 0 is allowed", "3", required=True, least=0)
_HEIGHT = Key("height", Dimension.LENGTH, "of the belt's middle above the lower cover", "0.3 m", required=True, above=0)


class _BeltsSection(Section):
    def read(self, draft: Draft) -> list[Values]:
        """Values of each belt with its height, as far as they are without faults."""
        shell, grid = draft.values("shell"), draft.values("grid")
        node = draft.members.get(self.name)
        if node is None:
            return []
        if isinstance(node.value, list):
            belts = []
            for number, item in enumerate(node.value):
                path = join(self.name, number)
                belts.append(draft.mapping(item, path, self.each, self.alternatives))
                if {"height", "width"} <= belts[-1].keys():
                    _check_place(draft, item, path, belts[-1], shell, grid)
            return belts
        count = node.value.get("count") if isinstance(node.value, dict) else None
        no_belts = count is not None and count.value == 0
        values = draft.mapping(node, self.name, self.keys, self.alternatives, complete=not no_belts)
        if {"count", "width"} <= values.keys():
            _check_stack(draft, node, values, shell, grid)
        if draft.faults:
            return []
        number = values.pop("count")
        wall = Shell(**shell)
        return [{"height": wall.at(wall.wall * k / (number + 1))[0], **values} for k in range(1, number + 1)]

    def build(self, draft: Draft) -> tuple[Belt, ...]:
        """Belts of layers have those of the fabric."""
        return tuple(_belt(values, draft.values("fabric")) for values in draft.values(self.name))

    def written(self, part: tuple[Belt, ...]) -> list[Values]:
        """A list, each belt with stiffness and density."""
        return [super(_BeltsSection, self).written(belt) for belt in part]

    def schema(self) -> dict[str, Any]:
        """A stack, which needs nothing but its count where that is 0, or a list."""
        stack = super().schema()
        choices = {"required": ["width"], "allOf": stack.pop("allOf")}
        stack |= {"required": ["count"], "if": {"properties": {"count": {"const": 0}}}, "else": choices}
        listed = {"type": "array", "items": mapping_schema(self.each, self.alternatives)}
        return {"description": "ring belts; none when left out", "oneOf": [stack, listed]}


BELTS = _BeltsSection(
    "belts",
    Belt,
    (_COUNT, *_BELT),
    alternatives=((("layers",), ("stiffness", "line_density")),),
    each=(_HEIGHT, *_BELT),
    optional=True,
    physical=True,
)


def narrowest_gap(draft: Draft, shell: Shell) -> float:
    """Smallest distance (m) along the wall of the middles of two belts, or of a belt and a cover; as far as belts can be read."""
    node, wall = draft.members.get("belts"), shell.wall
    if node is None:
        return wall
    quiet = Checker()
    if isinstance(node.value, list):
        items = (quiet.mapping(item, "", BELTS.each, complete=False) for item in node.value)
        places = sorted(shell.along(item["height"]) for item in items if "height" in item)
    else:
        count = quiet.mapping(node, "", BELTS.keys, complete=False).get("count", 0)
        places = [wall * k / (count + 1) for k in range(1, count + 1)] if count < 1000 else []
    gaps = [b - a for a, b in pairwise([0.0, *places, wall])]
    return min((gap for gap in gaps if gap > 0.0), default=wall)


def _belt(belt: Values, fabric: Values) -> Belt:
    width = belt["width"]
    stiffness = belt["stiffness"] if "stiffness" in belt else belt["layers"] * fabric["E22"] * width
    line_density = belt["line_density"] if "line_density" in belt else belt["layers"] * fabric["areal_density"] * width
    strength = belt.get("strength")
    if strength is None and "layers" in belt and "strength" in fabric:
        strength = belt["layers"] * fabric["strength"]
    return Belt(belt["height"], stiffness, line_density, width, strength)


def _check_place(draft: Draft, node: Node, path: str, belt: Values, shell: Values, grid: Values) -> None:
    """The rows of nodes on the covers are rigid: a belt keeps half a cell off them."""
    if "upper_diameter" not in shell or "generatrix" not in grid:
        return
    profile = Shell(**shell)
    cell = profile.wall / grid["generatrix"]
    lowest = belt["width"] / 2 + cell / 2
    highest = profile.wall - lowest
    place, where = last_given(node, path, ["height", "width"])
    if lowest > highest:
        widest = profile.wall - cell
        draft.fault(place, where, "the belt is wider than the room between the covers", f"a width < {widest:.6g} m is expected")
    elif belt["height"] > shell["height"] or (
        abs(profile.along(belt["height"]) - profile.wall / 2) > (highest - lowest) / 2 + 1e-9 * profile.wall
    ):
        lowest, highest = profile.at(lowest)[0], profile.at(highest)[0]
        fault = "the belt comes closer than half a grid cell to a cover"
        draft.fault(place, where, fault, f"a height from {lowest:.6g} m to {highest:.6g} m is expected for this width")


def _check_stack(draft: Draft, node: Node, belts: Values, shell: Values, grid: Values) -> None:
    """As `_check_place`, for belts at uniform spacing."""
    if belts["count"] == 0 or "upper_diameter" not in shell or "generatrix" not in grid:
        return
    wall = Shell(**shell).wall
    widest = 2 * wall / (belts["count"] + 1) - wall / grid["generatrix"]
    fault = "the outer belts come closer than half a grid cell to the covers"
    if widest <= 0:
        place, where = last_given(node, "belts", ["count"])
        draft.fault(place, where, fault, f"a count up to {2 * grid['generatrix'] - 2} is expected on this grid")
    elif belts["width"] > widest * (1 + 1e-9):
        place, where = last_given(node, "belts", ["count", "width"])
        draft.fault(place, where, fault, f"a width up to {widest:.6g} m is expected for this count")
