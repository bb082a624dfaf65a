"""Whether error bars are true: engineer's scenes drawn by chance, answered for a tolerance, beside finer full shells.

    python -m benchmarks.claims references [--scenes 40]      hours of CPU; kept in claims.json, scene by scene
    python -m benchmarks.claims [--scenes 40] [--tolerance 2%] [--budget 60]

A reference is two full shells with folds, cells an eighteenth of the radius long, disturbed by 1e-3 and 1e-5 of the radius with
random numbers of their own. A claim holds where each is within its bar, a bar of its own mean where the two differ.
"""

from __future__ import annotations

import argparse
import json
import math
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

from benchmarks.scenes import scene
from softbrake.case import Case, parse_case
from softbrake.drop import Diverged, Drop, cores
from softbrake.ladder import level, speed_of
from softbrake.state import History, Outcome

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
        falling, out, outcome = Drop(level(case, "full", n1, n2)), 0.0, Outcome.RUNNING
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
                "crossings": answer.crossings,
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


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("what", nargs="?", default="claims", choices=("references", "claims"))
    arguments.add_argument("--scenes", type=int, default=40)
    asked = arguments.parse_args()
    if asked.what == "references":
        references(asked.scenes)


if __name__ == "__main__":
    main()
