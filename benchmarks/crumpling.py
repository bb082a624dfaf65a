"""What contact of a crumpling shell costs beside an older tree, beside the IPC Toolkit's search, and in memory.

python -m benchmarks.crumpling --old FOLDER [--seeds N] [--grid 36x90]     FOLDER is a checkout; some minutes
python -m benchmarks.crumpling                                             without it: search and memory alone

Each drop is one of configs/paper-contact.yaml at the automatic step, disturbed by 1e-4 of the radius, in its own process. Both
trees take turns, kernels compiled before. Ratios are medians of those of neighbours. The search wants the extra `dev`.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
from pathlib import Path
from statistics import mean, median, stdev
from time import thread_time
from typing import Any

import ipctk
import numpy as np

from benchmarks.contact import DISTURBANCE
from benchmarks.ipc import grid_of
from benchmarks.reproduction import CONFIGS, table
from softbrake.case.case_file import load_case
from softbrake.core.arrays import PAD, ContactCount, Sheet
from softbrake.core.columns import History
from softbrake.core.contact.broad_phase import find_pairs
from softbrake.core.contact.constants import THICKNESS
from softbrake.sim.build import grid_view
from softbrake.sim.simulation import Simulation

ROOT = Path(__file__).resolve().parents[1]
FULL, SOLID = "contact=full", "contact=[ground, cover, cargo]"
SMOOTH = ("belts.count=0",)
MOMENTS = (0.04, 0.09)  # s after contact
REPEATS = 9
DROP = f"""
import json, sys
from pathlib import Path
try:
    from softbrake.sim.simulation import Simulation
    from softbrake.case.case_file import load_case
except ImportError:  # before 0.2
    from softbrake.drop import Drop as Simulation
    from softbrake.case import load_case
path, seeds, overrides = Path(sys.argv[1]), json.loads(sys.argv[2]), sys.argv[3:]
case = load_case(path, overrides)
warm = Simulation(case)
warm.advance(most=300)
for seed in seeds:
    drop = Simulation(case)
    drop.advance(most=0)
    if seed is not None:
        drop.disturb({DISTURBANCE} * 0.5 * case.shell.diameter, seed)
    found = drop.to_end() if hasattr(drop, "to_end") else drop.run()
    print(json.dumps([found.kernel_seconds, found.impact_velocity, found.peak_deceleration, found.steps]))
"""
Found = list[float]  # CPU seconds of the kernels, impact velocity (m/s), peak deceleration (m/s^2), steps


def drop(tree: Path, seed: int | None, *overrides: str) -> Found:
    """Return what a drop of a tree gives in a process of its own."""
    about = {**os.environ, "PYTHONPATH": str(tree)}
    command = [sys.executable, "-c", DROP, str(tree / "configs" / "paper-contact.yaml"), json.dumps([seed]), *overrides]
    done = subprocess.run(command, env=about, cwd=tree, check=True, capture_output=True, text=True)
    found: Found = json.loads(done.stdout.splitlines()[-1])
    return found


def beside(old: Path, seeds: list[int | None], *overrides: str) -> list[str]:
    """Return seconds, ratio, impact velocities and peaks of both trees over some seeds."""
    trees: dict[Path, list[Found]] = {old: [], ROOT: []}
    for tree in trees:
        drop(tree, seeds[0], *overrides, "time.end=1 ms")  # compiles
    for k, seed in enumerate(seeds):
        for tree in (old, ROOT) if k % 2 else (ROOT, old):
            trees[tree].append(drop(tree, seed, *overrides))
    before, now = trees[old], trees[ROOT]
    ratio = median(new[0] / was[0] for was, new in zip(before, now, strict=True))
    columns = [f"{median(each[0] for each in found):.2f}" for found in (before, now)] + [f"{ratio:.2f}"]
    for k, unit in ((1, ".3f"), (2, ".1f")):
        for found in (before, now):
            values = [each[k] for each in found]
            columns.append(f"{mean(values):{unit}}" + (f" ± {stdev(values):{unit}}" if len(values) > 1 else ""))
    return columns


def of_solid(*overrides: str) -> str:
    """Return the time of full contact over that of ground, cover and cargo, of an undisturbed drop."""
    ratios = []
    for k in range(5):
        times = {contact: drop(ROOT, None, contact, *overrides)[0] for contact in ((FULL, SOLID) if k % 2 else (SOLID, FULL))}
        ratios.append(times[FULL] / times[SOLID])
    return f"{median(ratios):.2f}"


def memory(falling: Simulation) -> float:
    """Return the doubles a node that self-contact takes."""

    def size(part: Any) -> int:
        return part.nbytes if isinstance(part, np.ndarray) else sum(map(size, part))

    before = falling.workspace.before_contact  # type: ignore[union-attr]
    return (size(falling.state.self_contact) + size(before)) / 8 / ((falling.model.n1 + 1) * falling.model.n2)


def search(falling: Simulation) -> tuple[float, float]:
    """Return the seconds that a search takes here, and in the IPC Toolkit with its fastest broad phase, on one thread."""
    model, state, self_contact = falling.model, falling.state, falling.state.self_contact
    assert self_contact is not None
    edge = min(model.shape.least_1, model.shape.least_2)
    sheet = Sheet(model.n1, model.n2, model.stride, PAD, 0.0, edge, model.obstacles)
    places = np.stack([grid_view(part, model) for part in state.nodes[:3]], axis=-1).reshape(-1, 3)
    margin = float(np.median(grid_view(self_contact.margin, model)))
    corners = grid_of(model.n1, model.n2)[1]
    faces = np.concatenate((corners[:, [0, 1, 2]], corners[:, [0, 2, 3]])).astype(np.int32)
    mesh = ipctk.CollisionMesh(np.asfortranarray(places), ipctk.edges(faces), np.asfortranarray(faces))
    ipctk.set_num_threads(1)
    ours, theirs = [], []
    for _ in range(REPEATS):
        start = thread_time()
        find_pairs(state.nodes, self_contact, sheet, THICKNESS * edge)
        ours.append(thread_time() - start)
        start = thread_time()
        ipctk.Candidates().build(mesh, np.asfortranarray(places), margin + 0.5 * THICKNESS * edge, ipctk.LBVH())
        theirs.append(thread_time() - start)
    return median(ours), median(theirs)


def main() -> None:
    """Compare and print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.crumpling", description=__doc__)
    parser.add_argument("--old", type=Path, metavar="FOLDER", help="an older tree")
    parser.add_argument("--seeds", type=int, default=5, metavar="N")
    parser.add_argument("--grid", default="36x90", metavar="ROWSxCOLUMNS")
    options = parser.parse_args()
    rows, columns = map(int, options.grid.split("x"))
    grid = (f"grid.generatrix={rows}", f"grid.hoop={columns}", "time.courant=auto")
    if options.old is not None:
        lines = [
            ["undamped", *beside(options.old.resolve(), list(range(options.seeds)), FULL, *grid)],
            ["damped", *beside(options.old.resolve(), list(range(options.seeds)), FULL, *grid, "pressure.damping=0.0005")],
        ]
        head = ["kernels, CPU s", "old", "new", "ratio", "m/s, old", "m/s, new", "peak m/s², old", "peak m/s², new"]
        table(head, lines)
        print(f"\nsmooth wall, full contact over solid: {of_solid(*SMOOTH, *grid)}\n")
    falling = Simulation(load_case(CONFIGS / "paper-contact.yaml", [FULL, *grid]))
    falling.advance(most=0)
    falling.disturb(DISTURBANCE * 0.25, 0)
    lines = []
    for moment in MOMENTS:
        while falling.now(History.TIME) < moment:
            falling.advance(moment)
        ours, theirs = search(falling)
        assert falling.state.self_contact is not None
        pairs = int(falling.state.self_contact.counts[[ContactCount.FACES, ContactCount.EDGES]].sum())
        held = f"{memory(falling):.0f}"
        lines.append(
            [f"{1e3 * moment:.0f} ms", str(pairs), f"{1e3 * ours:.2f}", f"{1e3 * theirs:.2f}", f"{theirs / ours:.1f}", held]
        )
    table(["at", "pairs", "search, ms", "IPC Toolkit, ms", "ratio", "doubles a node"], lines)


if __name__ == "__main__":
    main()
