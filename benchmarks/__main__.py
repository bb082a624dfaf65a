"""`python -m benchmarks [--short] [--json FILE]`: kernel rate, start-up, whole drops by step size, and where the rest goes."""

import argparse
import json
import os
import platform
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Iterator
from copy import deepcopy
from pathlib import Path
from statistics import median
from time import perf_counter, process_time
from typing import Any

import numba
from llvmlite.binding import get_host_cpu_name
from numba import njit
from rich.console import Console
from rich.table import Table

import softbrake
from benchmarks.batch import batch_rate
from benchmarks.calibration import Calibration
from softbrake.build import build_sweep
from softbrake.case import Case, load_case
from softbrake.drop import Diverged, Drop
from softbrake.kernels.course import STEPS_PER_STEP_CHOICE
from softbrake.kernels.timestep import stable_step
from softbrake.results import read_summary
from softbrake.state import Floats, Outcome

ROOT = Path(__file__).resolve().parents[1]
PAPER = ROOT / "configs" / "paper.yaml"
FLIGHT = 0.01  # s after contact: inflated, swinging, half of the hoops slack at times
CHUNK_SECONDS = 0.1
CHUNKS = 9

Row = dict[str, Any]


def paper(*overrides: str) -> Case:
    """Return the paper's case with some keys changed."""
    return load_case(PAPER, overrides)


def kernel_rate(generatrix: int, hoop: int, scheme: str, calibration: Calibration) -> Row:
    """Measure a step in flight: medians of CPU time over repeats of the same steps, each beside the calibration loop."""
    drop = Drop(paper(f"grid.generatrix={generatrix}", f"grid.hoop={hoop}", f"model.scheme={scheme}"))
    nodes = (generatrix + 1) * hoop
    drop.advance(until=FLIGHT)
    start_state = deepcopy(drop.state)
    most = max(round(CHUNK_SECONDS / (20e-9 * nodes)), STEPS_PER_STEP_CHOICE)
    rates, ratios, choices = [], [], []
    sweep = build_sweep(drop.model)
    choose_steps(drop.model, drop.state.nodes, sweep, 1)  # compiles
    for _ in range(CHUNKS):
        machine = calibration.nanoseconds()
        for now, then in zip(arrays(drop.state), arrays(start_state), strict=True):
            now[:] = then
        start = process_time()
        _, outcome = drop.advance(most=most)
        rates.append(1e9 * (process_time() - start) / (nodes * most))
        ratios.append(rates[-1] / machine)
        start = process_time()
        choose_steps(drop.model, drop.state.nodes, sweep, STEPS_PER_STEP_CHOICE)
        choices.append(1e9 * (process_time() - start) / (nodes * STEPS_PER_STEP_CHOICE))
    if outcome != Outcome.RUNNING:
        raise RuntimeError(f"grid {generatrix} x {hoop}, scheme {scheme}: {outcome.name.lower()} while it was timed")
    rate = median(rates)
    return {
        "grid": f"{generatrix} x {hoop}",
        "scheme": scheme,
        "ns_per_node_and_step": rate,
        "lowest": min(rates),
        "highest": max(rates),
        "ratio_to_calibration": median(ratios),
        "step_choice_share": median(choices) / (STEPS_PER_STEP_CHOICE * rate),
    }


@njit(error_model="numpy")
def choose_steps(model, nodes, sweep, count):
    """Choose the step count times, in one call: Python takes longer to hand over the arrays than the choice takes."""
    for _ in range(count):
        stable_step(model, nodes, sweep)


def arrays(part: Any) -> Iterator[Floats]:
    """Yield the arrays of a tuple of arrays and tuples."""
    for member in part:
        yield from arrays(member) if isinstance(member, tuple) else (member,)


def start_up(cold: bool) -> list[Row]:
    """Measure the wall time of whole processes: `--help`, `check`, and a run of one step with its result file."""
    with tempfile.TemporaryDirectory() as folder:
        one_step = ["run", str(PAPER), "--quiet", "--set", "time.end=0.001 ms", "--output", f"{folder}/one-step.vtkhdf"]
        rows = []
        if cold:
            seconds = process_seconds(one_step, NUMBA_CACHE_DIR=folder)
            rows.append({"process": "run of one step, kernels not compiled yet", "seconds": seconds})
        process_seconds(one_step)
        for name, arguments in (("--help", ["--help"]), ("check", ["check", str(PAPER)]), ("run of one step", one_step)):
            rows.append({"process": name, "seconds": median(process_seconds(arguments) for _ in range(5))})
    return rows


def process_seconds(arguments: list[str], **environment: str) -> float:
    """Return the wall time (s) of one run of the command line."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT), **environment}
    start = perf_counter()
    subprocess.run([sys.executable, "-m", "softbrake", *arguments], env=environment, check=True, capture_output=True)
    return perf_counter() - start


def whole_drop(courant: float) -> Row:
    """Measure the paper's drop with its result file, which takes what the kernels leave of the wall time."""
    with tempfile.TemporaryDirectory() as folder:
        results = Path(folder) / "drop.vtkhdf"
        softbrake.run(paper("time.end=0.001 ms"), results)  # loads what a first run loads
        try:
            summary = softbrake.run(paper(f"time.courant={courant}"), results)
        except Diverged:
            summary = read_summary(results)
    assert summary is not None
    return {
        "courant": courant,
        "outcome": summary.outcome,
        "impact_velocity": summary.impact_velocity,
        "steps": summary.steps,
        "kernel_seconds": summary.kernel_seconds,
        "wall_seconds": summary.wall_seconds,
        "writing_share": 1.0 - summary.kernel_seconds / summary.wall_seconds,
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


def main() -> None:
    """Run all benchmarks and report."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("--short", action="store_true", help="one grid, one scheme, one Courant coefficient, no compilation")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the numbers there as well")
    options = parser.parse_args()
    console = Console()
    console.width = max(console.width, 110)
    grids = [(36, 90)] if options.short else [(36, 90), (72, 180), (144, 360)]
    schemes = ["edge"] if options.short else ["edge", "cell"]
    courants = [0.5] if options.short else [0.02, 0.1, 0.5, 0.9]
    about = {
        "softbrake": softbrake.__version__,
        "python": platform.python_version(),
        "numba": numba.__version__,
        "processor": get_host_cpu_name(),
        "cores": os.cpu_count(),
    }
    console.print(", ".join(f"{name} {value}" for name, value in about.items()))
    calibration = Calibration(CHUNK_SECONDS)
    rates = [kernel_rate(*grid, scheme, calibration) for grid in grids for scheme in schemes]
    report = {
        "about": about,
        "calibration_nanoseconds": median(calibration.nanoseconds() for _ in range(CHUNKS)),
        "kernel_rate": show(console, f"A step in flight, {FLIGHT} s after contact (CPU time; one thread)", rates),
        "start_up": show(console, "Whole processes (wall time)", start_up(cold=not options.short)),
        "whole_drop": show(console, "The paper's drop with its result file", map(whole_drop, courants)),
        "batch": show(console, "Axisymmetric drops at once, 36 cells", (batch_rate(courant, 200) for courant in (0.5, 0.9))),
    }
    if options.json:
        options.json.write_text(json.dumps(report, indent=2) + "\n")


if __name__ == "__main__":
    main()
