"""Level, grid and step of a case: put at others, and doubted."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace
from itertools import pairwise

from softbrake.case.case import Case
from softbrake.case.sections.contact import SETS, known_parts
from softbrake.case.sections.numerics import FINE, HOOP, Fidelity, auto_courant, default_cells

COARSE_GRID = 12  # cells in a radius below which a shell is too coarse


def level(case: Case, fidelity: Fidelity, generatrix: int, hoop: int, courant: float | None = None) -> Case:
    """The case at another level and grid, with the contact and the start that this level knows and without a tolerance.

    generatrix, hoop: cells; courant: part of the longest stable step, None for what `auto` stands for.
    """
    contact = case.contact
    if fidelity == "axisymmetric" and "folds" in contact and "axis" not in contact:
        contact = tuple(part for part in SETS["full"] if part in (*contact, "axis"))
    contact = tuple(part for part in contact if part in known_parts(fidelity))
    grid = replace(case.grid, generatrix=generatrix, hoop=hoop)
    full = case.gas is not None and case.gas.pressure > 0.0
    initial = "unloaded" if fidelity == "lumped" else "inflated" if full else case.initial
    if courant is None:
        courant = auto_courant(case.shell, case.fabric, grid)
    return replace(
        case,
        contact=contact,
        initial=initial,
        grid=grid,
        time=replace(case.time, courant=courant),
        model=replace(case.model, fidelity=fidelity),
        tolerance=None,
        insists=False,
    )


def coarseness(case: Case) -> str | None:
    """Say what is needed where the grid of a case is too coarse for its scene; None where it is not, or will be chosen."""
    if case.tolerance is not None or case.model.fidelity == "lumped":
        return None
    wall, diameter, grid, faults = case.shell.wall, case.shell.diameter, case.grid, []
    belts = sorted(case.shell.along(belt.height) for belt in case.belts)
    gap = min(b - a for a, b in pairwise([0.0, *belts, wall]))
    needed = default_cells(wall, diameter, gap or wall, False)
    if grid.generatrix * FINE < needed * COARSE_GRID:
        faults.append(f"grid.generatrix {grid.generatrix}, where this scene needs {needed}")
    if grid.hoop / (2.0 * math.pi) < COARSE_GRID and case.model.fidelity != "axisymmetric":
        faults.append(f"grid.hoop {grid.hoop}, where {HOOP} are needed")
    return f"coarse grid: {' and '.join(faults)}; answers may be off by some per cent" if faults else None


class LongStep(UserWarning):
    """A run takes longer steps than the longest stable one."""


def long_steps(cases: Iterable[Case]) -> str | None:
    """Return what to say of cases whose steps are longer than the longest stable one; None without any."""
    stepping = (case for case in cases if case.tolerance is None and case.model.fidelity != "lumped")
    above = {case.time.courant for case in stepping if case.time.courant > 1.0}
    if not above:
        return None
    number = f"{'up to ' if len(above) > 1 else ''}{max(above):g}"
    return f"time.courant {number} is above 1, the longest stable step: a run diverges, or slack hides it and tensions are wrong"
