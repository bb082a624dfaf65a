"""Section `fabric`: the cloth of the shell."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from softbrake.case.checker import Values, last_given
from softbrake.case.keys import Key
from softbrake.case.section import Draft, Part, Section
from softbrake.case.units import Dimension
from softbrake.case.yaml_nodes import Node

SHEAR = 0.05  # of the smaller of E11 and E22: default of G12
RECIPROCITY = 1e-3  # relative, to which both Poisson's ratios may be rounded


def contraction(nu12: float, nu21: float) -> float:
    """Part of a modulus over that of a sheet which may not contract, 1 - nu12 nu21 of Eq. (2.9)."""
    return 1.0 - nu12 * nu21


def breathing_viscosity(ratio: float, diameter: float, areal_density: float, E22: float, contraction: float) -> float:
    """Viscosity (N s/m) of a damping ratio of the hoop's breathing mode; diameter: m, of the shell."""
    return ratio * diameter * math.sqrt(areal_density * E22 / contraction)


@dataclass(frozen=True)
class Fabric(Part):
    """Cloth of the shell, Eq. (2.9)."""

    E11: float  # N/m, along the generatrix
    E22: float  # N/m, around the hoop
    nu12: float
    nu21: float
    G12: float  # N/m, shear
    areal_density: float  # kg/m^2, unloaded
    viscosity: float  # N s/m, resolved from damping_ratio where that was given
    law: Literal["tension_field", "nominal_tension", "true_tension"]
    slack: Literal["cut", "compression"]  # whether slack fabric carries nothing, or compression as it carries tension
    strength: float | None = None  # N/m, tension that it bears

    @property
    def contraction(self) -> float:
        """1 - nu12 nu21."""
        return contraction(self.nu12, self.nu21)


_KEYS = (
    Key("E", Dimension.TENSION, "modulus, both ways", "20 kN/m", above=0),
    Key("E11", Dimension.TENSION, "modulus along the generatrix", "20 kN/m", above=0, instead="E"),
    Key("E22", Dimension.TENSION, "modulus around the hoop", "20 kN/m", above=0, instead="E"),
    Key(
        "nu12",
        Dimension.RATIO,
        "Poisson's ratio: hoop contraction over generatrix stretch",
        "0.25",
        computed="nu21 E22/E11, or 0",
        least=0,
        begun=True,
    ),
    Key(
        "nu21",
        Dimension.RATIO,
        "generatrix contraction over hoop stretch",
        "0.25",
        computed="nu12 E11/E22",
        least=0,
        instead="nu12",
    ),
    Key("G12", Dimension.TENSION, "shear modulus", "1 kN/m", computed="5 % of E, of the smaller one", least=0),
    Key("areal_density", Dimension.AREAL_DENSITY, "mass per area, unloaded", "0.05 kg/m^2", required=True, above=0),
    Key("damping_ratio", Dimension.RATIO, "of critical damping of the breathing hoop", "3 %", least=0),
    Key("viscosity", Dimension.VISCOSITY, "tension per stretch rate", "0.2 N*s/m", least=0, instead="damping_ratio"),
    Key(
        "law",
        ("tension_field", "nominal_tension", "true_tension"),
        "(2.9) is true_tension",
        "tension_field",
        default="tension_field",
    ),
    Key("slack", ("cut", "compression"), "slack fabric carries nothing, or compression", "cut", default="cut"),
    Key("strength", Dimension.TENSION, "tension that it bears, for a margin", "30 kN/m", above=0, idle=True),
)


class _FabricSection(Section):
    def read(self, draft: Draft) -> Values:
        """Values with E11, E22, both Poisson's ratios, G12 and, for a shell of known diameter, the viscosity resolved."""
        shell, node = draft.values("shell"), self.node(draft)
        if node is None:
            return {}
        fabric = draft.mapping(node, self.name, self.keys, self.alternatives)
        if fabric.get("law") == "tension_field" and fabric.get("slack") == "compression":
            place, where = last_given(node, self.name, ["law", "slack"])
            draft.fault(place, where, "a tension field carries no compression", "slack: cut, or law: nominal_tension is expected")
        if "E" in fabric:
            fabric["E11"] = fabric["E22"] = fabric.pop("E")
        if not {"E11", "E22"} <= fabric.keys():
            return fabric
        fabric.setdefault("G12", SHEAR * min(fabric["E11"], fabric["E22"]))
        if not _reciprocal(draft, node, fabric):
            return fabric
        if {"damping_ratio", "areal_density"} <= fabric.keys() and "diameter" in shell:
            sheet = fabric["areal_density"], fabric["E22"], contraction(fabric["nu12"], fabric["nu21"])
            fabric["viscosity"] = breathing_viscosity(fabric.pop("damping_ratio"), shell["diameter"], *sheet)
        return fabric

    def give_way(self, members: dict[str, Node], name: str) -> None:
        """Of two moduli the other one stays; either Poisson's ratio follows from the other."""
        if name in ("E11", "E22") and "E" in members:
            members["E11"] = members["E22"] = members.pop("E")
        if name in ("nu12", "nu21"):
            members.pop("nu21" if name == "nu12" else "nu12", None)
        super().give_way(members, name)


def _reciprocal(draft: Draft, node: Node, fabric: Values) -> bool:
    """Whether Poisson's ratios are those of an elastic sheet; the one that is not given follows: nu12 E11 = nu21 E22."""
    E11, E22 = fabric["E11"], fabric["E22"]
    given = [name for name in ("nu12", "nu21") if name in fabric]
    nu12 = fabric["nu12"] if "nu12" in fabric else fabric.get("nu21", 0.0) * E22 / E11
    nu21 = nu12 * E11 / E22
    if "nu21" in fabric and not math.isclose(fabric["nu21"], nu21, rel_tol=RECIPROCITY):
        place, where = last_given(node, "fabric", ["nu12", "nu21", "E", "E11", "E22"])
        sides = f"nu12*E11 = {nu12 * E11:.6g} N/m is not nu21*E22 = {fabric['nu21'] * E22:.6g} N/m"
        expected = f"nu21: {nu21:.6g}, or one of nu12 and nu21 alone is expected"
        draft.fault(place, where, f"{sides}, so there is no elastic energy", expected)
        return False
    if nu12 * nu21 >= 1:
        place, where = last_given(node, "fabric", [*given, "E", "E11", "E22"])
        draft.fault(place, where, f"nu12*nu21 = {nu12 * nu21:.6g}", "a product < 1 is expected")
        return False
    fabric["nu12"], fabric["nu21"] = nu12, nu21
    return True


FABRIC = _FabricSection(
    "fabric",
    Fabric,
    _KEYS,
    alternatives=((("E",), ("E11", "E22")), (("damping_ratio",), ("viscosity",))),
    physical=True,
)
