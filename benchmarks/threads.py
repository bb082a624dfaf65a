"""What passed through folded fabric: sides that stand through faces, by the count of softbrake and by that of the IPC Toolkit.

python -m benchmarks.threads                                     six drops of 36 x 90 cells, a minute and a half
python -m benchmarks.threads --seeds 10 --grid 24x48 --most 0    disturbed drops of three cases; exit code 1 beyond --most

Wants the extra `dev`. Each 2.5 ms, and each 0.2 ms in the last 5 mm, both count; exit code 1 as well where they differ.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from benchmarks.contact import DISTURBANCE
from benchmarks.ipc import threads_and_hinges
from benchmarks.reproduction import CONFIGS, table
from softbrake.case.case import Case
from softbrake.case.case_file import load_case, parse_case
from softbrake.case.schema import starter
from softbrake.core.arrays import Floats, Outcome
from softbrake.core.columns import History
from softbrake.sim.build import grid_view
from softbrake.sim.simulation import Simulation

LAST = 5e-3  # m, of height, in which layers are squeezed
INTERVAL, LAST_INTERVAL = 2.5e-3, 2e-4  # s, between counts before and after that
TINY = 1e-6  # m, the gap kept from the cover: what is no deeper has not passed
DROPS = {  # overrides of configs/paper-contact.yaml, and the seed of a disturbance
    "no belts": (("belts.count=0",), None),
    "damped": (("pressure.damping=0.0005",), None),
    "damped, disturbed": (("pressure.damping=0.0005",), 0),
    "undamped": ((), None),
    "undamped, disturbed": ((), 0),
    "starter case": (None, None),
}
SCATTERED = ("undamped", "damped", "starter case")
COLUMNS = ["missed collisions", "threads until 5 mm", "in the last 5 mm", "at the ground", "hinges until 5 mm"]
COLUMNS += ["nodes in the cargo", "sides through the cover", "nodes below the ground"]


class Counts(NamedTuple):
    """Largest numbers of a drop, and what the last frame holds."""

    missed: int
    before: int  # threads until LAST
    last: int  # threads after it
    ground: int  # threads at the end
    hinges: int  # until LAST
    in_cargo: int  # nodes
    through_cover: int  # sides
    below_ground: int  # nodes
    first: float | None  # m, height at which a thread was first seen; None without one until LAST
    differ: int  # counts in which the IPC Toolkit found other pairs


def case_of(overrides: tuple[str, ...] | None, grid: tuple[int, int]) -> Case:
    """Return the paper's case with contact of folds and some keys changed, or the starter case, at the automatic step."""
    common = [f"grid.generatrix={grid[0]}", f"grid.hoop={grid[1]}", "time.courant=auto"]
    if overrides is None:
        return parse_case(starter(), "starter", common)
    return load_case(CONFIGS / "paper-contact.yaml", [*common, *overrides])


def count(case: Case, seed: int | None) -> Counts:
    """Drop a shell, disturbed by a seed if there is one, and count as it goes."""
    drop, outcome = Simulation(case), Outcome.RUNNING
    drop.advance(most=0)
    if seed is not None:
        drop.disturb(DISTURBANCE * 0.5 * case.shell.diameter, seed)
    before = last = ground = hinges = differ = 0
    first = None
    while outcome == Outcome.RUNNING:
        high = drop.now(History.HEIGHT) > LAST
        until = drop.now(History.TIME) + (INTERVAL if high else LAST_INTERVAL)
        while outcome == Outcome.RUNNING and drop.now(History.TIME) < until and (drop.now(History.HEIGHT) > LAST) == high:
            _, outcome = drop.advance(until, 16)
        found, places = drop.thread_search.find(drop.state.nodes), places_of(drop)
        threads, theirs = threads_and_hinges(places)
        differ += (found.threads, found.hinges) != (len(threads), len(theirs))
        height = drop.now(History.HEIGHT)
        if height > LAST:
            before, hinges = max(before, found.threads), max(hinges, found.hinges)
            first = height if found.threads and first is None else first
        elif outcome == Outcome.RUNNING:
            last = max(last, found.threads)
        ground = found.threads
    summary = drop.finish(outcome)
    return Counts(summary.missed_collisions, before, last, ground, hinges, *walls(case, places, height), first, differ)


def places_of(drop: Simulation) -> Floats:
    """Return the nodes (m) of the full shell, (n1+1, n2, 3)."""
    return np.stack([grid_view(part, drop.model) for part in drop.state.nodes[:3]], axis=-1)


def walls(case: Case, places: Floats, height: float) -> tuple[int, int, int]:
    """Return how many nodes are in the cargo, sides through the cover at a height (m), and nodes below the ground."""
    z, radius = places[..., 2], np.hypot(places[..., 0], places[..., 1])
    top = height + (case.cargo.height or np.inf)
    in_cargo = (radius < 0.5 * case.cargo.diameter - TINY) & (z > height + TINY) & (z < top)
    through = 0
    for a, b in ((places, np.roll(places, -1, axis=1)), (places[:-1], places[1:])):
        low, high = a[..., 2] - height, b[..., 2] - height
        passing = np.minimum(low, high) < -TINY
        passing &= np.maximum(low, high) > TINY
        share = np.where(passing, low / np.where(passing, low - high, 1.0), 0.0)[..., None]
        at = a + share * (b - a)
        within = np.hypot(at[..., 0], at[..., 1]) < 0.5 * case.shell.diameter * np.cos(np.pi / places.shape[1])
        through += int((passing & within).sum())
    return int(in_cargo[:-1].sum()), through, int((z < -TINY).sum())


def drops(grid: tuple[int, int]) -> bool:
    """Print the table of the drops; return whether both counts agree everywhere."""
    lines, agree = [], True
    for name, (overrides, seed) in DROPS.items():
        found = count(case_of(overrides, grid), seed)
        agree = agree and found.differ == 0
        from_height = "" if found.first is None else f" (from {1e3 * found.first:.0f} mm)"
        line = [name, str(found.missed), f"{found.before}{from_height}", *map(str, found[2:8])]
        lines.append([*line, "agrees" if found.differ == 0 else f"differs {found.differ} times"])
    table([f"{grid[0]} x {grid[1]}", *COLUMNS, "IPC Toolkit"], lines)
    return agree


def seeds(grid: tuple[int, int], numbers: Iterable[int], most: int) -> bool:
    """Print what disturbed drops have until LAST; return whether none has more threads than allowed, and both counts agree."""
    lines, sound = [], True
    for name in SCATTERED:
        found = [count(case_of(DROPS[name][0], grid), seed) for seed in numbers]
        threads = [one.before for one in found]
        differ = sum(one.differ for one in found)
        sound = sound and max(threads) <= most and differ == 0
        missed, hinges = ([getattr(one, part) for one in found] for part in ("missed", "hinges"))
        line = [name, *(", ".join(map(str, part)) for part in (threads, missed, hinges))]
        lines.append([*line, "agrees" if differ == 0 else f"differs {differ} times"])
    table(
        [f"{grid[0]} x {grid[1]}", "threads until 5 mm, by seed", "missed collisions", "hinges until 5 mm", "IPC Toolkit"], lines
    )
    return sound


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.threads", description=__doc__)
    parser.add_argument("--grid", default="36x90", help="cells along the generatrix and around the hoop")
    parser.add_argument("--seeds", type=int, default=0, help="disturbed drops of each of three cases; 0: the table of six drops")
    parser.add_argument("--most", type=int, default=2, help="threads that disturbed drops may have until 5 mm are left")
    options = parser.parse_args()
    generatrix, hoop = map(int, options.grid.split("x"))
    grid = generatrix, hoop
    sys.exit(0 if (seeds(grid, range(options.seeds), options.most) if options.seeds else drops(grid)) else 1)


if __name__ == "__main__":
    main()
