"""What shear stiffness does: roundness, answers and cost of full shells of scenes drawn by chance, over G12.

    python -m benchmarks.shear [--scenes 40] [--seeds 2]

Each scene is computed as axisymmetric shell and, disturbed by 1e-3 of its radius, as full shell with folds on the same grid,
cells a twelfth of the radius long. An answer agrees where both end alike, impact velocities within 1 %, or of 5 % of the
free-fall velocity.
"""

from __future__ import annotations

import argparse
import math
import statistics
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

from benchmarks.scenes import scene
from softbrake.case.case import Case
from softbrake.case.case_file import parse_case
from softbrake.case.level import level
from softbrake.core.arrays import Outcome
from softbrake.core.columns import History
from softbrake.sim.cores import cores
from softbrake.sim.simulation import Diverged, Simulation
from softbrake.sim.summary import Summary
from softbrake.studies.error_control import allowed, speed_of

SHARES = (0.0, 0.005, 0.02, 0.05, 0.1, 0.4)  # of E
FINE = 12.0  # cells in a radius
LARGE = 1e-3  # of the radius
ROUND = 0.05  # of the radius: out of round by more, a shell is not round
WITHIN = 0.01


def grid_of(case: Case) -> tuple[int, int]:
    """Cells along the generatrix and around the hoop."""
    cells = FINE / (0.5 * case.shell.diameter)
    return max(math.ceil(case.shell.height * cells), 12), math.ceil(2.0 * math.pi * FINE / 2.0) * 2


def drop(case: Case, seed: int) -> tuple[Summary | None, float]:
    """Answer of a shell, disturbed where it is full, None where it diverged, and how far it got out of round over the radius."""
    falling, out, full = Simulation(case), 0.0, case.model.fidelity == "full"
    if full:
        falling.disturb(LARGE * 0.5 * case.shell.diameter, seed)
    interval, outcome = case.shell.height / case.cargo.velocity / 50, Outcome.RUNNING
    while outcome == Outcome.RUNNING:
        _, outcome = falling.advance((falling.now(History.TIME) // interval + 1.0) * interval)
        if full and outcome == Outcome.RUNNING:
            out = max(out, falling.lopsided())
    try:
        return falling.finish(outcome), out / (0.5 * case.shell.diameter)
    except Diverged:
        return None, out / (0.5 * case.shell.diameter)


def measure(job: tuple[int, float, int]) -> tuple[float, bool, float, float]:
    """Share of G12, whether the answer agrees, out of round, kernel seconds over those of the axisymmetric shell."""
    number, share, seed = job
    case = parse_case(scene(number), f"scene {number}")
    case = replace(case, fabric=replace(case.fabric, G12=share * case.fabric.E11))
    cells = grid_of(case)
    whole, out = drop(level(case, "full", *cells), seed)
    alike, _ = drop(level(case, "axisymmetric", *cells), seed)
    if whole is None or alike is None:
        return share, False, out, math.nan
    agree = whole.outcome == alike.outcome and abs(speed_of(whole) - speed_of(alike)) <= allowed(
        WITHIN, speed_of(alike), alike.free_fall_velocity
    )
    return share, agree, out, whole.kernel_seconds


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--scenes", type=int, default=40)
    arguments.add_argument("--seeds", type=int, default=2)
    asked = arguments.parse_args()
    jobs = [(n, share, seed) for n in range(asked.scenes) for share in SHARES for seed in range(1, asked.seeds + 1)]
    with ThreadPoolExecutor(cores()) as pool:
        found = list(pool.map(measure, jobs))
    print("| G12 over E | answers agree | stay round | median out of round | failed | kernel s, mean |")
    print("|---|---:|---:|---:|---:|---:|")
    for share in SHARES:
        rows = [row for row in found if row[0] == share]
        seconds = [row[3] for row in rows if not math.isnan(row[3])]
        print(
            f"| {share:.1%} | {sum(row[1] for row in rows)} of {len(rows)} | {sum(row[2] <= ROUND for row in rows)} "
            f"| {statistics.median(row[2] for row in rows):.1g} R | {len(rows) - len(seconds)} "
            f"| {statistics.mean(seconds):.2f} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
