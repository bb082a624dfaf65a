"""`python -m benchmarks [--short] [--json FILE] [--yardstick FOLDER]`: what a step, a start and an answer cost.

Rates stand beside those of benchmarks/baseline.json (an older --json) as ratios to the calibration loop run next to them. With
--short a rate that fell by more than a third in each of three attempts ends in exit code 1; on another kind of processor than the
baseline's one that fell by more than half, since no loop tells all of a processor.
--yardstick builds and runs the C step of a folder (bench.c, kernel.h) next to the kernel. The tables stand in
docs/validation/performance.md.
"""

import argparse
import json
import os
import platform
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Iterator
from copy import deepcopy
from pathlib import Path
from statistics import median
from time import process_time
from typing import Any

import numba
from llvmlite.binding import get_host_cpu_name
from numba import njit
from rich.console import Console
from rich.table import Table

import softbrake
from benchmarks.batch import batch_rate
from benchmarks.calibration import Calibration
from benchmarks.gas_cost import batch_cost, step_cost
from benchmarks.startup import seconds
from softbrake.case.case import Case
from softbrake.case.case_file import load_case
from softbrake.core.arrays import Floats, Outcome, State
from softbrake.core.columns import History
from softbrake.core.loop.step_size import stable_step
from softbrake.core.loop.time_loop import STEPS_PER_STEP_CHOICE
from softbrake.sim.build import build_workspace
from softbrake.sim.result_file import read_summary
from softbrake.sim.simulation import Diverged, Simulation

BASELINE = Path(__file__).with_name("baseline.json")
FALLEN = 1.5  # times the time per node and step of the baseline: a rate fallen by a third
FALLEN_ELSEWHERE = 2.0  # likewise on another processor, by which vector units and caches count otherwise than in the loop
ATTEMPTS = 3
CRUSHED = 0.09  # s after contact: half of the stroke is left, cloth lies on the ground and, where it is in the way, on the cargo
ROOT = Path(__file__).resolve().parents[1]
PAPER = ROOT / "configs" / "paper.yaml"
FLIGHT = 0.01  # s after contact: inflated, swinging, half of the hoops slack at times
CHUNK_SECONDS = 0.1
CHUNKS = 9
Row = dict[str, Any]


def paper(*overrides: str) -> Case:
    """Return the paper's case with some keys changed."""
    return load_case(PAPER, overrides)


def kernel_rate(grid: tuple[int, int], calibration: Calibration, *overrides: str, until: float = FLIGHT) -> Row:
    """Measure a step of the full shell: medians of CPU time over repeats of the same steps, each beside the calibration loop."""
    generatrix, hoop = grid
    drop = Simulation(paper(f"grid.generatrix={generatrix}", f"grid.hoop={hoop}", *overrides))
    nodes = (generatrix + 1) * hoop
    outcome = Outcome.RUNNING
    while outcome == Outcome.RUNNING and drop.now(History.TIME) < until:
        _, outcome = drop.advance(until)
    start_state = deepcopy(drop.state)
    most = max(round(CHUNK_SECONDS / (20e-9 * nodes)), STEPS_PER_STEP_CHOICE)
    rates, ratios, choices = [], [], []
    workspace = build_workspace(drop.model)
    choose_steps(drop.model, drop.state.nodes, workspace, 1)  # compiles
    for _ in range(CHUNKS):
        machine = calibration.nanoseconds()
        restore(drop, start_state)
        start = process_time()
        _, outcome = drop.advance(most=most)
        rates.append(1e9 * (process_time() - start) / (nodes * most))
        ratios.append(rates[-1] / machine)
        start = process_time()
        choose_steps(drop.model, drop.state.nodes, workspace, STEPS_PER_STEP_CHOICE)
        choices.append(1e9 * (process_time() - start) / (nodes * STEPS_PER_STEP_CHOICE))
    if outcome != Outcome.RUNNING:
        raise RuntimeError(f"grid {generatrix} x {hoop}, {', '.join(overrides)}: {outcome.name.lower()} while it was timed")
    rate = median(rates)
    return {
        "grid": f"{generatrix} x {hoop}",
        "case": ", ".join(overrides) or "as it is",
        "at": f"{1e3 * until:g} ms",
        "ns_per_node_and_step": rate,
        "lowest": min(rates),
        "highest": max(rates),
        "ratio_to_calibration": median(ratios),
        "step_choice_share": median(choices) / (STEPS_PER_STEP_CHOICE * rate),
    }


def restore(drop: Simulation, state: State) -> None:
    """Set a drop back to a copy of its state."""
    for now, then in zip(arrays(drop.state), arrays(state), strict=True):
        now[:] = then


def beside_yardstick(folder: Path, grid: tuple[int, int], calibration: Calibration) -> Row:
    """Measure a step beside the C step of a folder, plain and with its roots by hand, in turn, five times; medians."""
    generatrix, hoop = grid
    row: Row = {"grid": f"{generatrix} x {hoop}"}
    flags = ["-O3", "-march=native", "-ffast-math", "-mprefer-vector-width=512", f"-DNR={generatrix + 1}", f"-DNC={hoop}"]
    with tempfile.TemporaryDirectory() as scratch:
        names = {"C": [], "C, roots by hand": ["-DHANDRSQRT"]}
        for number, extra in enumerate(names.values()):
            subprocess.run(["gcc", *flags, *extra, "-o", f"{scratch}/{number}", str(folder / "bench.c"), "-lm"], check=True)
        found: dict[str, list[float]] = {name: [] for name in ("softbrake", *names)}
        for _ in range(5):
            found["softbrake"].append(kernel_rate(grid, calibration)["ns_per_node_and_step"])
            for number, name in enumerate(names):
                blocks = str(max(200 * 37 * 90 // ((generatrix + 1) * hoop), 5))
                printed = subprocess.run([f"{scratch}/{number}", blocks], check=True, capture_output=True, text=True).stdout
                found[name].append(float(re.findall(r"median\(cpu\) ([\d.]+)", printed)[0]))
    row |= {f"{name}, ns": median(values) for name, values in found.items()}
    for name in names:
        row[f"ratio to {name}"] = median(ours / theirs for ours, theirs in zip(found["softbrake"], found[name], strict=True))
    return row


@njit(error_model="numpy")
def choose_steps(model, nodes, workspace, count):
    """Choose the step count times, in one call: Python takes longer to hand over the arrays than the choice takes."""
    for _ in range(count):
        stable_step(model, nodes, workspace)


def arrays(part: Any) -> Iterator[Floats]:
    """Yield the arrays of a tuple of arrays and tuples; None is there where a part is not asked for."""
    for member in part:
        if member is not None:
            yield from arrays(member) if isinstance(member, tuple) else (member,)


def start_up(cold: bool) -> list[Row]:
    """Measure whole processes: `--help`, `check`, a run of one step and a whole one, with their result files."""
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        one_step = ["run", str(PAPER), "--quiet", "--set", "time.end=0.001 ms", "--output", "one-step.vtkhdf"]
        whole = ["run", str(PAPER), "--quiet", "--output", "whole.vtkhdf"]
        process("", one_step, 1, folder)  # compiles, and Python's bytecode too
        rows = []
        if cold:
            rows.append(process("run of one step, kernels not compiled yet", one_step, 1, folder, NUMBA_CACHE_DIR=scratch))
        for name, arguments in (("--help", ["--help"]), ("check", ["check", str(PAPER)]), ("run of one step", one_step)):
            rows.append(process(name, arguments, 5, folder))
        return [*rows, process("whole run", whole, 3, folder)]


def process(name: str, arguments: list[str], count: int, folder: Path, **environment: str) -> Row:
    """Return medians of the CPU and wall time (s) of runs of the command line."""
    cpu, wall = zip(*(seconds(ROOT, arguments, folder, **environment) for _ in range(count)), strict=True)
    return {"process": name, "cpu_seconds": median(cpu), "wall_seconds": median(wall)}


def whole_drop(*overrides: str) -> Row:
    """Measure the paper's drop with its result file, which takes what the kernels leave of the wall time."""
    with tempfile.TemporaryDirectory() as folder:
        results = Path(folder) / "drop.vtkhdf"
        softbrake.run(paper("time.end=0.001 ms", *overrides), results)  # loads what a first run loads
        start = process_time()
        try:
            summary = softbrake.run(paper(*overrides), results)
        except Diverged:
            summary = read_summary(results)
        seconds = process_time() - start
    assert summary is not None
    return {
        "case": ", ".join(overrides) or "as it is",
        "outcome": summary.outcome,
        "impact_velocity": summary.impact_velocity,
        "steps": summary.steps,
        "cpu_seconds": seconds,
        "wall_seconds": summary.wall_seconds,
        "kernel_share": summary.kernel_seconds / seconds,
        "energy_error": summary.energy_error,
    }


def show(console: Console, title: str, rows: Iterable[Row]) -> list[Row]:
    """Print a table of rows as they come, and return them."""
    rows = list(rows)
    table = Table(*(name.replace("_", " ") for name in rows[0]), title=title, title_justify="left")
    for row in rows:
        table.add_row(*(f"{value:.4g}" if isinstance(value, float) else str(value) for value in row.values()))
    console.print(table)
    return rows


def compare(console: Console, rates: list[Row], short: bool, calibration: Calibration) -> bool:
    """Print each rate beside that of the baseline; return whether all stand, those that seem to have fallen tried again.

    Raises KeyError where the baseline lacks a rate: record it anew.
    """
    baseline = json.loads(BASELINE.read_text())
    same = baseline["about"]["processor"] == get_host_cpu_name()
    before = {(row["grid"], row["case"], row["at"]): row["ratio_to_calibration"] for row in baseline["kernel_rate"]}
    most = FALLEN if same else FALLEN_ELSEWHERE
    rows, stand = [], True
    for row in rates:
        key = row["grid"], row["case"], row["at"]
        times = [row["ratio_to_calibration"] / before[key]]
        overrides = [] if row["case"] == "as it is" else row["case"].split(", ")
        while short and times[-1] > most and len(times) < ATTEMPTS:
            generatrix, hoop = map(int, row["grid"].split(" x "))
            until = 1e-3 * float(row["at"].removesuffix(" ms"))
            again = kernel_rate((generatrix, hoop), calibration, *overrides, until=until)
            times.append(again["ratio_to_calibration"] / before[key])
        stand = stand and times[-1] <= most
        rows.append(
            {"grid": row["grid"], "case": row["case"], "at": row["at"], "time_over_baseline": times[-1], "tries": len(times)}
        )
    show(console, f"Against benchmarks/baseline.json ({baseline['about']['processor']})", rows)
    if not stand:
        console.print(f"a rate has fallen: more than {most:g} times the baseline's time a node and step")
    return stand


def main() -> None:
    """Run all benchmarks and report."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("--short", action="store_true", help="one grid, no compilation; exit code 1 where a rate has fallen")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the numbers there as well")
    parser.add_argument("--yardstick", type=Path, metavar="FOLDER", help="of a C step to run beside the kernel; wants gcc")
    options = parser.parse_args()
    console = Console()
    console.width = max(console.width, 110)
    about = {
        "softbrake": softbrake.__version__,
        "python": platform.python_version(),
        "numba": numba.__version__,
        "processor": get_host_cpu_name(),
        "cores": os.cpu_count(),
    }
    console.print(", ".join(f"{name} {value}" for name, value in about.items()))
    calibration = Calibration(CHUNK_SECONDS)
    small, solid = (36, 90), "contact=solid"
    rates = [kernel_rate(small, calibration), kernel_rate(small, calibration, solid, until=CRUSHED)]
    drops = [whole_drop("model.fidelity=axisymmetric"), whole_drop()]
    if not options.short:
        rates += [kernel_rate(grid, calibration) for grid in ((72, 180), (144, 360))]
        rates += [kernel_rate(small, calibration, *case) for case in (("model.scheme=cell",), ("pressure.damping=0.0005",))]
        rates += [kernel_rate(small, calibration, until=CRUSHED)]
        drops += [whole_drop("model.fidelity=lumped")]
        drops += [whole_drop(f"time.courant={courant}") for courant in (0.02, 0.1, 0.9)]
    batches = (batch_rate(courant, 200) for courant in ("auto", 0.9, 0.5))
    report = {
        "about": about,
        "calibration_nanoseconds": median(calibration.nanoseconds() for _ in range(CHUNKS)),
        "kernel_rate": show(console, "A step of the full shell (CPU time; one thread)", rates),
        "start_up": show(console, "Whole processes", start_up(cold=not options.short)),
        "whole_drop": show(console, "The paper's drop with its result file", drops),
        "batch": show(console, "Axisymmetric drops at once, 36 cells", batches),
    }
    if not options.short:
        scenes = (("axisymmetric", small), ("full", small), ("full", (144, 360)))
        report["gas_step"] = show(console, "A step with gas over one under a law", (step_cost(*scene) for scene in scenes))
        report["gas_batch"] = show(console, "Axisymmetric drops at once, with gas", batch_cost())
    if options.yardstick is not None:
        beside = [beside_yardstick(options.yardstick, grid, calibration) for grid in (small, (144, 360))]
        report["yardstick"] = show(console, "Beside the C step (CPU time)", beside)
    if options.json:
        options.json.write_text(json.dumps(report, indent=2) + "\n")
    if not compare(console, rates, options.short, calibration):
        sys.exit(1)


if __name__ == "__main__":
    main()
