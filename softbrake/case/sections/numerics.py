"""Sections `grid`, `time` and `model`: how the drop is computed, and what is chosen where they say nothing."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, get_args

from softbrake.case.checker import Values, last_given
from softbrake.case.keys import Key
from softbrake.case.section import Draft, Part, Section
from softbrake.case.sections.belts import narrowest_gap
from softbrake.case.sections.fabric import Fabric
from softbrake.case.sections.shell import Shell
from softbrake.case.units import Dimension

Fidelity = Literal["full", "axisymmetric", "lumped", "auto"]
ONE_COLUMN = ("axisymmetric", "lumped")  # fidelities that compute the generatrix only
LUMPED_STEPS = 2000  # of gas alone, in which the cargo would fall the shell's height at its first velocity
FINE = 18  # cells in a radius of a default grid
HOOP = 120  # cells around the hoop by default: 19 in a radius, in whole vectors
BETWEEN_BELTS = 6  # least cells of a default grid between two belts, or a belt and a cover, where that is not 4 times finer
# Courant coefficient by the damping ratio of the shortest wave; of drops at most 2 % gain energy (docs/validation/stability.md):
# the bound is that of a taut shell; fabric that gets slack and taut again feeds waves near it, unless viscosity eats them.
AUTO_COURANT = ((0.03, 0.95), (0.01, 0.75), (0.003, 0.6), (0.0, 0.35))


@dataclass(frozen=True)
class Grid(Part):
    """Cells of the full shell."""

    generatrix: int
    hoop: int


@dataclass(frozen=True)
class Time(Part):
    """Step and end of the run."""

    courant: float  # part of the longest stable step; above 1 nothing says that the run is stable
    end: float  # s
    after: Literal["stop", "rebound"]  # what ends the run: the first full stop, or lift-off


@dataclass(frozen=True)
class ModelChoice(Part):
    """Numerical model."""

    scheme: Literal["edge", "cell"]  # cell is (3.2) as printed
    fidelity: Fidelity


class _GridSection(Section):
    def read(self, draft: Draft) -> Values:
        """Cells as given, else of a size that the scene needs."""
        shell: Values = draft.values("shell")
        grid: Values = super().read(draft)
        grid.setdefault("hoop", HOOP)
        if "upper_diameter" in shell:
            wall = Shell(**shell).wall
            if "generatrix" not in grid:
                gap = narrowest_gap(draft, Shell(**shell))
                one_column = draft.written("model").get("fidelity") in ONE_COLUMN
                grid["generatrix"] = min(default_cells(wall, shell["diameter"], gap, one_column), 10_000)
            self._check_narrow(draft, Shell(**shell), grid["hoop"])
        return grid

    def _check_narrow(self, draft: Draft, shell: Shell, hoop: int) -> None:
        """Columns come together towards the axis: the narrowest row is no nearer to it than the widest hoop's edges are long."""
        edge = shell.diameter * math.sin(math.pi / hoop)
        narrow = shell.generatrix.narrowest
        if narrow < edge:
            row = shell.generatrix.ends.index(narrow)
            name = "diameters" if shell.diameters else "upper_diameter" if row else "lower_diameter"
            place, _ = draft.last_given(f"shell.{name}", "grid.hoop")
            where = f"shell.{name}" + (f".{row}" if shell.diameters else "")
            fault = f"the wall comes to {narrow:.4g} m from the axis"
            draft.fault(place, where, fault, f"{edge:.4g} m, the hoop edge of the widest row, or more is expected")


class _TimeSection(Section):
    def build(self, draft: Draft) -> Time:
        """With the coefficient that `auto` stands for; gas throws the cargo back."""
        time = {"after": "rebound" if draft.built("gas") is not None else "stop", **draft.values(self.name)}
        if time["courant"] == "auto":
            time["courant"] = auto_courant(draft.built("shell"), draft.built("fabric"), draft.built("grid"))
        return Time(**time)


class _ModelSection(Section):
    def read(self, draft: Draft) -> Values:
        """A case that says nothing of its computation leaves the fidelity to the program."""
        model: Values = super().read(draft)
        node = draft.members.get(self.name)
        if "fidelity" not in model:
            courant = draft.written("time").get("courant", "auto")
            numerics = draft.written("grid") or model.get("scheme") == "cell" or courant != "auto"
            model["fidelity"] = "full" if numerics else "auto"
        if model["fidelity"] == "lumped" and draft.values("shell").get("profile") == "pattern":
            place, where = draft.last_given("model.fidelity")
            fault = "the lumped model has no cloth, and a pattern no volume before it is blown up"
            draft.fault(place, where, fault, "another fidelity, or another profile is expected")
        if node is not None and model["fidelity"] in ONE_COLUMN and model.get("scheme") == "cell":
            place, where = last_given(node, self.name, ["scheme", "fidelity"])
            fault = f"the {model['fidelity']} shell does not know the cell scheme"
            draft.fault(place, where, fault, "scheme: edge or fidelity: full is expected")
        return model


GRID = _GridSection(
    "grid",
    Grid,
    (
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
    optional=True,
)
TIME = _TimeSection(
    "time",
    Time,
    (
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
        Key(
            "after",
            ("stop", "rebound"),
            "the run ends at a full stop, or at lift-off",
            "stop",
            computed="stop, with gas rebound",
        ),
    ),
    optional=True,
)
MODEL = _ModelSection(
    "model",
    ModelChoice,
    (
        Key("scheme", ("edge", "cell"), "cell is (3.2) as printed", "edge", default="edge"),
        Key("fidelity", get_args(Fidelity), "level of the model", "auto", computed="auto, full on a grid given"),
    ),
    optional=True,
)


def default_cells(height: float, diameter: float, gap: float, one_column: bool) -> int:
    """Cells along the generatrix of a default grid.

    height: of the wall along the generatrix, diameter: m; gap: m, smallest distance of belts from one another and the covers.
    """
    least = math.ceil(height / (0.5 * diameter) * FINE * (2 if one_column else 1) - 1e-9)
    between = math.ceil(BETWEEN_BELTS * height / gap - 1e-9)
    return max(least, min(between, 4 * least), 8)


def auto_courant(shell: Shell, fabric: Fabric, grid: Grid) -> float:
    """Courant coefficient that is safe for the damping ratio of the grid's shortest waves."""
    ratio = damping_ratio(shell, fabric, grid)
    return next(courant for least, courant in AUTO_COURANT if ratio >= least)


def damping_ratio(shell: Shell, fabric: Fabric, grid: Grid) -> float:
    """Damping ratio of the grid's shortest waves, viscosity/(h sqrt(E density))."""
    density = fabric.areal_density / fabric.contraction
    along = shell.wall / grid.generatrix * math.sqrt(fabric.E11 * density)
    around = shell.diameter * math.sin(math.pi / grid.hoop) * math.sqrt(fabric.E22 * density)
    return fabric.viscosity / max(along, around)
