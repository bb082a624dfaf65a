"""CPU time of whole processes beside an older tree: table of docs/validation/performance.md.

python -m benchmarks.startup --old FOLDER [--repeats N]        FOLDER is a checkout; each tree takes its own configs/paper.yaml

Each command runs in both trees in turn, kernels and bytecode compiled before; ratios are medians of those of neighbours.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from resource import RUSAGE_CHILDREN, getrusage
from statistics import median
from time import perf_counter

from benchmarks.reproduction import table

ROOT = Path(__file__).resolve().parents[1]
CASE = "configs/paper.yaml"
COMMANDS = {
    "`--help`": ["--help"],
    f"`check {CASE}`": ["check", CASE],
    f"`run {CASE}`, one step": ["run", CASE, "--quiet", "--set", "time.end=0.001 ms"],
    f"`run {CASE}`, no result file": ["run", CASE, "--quiet", "--no-results"],
    f"`run {CASE}`": ["run", CASE, "--quiet"],
}


def seconds(tree: Path, arguments: list[str], folder: Path, **environment: str) -> tuple[float, float]:
    """Return the CPU and wall time (s) of a run of a tree's command line in a folder, which also keeps Python's bytecode."""
    placed = [str(tree / CASE) if each == CASE else each for each in arguments]
    about = {**os.environ, "PYTHONPATH": str(tree), "PYTHONPYCACHEPREFIX": str(folder / "bytecode"), **environment}
    about.pop("PYTHONDONTWRITEBYTECODE", None)  # users do not compile the sources at each start
    before, start = getrusage(RUSAGE_CHILDREN), perf_counter()
    subprocess.run([sys.executable, "-m", "softbrake", *placed], env=about, cwd=folder, check=True, capture_output=True)
    wall, after = perf_counter() - start, getrusage(RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, wall


def beside(old: Path, arguments: list[str], repeats: int) -> list[str]:
    """Return the CPU seconds of a command in the old tree and in this one, and their ratio, medians."""
    times: dict[Path, list[float]] = {old: [], ROOT: []}
    with tempfile.TemporaryDirectory() as one, tempfile.TemporaryDirectory() as other:
        folders = [(old, Path(one)), (ROOT, Path(other))]
        for attempt in range(repeats + 1):
            for tree, folder in folders if attempt % 2 else folders[::-1]:
                times[tree].append(seconds(tree, arguments, folder)[0])
    before, now = times[old][1:], times[ROOT][1:]  # the first ones compile
    ratio = median(new / was for was, new in zip(before, now, strict=True))
    return [f"{median(before):.2f}", f"{median(now):.2f}", f"{ratio:.2f}"]


def main() -> None:
    """Compare and print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.startup", description=__doc__)
    parser.add_argument("--old", type=Path, required=True, metavar="FOLDER", help="an older tree")
    parser.add_argument("--repeats", type=int, default=15, metavar="N")
    options = parser.parse_args()
    old = options.old.resolve()
    table(
        ["command", "old, CPU s", "new, CPU s", "ratio"],
        [[name, *beside(old, each, options.repeats)] for name, each in COMMANDS.items()],
    )


if __name__ == "__main__":
    main()
