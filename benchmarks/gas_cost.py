"""What a gas with a state costs: a step of the shell beside one under a pressure law, and axisymmetric drops at once."""

from collections.abc import Sequence
from dataclasses import replace
from statistics import median
from time import process_time, thread_time
from typing import Any

from softbrake.case.case import Case
from softbrake.case.case_file import load_case
from softbrake.core.arrays import Outcome
from softbrake.core.columns import History
from softbrake.sim.simulation import NO_ROWS, Simulation
from softbrake.studies.batch import run_batch

ROUNDS = 40
SECONDS = 0.02  # of each round
DROPS = 60
VENT = {"area": "50 cm^2", "discharge": 0.6}
SCENE: dict[str, Any] = {  # the paper's shell of elastic fabric
    "shell": {"diameter": 0.5, "height": 0.6},
    "fabric": {"E": "20 kN/m", "nu12": 0.25, "areal_density": 0.05, "viscosity": 0.2},
    "cargo": {"mass": 100, "velocity": 6},
    "contact": "solid",
}


def law(**others: Any) -> Case:
    """The scene under its pressure, inflated at the start."""
    pressure = {"law": "constant", "value": "15.7 kPa"}
    return load_case({**SCENE, "pressure": pressure, "initial": "inflated", **others})


def gas(vents: Sequence[Any], **others: Any) -> Case:
    """The scene with a gas of that pressure."""
    return load_case({**SCENE, "gas": {"pressure": "15.7 kPa"}, "vents": list(vents), **others})


def step_cost(fidelity: str, grid: tuple[int, int]) -> dict[str, Any]:
    """Measure steps in turn, from the same inflated shell on: medians of CPU time, and of ratios of the same round."""
    others = {"model": {"fidelity": fidelity}, "grid": {"generatrix": grid[0], "hoop": grid[1]}}
    cases = {"law": law(**others), "closed": gas([], **others), "vented": gas([VENT], **others)}
    drops = {name: Simulation(case) for name, case in cases.items()}
    for drop in drops.values():
        drop.interval = NO_ROWS
    steps = min(max(round(SECONDS / (15e-9 * (grid[0] + 1) * drops["law"].model.n2)), 16), 1000)
    found: dict[str, list[float]] = {name: [] for name in cases}
    for _ in range(ROUNDS):
        for name, drop in drops.items():
            start = thread_time()
            _, outcome = drop.advance(most=steps)
            found[name].append((thread_time() - start) / steps)
            if outcome != Outcome.RUNNING or drop.now(History.HEIGHT) < 0.5 * cases[name].shell.height:
                drops[name] = Simulation(cases[name])
                drops[name].interval = NO_ROWS
    ratios = {name: median(one / base for one, base in zip(found[name], found["law"], strict=True)) for name in cases}
    return {
        "fidelity": fidelity,
        "grid": f"{grid[0]} x {grid[1]}",
        "us_a_step": 1e6 * median(found["law"]),
        "closed_over_law": ratios["closed"],
        "vented_over_law": ratios["vented"],
    }


def batch_cost() -> list[dict[str, Any]]:
    """Measure batches over the fabric's modulus, in turn: CPU time a drop and a step."""
    others = {"model": {"fidelity": "axisymmetric"}, "grid": {"generatrix": 36, "hoop": 90}}
    kinds = {"law": law(**others), "closed": gas([], **others), "vented": gas([VENT], **others)}
    kinds["law, unloaded"] = replace(kinds["law"], initial="unloaded")
    rows = []
    for name, case in kinds.items():
        moduli = [15e3 + 10e3 * k / (DROPS - 1) for k in range(DROPS)]
        cases = [replace(case, fabric=replace(case.fabric, E11=modulus, E22=modulus)) for modulus in moduli]
        list(run_batch(cases[:2]))  # compiles
        start = process_time()
        steps = sum(answer.summary.steps for answer in run_batch(cases) if answer.summary is not None)
        seconds = process_time() - start
        rows.append(
            {"drops": name, "steps_a_drop": steps / DROPS, "ms_a_drop": 1e3 * seconds / DROPS, "us_a_step": 1e6 * seconds / steps}
        )
    return rows
