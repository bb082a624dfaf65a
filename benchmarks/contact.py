"""The tables of docs/contact.md: impact velocity by grid with contact, what folds change, and what contact costs.

python -m benchmarks.contact        two to four minutes
"""

from __future__ import annotations

import math

import softbrake
from benchmarks.reproduction import CONFIGS, table
from softbrake.convergence import estimate
from softbrake.drop import Drop
from softbrake.state import History, Outcome
from softbrake.summary import Summary

SCENES = (
    ("no belts", ("belts.count=0",)),
    ("belts 1 mm", ("belts.width=1 mm",)),
    ("belts 16.667 mm", ()),
    ("belts 16.667 mm, damping 0.0005 s/m", ("pressure.damping=0.0005",)),
)
ONE_COLUMN = ("model.fidelity=axisymmetric", "grid.hoop=10000", "time.courant=0.9")
CELLS = (20, 40, 80, 160, 320)
BESIDE = (64, 68, 72, 76, 80, 88, 96, 112, 128)
WHOLE = ((24, 48), (36, 90))
SOLID, FULL = "[ground, cover, cargo]", "full"


def impact(*overrides: str) -> Summary | None:
    """Return the answer of the paper's drop, None where it diverges."""
    try:
        return softbrake.run(softbrake.load_case(CONFIGS / "paper.yaml", overrides))
    except softbrake.Diverged:
        return None


def velocity(*overrides: str) -> float:
    """Return the impact velocity (m/s), nan where there is none."""
    summary = impact(*overrides)
    return math.nan if summary is None or summary.impact_velocity is None else summary.impact_velocity


def cost(contact: str, until: float, *overrides: str) -> float:
    """Return ns per node and step from the start to a time (s), compiled before."""
    case = softbrake.load_case(CONFIGS / "paper.yaml", [f"contact={contact}", "time.courant=0.9", *overrides])
    drop = Drop(case)
    drop.advance(most=1)
    drop.kernel_seconds = 0.0
    outcome = Outcome.RUNNING
    while outcome == Outcome.RUNNING and drop.now(History.TIME) < until:
        _, outcome = drop.advance(until)
    return 1e9 * drop.kernel_seconds / drop.state.steps[0] / ((case.grid.generatrix + 1) * drop.model.n2)


def main() -> None:
    """Print the tables."""
    lines = []
    for name, overrides in SCENES:
        values = [velocity("contact=full", *ONE_COLUMN, *overrides, f"grid.generatrix={cells}") for cells in CELLS]
        index = estimate(*values[:3], 2.0).error / values[2]
        lines.append([name, *(f"{value:.4f}" for value in values), f"{index:.2%}"])
    table(["axisymmetric, contact: full", *map(str, CELLS), "index at 80"], lines)
    print()
    lines = []
    for contact in ("[ground, cover, cargo, axis]", FULL):
        values = [velocity(f"contact={contact}", *ONE_COLUMN, f"grid.generatrix={cells}") for cells in BESIDE]
        lines.append([contact, *(f"{value:.3f}" for value in values)])
    table(["axisymmetric, belts 16.667 mm", *map(str, BESIDE)], lines)
    print()
    lines = []
    for name, overrides in SCENES:
        line = [name]
        for generatrix, hoop in WHOLE:
            grid = (f"grid.generatrix={generatrix}", f"grid.hoop={hoop}", "time.courant=0.9")
            line += [f"{velocity(f'contact={contact}', *grid, *overrides):.4f}" for contact in (SOLID, FULL)]
        lines.append(line)
    table(["full shell", *(f"{g} x {h}, {word}" for g, h in WHOLE for word in ("solid", "full"))], lines)
    print()
    lines = []
    for name, overrides in SCENES[:3]:
        for fidelity in ("full", "axisymmetric"):
            line = [f"{name}, {fidelity}"]
            for contact in ("ground", SOLID, FULL):
                line += [f"{cost(contact, until, *overrides, f'model.fidelity={fidelity}'):.1f}" for until in (0.005, 1.0)]
            lines.append(line)
    columns = [f"{contact}, {part}" for contact in ("ground", "solid", "full") for part in ("first 5 ms", "whole")]
    table(["ns per node and step, 36 x 90", *columns], lines)


if __name__ == "__main__":
    main()
