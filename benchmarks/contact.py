"""The tables of docs/validation/contact.md: impact velocity by grid with contact, what folds change, by step, and times.

python -m benchmarks.contact        some six minutes
python -m benchmarks.contact draw   its picture, docs/images/drop.png
"""

from __future__ import annotations

import math
import sys
import time
from pathlib import Path
from statistics import mean, stdev
from tempfile import TemporaryDirectory

import softbrake
from benchmarks.reproduction import CONFIGS, table
from softbrake.core.arrays import Outcome
from softbrake.core.columns import History
from softbrake.report.plots.drop import draw_drop
from softbrake.sim.simulation import Simulation
from softbrake.sim.summary import Summary
from softbrake.studies.convergence import estimate

SCENES = (
    ("no belts", ("belts.count=0",)),
    ("belts 1 mm", ("belts.width=1 mm",)),
    ("belts 16.667 mm", ()),
    ("belts 16.667 mm, damping 0.0005 s/m", ("pressure.damping=0.0005",)),
)
ONE_COLUMN = ("model.fidelity=axisymmetric", "grid.hoop=10000", "time.courant=0.3")  # at 0.9 steps still choose the lobes
CELLS = (20, 40, 80, 160, 320)
VISCOSITIES = (0.05, 0.2, 0.5, 1.0, 2.0)  # N s/m
NEIGHBOURS = ((36, 38, 40, 42, 44), (72, 76, 80, 84, 88), (144, 152, 160, 168, 176), (288, 304, 320, 336, 352))
BESIDE = (64, 68, 72, 76, 80, 88, 96, 112, 128)
WHOLE = ((24, 48), (36, 90))
SOLID, FULL = "[ground, cover, cargo]", "full"
PICTURE = Path("docs/images/drop.png")
COARSE = ((9, 22), (12, 30), (18, 45))
COURANT = (0.9, 0.3, 0.1)
DISTURBED = ((18, 45), (24, 48), (36, 90))
DISTURBANCE, SEEDS = 1e-4, 4  # of the radius, normal deviates
STANDING = 0.007  # s, until which the wall stands and touches nothing
TIMES = 3  # the least counts


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


def push(*overrides: str) -> tuple[float, float, float]:
    """Return impact velocity (m/s), peak deceleration (m/s^2) and impulse of contact on the cargo (N s)."""
    drop = Simulation(softbrake.load_case(CONFIGS / "paper-contact.yaml", overrides))
    impulse, outcome = 0.0, Outcome.RUNNING
    while outcome == Outcome.RUNNING:
        rows, outcome = drop.advance(most=500)
        impulse += rows[:, History.CONTACT_FORCE] @ rows[:, History.TIME_STEP]
    summary = drop.finish(outcome)
    return summary.impact_velocity or math.nan, summary.peak_deceleration, impulse


def disturbed(contact: str, *overrides: str) -> tuple[list[float], float]:
    """Return the impact velocities (m/s) of disturbed drops at the automatic step, and CPU seconds of one, compiled before."""
    case = softbrake.load_case(CONFIGS / "paper-contact.yaml", [f"contact={contact}", "time.courant=auto", *overrides])
    velocities, seconds = [], []
    for seed in range(SEEDS):
        drop = Simulation(case)
        drop.advance(most=0)
        drop.disturb(DISTURBANCE * 0.5 * case.shell.diameter, seed)
        summary = drop.to_end()
        velocities.append(summary.impact_velocity or math.nan)
        seconds.append(summary.kernel_seconds)
    return velocities, mean(seconds)


def indices(values: list[float]) -> list[str]:
    """Return the grid convergence index of each value on a grid half as coarse as the one before, from the third on."""
    threes = zip(values, values[1:], values[2:], strict=False)
    return [f"{estimate(*three, 2.0).error / three[2]:.2%}".replace("inf%", "none") for three in threes]


def cost(contact: str, *overrides: str) -> tuple[float, float]:
    """Return ns of CPU per node and step, while the wall stands and after, compiled before."""
    case = softbrake.load_case(CONFIGS / "paper.yaml", [f"contact={contact}", "time.courant=0.9", *overrides])
    found = []
    for _ in range(TIMES):
        drop, outcome = Simulation(case), Outcome.RUNNING
        drop.advance(most=1)
        parts = []
        for until in (STANDING, math.inf):
            begin, steps = time.process_time(), drop.state.steps[0]
            while outcome == Outcome.RUNNING and drop.now(History.TIME) < until:
                _, outcome = drop.advance(until)
            spent = time.process_time() - begin
            parts.append(1e9 * spent / (drop.state.steps[0] - steps) / ((case.grid.generatrix + 1) * drop.model.n2))
        found.append(parts)
    before, after = (min(part) for part in zip(*found, strict=True))
    return before, after


def draw(picture: Path) -> None:
    """Draw the wall with wide belts that crumples, with contact of folds."""
    with TemporaryDirectory() as scratch:
        result = Path(scratch) / "drop.vtkhdf"
        softbrake.run(softbrake.load_case(CONFIGS / "paper-contact.yaml"), result)
        draw_drop(result, picture)


def main() -> None:
    """Print the tables."""
    lines = []
    for name, overrides in SCENES:
        values = [velocity("contact=full", *ONE_COLUMN, *overrides, f"grid.generatrix={cells}") for cells in CELLS]
        lines.append([name, *(f"{value:.4f}" for value in values), *indices(values)])
    table(["axisymmetric, contact: full", *map(str, CELLS), *(f"index at {cells}" for cells in CELLS[2:])], lines)
    print()
    lines = []
    for viscosity in VISCOSITIES:
        thick = ("contact=full", *ONE_COLUMN, f"fabric.viscosity={viscosity}")
        values = [velocity(*thick, f"grid.generatrix={cells}") for cells in CELLS[:4]]
        lines.append([f"{viscosity} N s/m", *(f"{value:.4f}" for value in values), *indices(values)])
    table(["belts 16.667 mm, viscosity", *map(str, CELLS[:4]), *(f"index at {cells}" for cells in CELLS[2:4])], lines)
    print()
    lines = []
    for name, overrides in SCENES[2:]:
        line = [name]
        for grids in NEIGHBOURS:
            values = [velocity("contact=full", *ONE_COLUMN, *overrides, f"grid.generatrix={cells}") for cells in grids]
            line.append(f"{mean(values):.4f} ± {stdev(values):.4f}")
        lines.append(line)
    table(["mean and spread of five grids", *(f"{grids[0]} to {grids[-1]}" for grids in NEIGHBOURS)], lines)
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
    for name, overrides in SCENES:
        for generatrix, hoop in DISTURBED:
            line = [f"{name}, {generatrix} x {hoop}"]
            for contact in (SOLID, FULL):
                found, seconds = disturbed(contact, f"grid.generatrix={generatrix}", f"grid.hoop={hoop}", *overrides)
                line.append(f"{mean(found):.3f} ± {stdev(found):.3f}; {seconds:.2f} s")
            lines.append(line)
    table(["full shell, disturbed", "solid", "full"], lines)
    print()
    lines = []
    for name, overrides in SCENES[2:]:
        for generatrix, hoop in COARSE:
            line = [f"{name}, {generatrix} x {hoop}"]
            for courant in COURANT:
                grid = (f"grid.generatrix={generatrix}", f"grid.hoop={hoop}", f"time.courant={courant}")
                velocity_there, peak, impulse = push(*grid, *overrides)
                line.append(f"{velocity_there:.3f}; {peak:.1f}; {impulse:.1f}")
            lines.append(line)
    table(["full shell, full: m/s; m/s²; N s", *(f"Courant {courant}" for courant in COURANT)], lines)
    print()
    lines = []
    for name, overrides in SCENES:
        for fidelity in ("full", "axisymmetric"):
            line, ground = [f"{name}, {fidelity}"], (0.0, 0.0)
            for contact in ("ground", SOLID, FULL):
                spent = cost(contact, *overrides, f"model.fidelity={fidelity}")
                ground = spent if contact == "ground" else ground
                for without, there in zip(ground, spent, strict=True):
                    share = "" if contact == "ground" else f" ({max(1 - without / there, 0):.0%})"
                    line.append(f"{there:.1f}{share}")
            lines.append(line)
    columns = [f"{contact}, {part}" for contact in ("ground", "solid", "full") for part in ("standing", "after")]
    table(["ns per node and step, 36 x 90", *columns], lines)


if __name__ == "__main__":
    draw(PICTURE) if sys.argv[1:] == ["draw"] else main()
