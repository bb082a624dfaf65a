"""Drops a second: the paper's case with a modulus of its own each, axisymmetric, on all cores."""

from pathlib import Path
from time import perf_counter, process_time
from typing import Any

from softbrake.case.case_file import load_case
from softbrake.sim.cores import cores
from softbrake.studies.batch import run_batch

PAPER = Path(__file__).resolve().parents[1] / "configs" / "paper.yaml"


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
