"""Whether error bars are true: engineer's scenes drawn by chance, answered for a tolerance, beside finer full shells.

    python -m benchmarks.claims references [--scenes 40]      half an hour on two cores; kept in claims.json, scene by scene
    python -m benchmarks.claims [--scenes 40] [--tolerance 0.02 0.05] [--budget 60]

A reference is two full shells with folds, cells an eighteenth of the radius long, disturbed by 1e-3 and 1e-5 of the radius with
random numbers that no climb uses. Where both stay round, what the axisymmetric shell changes from that grid to one five times as
fine is added. A claim holds where both are within its bar.
"""

from __future__ import annotations

import argparse
import json
import math
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

from benchmarks.scenes import scene
from softbrake.case.case import Case
from softbrake.case.case_file import parse_case
from softbrake.case.level import level
from softbrake.core.arrays import Outcome
from softbrake.core.columns import History
from softbrake.sim import simulation
from softbrake.sim.simulation import Diverged, Simulation, cores
from softbrake.studies.error_control import LEAST_SPEED, OUT_OF_ROUND, allowed, refine, speed_of

REFERENCES = Path(__file__).with_name("claims.json")
FINE = 18.0  # cells in a radius
SIZES = (1e-3, 1e-5)  # of the radius
SEEDS = 1000  # of the references, from here on


def case_of(number: int) -> Case:
    """The case of a scene, as a user would type it."""
    return parse_case(scene(number), f"scene {number}")


def refer(number: int) -> dict[str, Any]:
    """Answers of the full shells of a scene."""
    case = case_of(number)
    radius = 0.5 * case.shell.diameter
    n1 = math.ceil(case.shell.height / radius * FINE)
    n2 = 8 * math.ceil(2.0 * math.pi * FINE / 8.0)
    shells = []
    for member, size in enumerate(SIZES):
        falling, out, outcome = Simulation(level(case, "full", n1, n2)), 0.0, Outcome.RUNNING
        falling.disturb(size * radius, SEEDS + member)
        interval = case.shell.height / case.cargo.velocity / 50
        while outcome == Outcome.RUNNING:
            _, outcome = falling.advance((falling.now(History.TIME) // interval + 1.0) * interval)
            if outcome == Outcome.RUNNING:
                out = max(out, falling.lopsided())
        try:
            answer = falling.finish(outcome)
        except Diverged as diverged:
            shells.append({"size": size, "outcome": "diverged", "fault": str(diverged)})
            continue
        shells.append(
            {
                "size": size,
                "outcome": answer.outcome,
                "impact_velocity": speed_of(answer),
                "peak_deceleration": answer.peak_deceleration,
                "peak_tension_hoop": answer.peak_tension_hoop,
                "out_of_round": out / radius,
                "crossings": answer.missed_collisions,
                "elastic": answer.work.elastic,
                "seconds": answer.kernel_seconds,
            }
        )
    return {
        "scene": scene(number),
        "grid": [n1, n2],
        "free_fall": math.sqrt(case.cargo.velocity**2 + 2.0 * case.gravity * case.shell.height),
        "shells": shells,
    }


def known() -> dict[str, Any]:
    """References kept of scenes as they are drawn now."""
    kept = json.loads(REFERENCES.read_text(encoding="utf-8")) if REFERENCES.exists() else {}
    return {number: one for number, one in kept.items() if one["scene"] == scene(int(number))}


def references(scenes: int) -> None:
    """Compute the references that are missing, and keep each as it is done."""
    kept = known()
    missing = [number for number in range(scenes) if str(number) not in kept]
    with ProcessPoolExecutor(cores()) as pool:
        for number, found in zip(missing, pool.map(refer, missing), strict=True):
            kept[str(number)] = found
            REFERENCES.write_text(json.dumps(kept, indent=1), encoding="utf-8")
            print(number, *(f"{one.get('impact_velocity', math.nan):.4f}" for one in found["shells"]), flush=True)


def exact(number: int) -> dict[str, float]:
    """Impact velocities of the axisymmetric shell of a scene: on the grid of its references, and on one five times as fine."""
    case = case_of(number)
    n1 = math.ceil(case.shell.height / (0.5 * case.shell.diameter) * FINE)
    twin, limit = (simulation.simulate(level(case, "axisymmetric", cells, 120)) for cells in (n1, 5 * n1))
    return {"twin": speed_of(twin), "limit": speed_of(limit)}


def claim(job: tuple[int, float, float]) -> dict[str, Any]:
    """What a scene is answered for a tolerance within a budget."""
    number, tolerance, budget = job
    found = refine(case_of(number), tolerance, budget)
    answer = found.summary
    return {
        "velocity": speed_of(answer),
        "error": math.inf if answer.impact_velocity_error is None else answer.impact_velocity_error,
        "seconds": sum(trial.seconds for trial in answer.trials),
        "basis": "ensemble" if answer.ensemble is not None else found.case.model.fidelity,
        "doubt": answer.doubt,
    }


def claims(scenes: int, tolerances: list[float], budget: float) -> None:
    """Answer the scenes, hold the answers beside the references and print a table.

    A scene is asked for the smallest tolerance; whether it meets the others its bar tells.
    """
    kept = known()
    numbers = [number for number in range(scenes) if str(number) in kept]
    with ProcessPoolExecutor(cores()) as pool:
        missing = [number for number in numbers if "limit" not in kept[str(number)]]
        for number, found in zip(missing, pool.map(exact, missing), strict=True):
            kept[str(number)] |= found
        REFERENCES.write_text(json.dumps(kept, indent=1), encoding="utf-8")
        print("| scene | reference, m/s | answer, m/s | bar | CPU s | by |")
        print("|---:|---|---|---:|---:|---|", flush=True)
        answered, held, inside = dict.fromkeys(tolerances, 0), dict.fromkeys(tolerances, 0), 0
        answers = pool.map(claim, [(number, min(tolerances), budget) for number in numbers])
        for number, answer in zip(numbers, answers, strict=True):
            one = kept[str(number)]
            shells = [shell for shell in one["shells"] if shell["outcome"] != "diverged"]
            is_round = all(shell["out_of_round"] <= OUT_OF_ROUND for shell in shells)
            change_velocity = one["limit"] - one["twin"] if is_round else 0.0
            values = [shell["impact_velocity"] + change_velocity for shell in shells]
            holds = max(abs(value - answer["velocity"]) for value in values) <= answer["error"]
            inside += holds
            for tolerance in tolerances:
                reaches = answer["error"] <= allowed(tolerance, answer["velocity"], one["free_fall"])
                answered[tolerance] += reaches
                held[tolerance] += reaches and holds
            share = answer["error"] / max(answer["velocity"], LEAST_SPEED * one["free_fall"])
            reference = ", ".join(f"{value:.3f}" for value in values) + ("" if is_round else ", not round")
            bar = f"{answer['velocity']:.3f} ± {answer['error']:.2g}{'' if holds else ', reference OUTSIDE'}"
            by = answer["basis"] + (f", {answer['doubt']}" if answer["doubt"] else "")
            print(f"| {number} | {reference} | {bar} | {share:.1%} | {answer['seconds']:.1f} | {by} |", flush=True)
    print(f"\n{inside} of {len(numbers)} references are inside the bar.")
    for tolerance in tolerances:
        print(f"At {tolerance:.0%}: {answered[tolerance]} of {len(numbers)} are answered, {held[tolerance]} inside the bar.")


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("what", nargs="?", default="claims", choices=("references", "claims"))
    arguments.add_argument("--scenes", type=int, default=40)
    arguments.add_argument("--tolerance", type=float, nargs="+", default=[0.02, 0.05])
    arguments.add_argument("--budget", type=float, default=60.0)
    asked = arguments.parse_args()
    if asked.what == "references":
        references(asked.scenes)
    else:
        claims(asked.scenes, asked.tolerance, asked.budget)


if __name__ == "__main__":
    main()
