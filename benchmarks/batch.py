"""Drops a second: the paper's case with a modulus of its own each, axisymmetric, on all cores.

python -m benchmarks.batch [--drops N]        a sampled sweep from the command to its picture, beside as many drops alone
"""

import argparse
import json
import tempfile
from pathlib import Path
from resource import RUSAGE_CHILDREN, getrusage
from time import perf_counter, process_time
from typing import Any

from benchmarks.startup import ROOT, seconds
from softbrake.case.case_file import load_case
from softbrake.sim.cores import cores
from softbrake.studies.batch import run_batch

PAPER = ROOT / "configs" / "paper.yaml"
SAMPLED = ("fabric.E=normal(20 kN/m, 1 kN/m)", "cargo.mass=normal(100 kg, 3 kg)", "cargo.velocity=normal(6 m/s, 0.1 m/s)")
SETTINGS = ("model.fidelity=axisymmetric", "time.courant=auto", "limits.impact_velocity=<= 4.2 m/s")


def batch_rate(courant: float | str, drops: int) -> dict[str, Any]:
    """Measure a batch; by CPU time the rate is that of cores which nobody else uses."""
    moduli = [15e3 + 10e3 * k / (drops - 1) for k in range(drops)]
    level = ("model.fidelity=axisymmetric", f"time.courant={courant}")
    cases = [load_case(PAPER, [*level, f"fabric.E={modulus}"]) for modulus in moduli]
    list(run_batch(cases[:4]))  # compiles
    wall, cpu = perf_counter(), process_time()
    steps = sum(answer.summary.steps for answer in run_batch(cases) if answer.summary is not None)
    wall, cpu = perf_counter() - wall, process_time() - cpu
    return {
        "courant": courant,
        "drops": drops,
        "steps_a_drop": steps / drops,
        "ms_of_cpu_a_drop": 1e3 * cpu / drops,
        "drops_a_second": drops / wall,
        "drops_a_second_by_cpu_time": cores() * drops / cpu,
    }


def sampled_sweep(drops: int) -> dict[str, Any]:
    """Measure the whole command of a sweep over three distributions, and drops alone before and after it."""
    words = [word for override in SETTINGS for word in ("--set", override)]
    words += [word for axis in SAMPLED for word in ("--vary", axis)]
    command = ["sweep", str(PAPER), *words, "--mode", "sobol", "--quiet", "--samples"]
    with tempfile.TemporaryDirectory() as folder:
        seconds(ROOT, [*command, "2", "--output", "compiles"], Path(folder))
        alone = batch_rate("auto", drops // 10)["ms_of_cpu_a_drop"]
        cpu, wall = seconds(ROOT, [*command, str(drops), "--output", "measured"], Path(folder))
        alone = 0.5 * (alone + batch_rate("auto", drops // 10)["ms_of_cpu_a_drop"])
    return {
        "drops": drops,
        "wall_seconds": wall,
        "cpu_seconds": cpu,
        "megabytes": getrusage(RUSAGE_CHILDREN).ru_maxrss / 1e3,
        "cpu_over_drops_alone": cpu / (1e-3 * alone * drops),
    }


def main() -> None:
    """Measure a sampled sweep and print it."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.batch", description=__doc__)
    parser.add_argument("--drops", type=int, default=10_000, metavar="N")
    print(json.dumps(sampled_sweep(parser.parse_args().drops), indent=2))


if __name__ == "__main__":
    main()
