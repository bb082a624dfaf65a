"""A thousand random drops with the automatic step: none may diverge. `python -m benchmarks.stability [count] [first]`.

Ranges are wide but physical: see `random_case`. Left out is fabric too soft for its pressure, p R > 0.2 E' with E' that of the
hoop without belts: a ring that is inflated at once then stretches by half and more, and bursts (the paper's has p R = 0.18 E').
A run may also not burst later; one that does is counted apart, by the message of softbrake, and its case printed.
"""

from __future__ import annotations

import sys
import time
from math import isfinite

import numpy as np

import softbrake
from softbrake.case import Case, parse_case

SOFTEST = 0.2  # largest p R/E'
GRIDS = {"axisymmetric": ((12, 60), (24, 60)), "full": ((8, 16), (12, 24))}
TEXT = """
shell: {{diameter: {diameter}, height: {height}}}
fabric:
  {{E: {E}, nu12: {nu}, nu21: {nu}, areal_density: {density}, viscosity: {viscosity}, G12: {shear}, law: {law}, slack: {slack}}}
belts: {{count: {belts}, layers: {layers}, width: {width}}}
cargo: {{mass: {mass}, velocity: {velocity}}}
pressure: {{law: constant, value: {pressure}}}
contact: {contact}
grid: {{generatrix: {generatrix}, hoop: {hoop}}}
model: {{fidelity: {fidelity}}}
time: {{courant: auto, end: {end}}}
"""


def random_case(seed: int) -> Case:
    """A physical case: pressure 1-100 kPa, E 5-500 kN/m, viscosity 0-1 N s/m, belts none to twenty layers, and so on."""
    random = np.random.default_rng(seed)

    def between(least: float, most: float) -> float:
        return float(np.exp(random.uniform(np.log(least), np.log(most))))

    while True:
        pressure, modulus, diameter, nu = between(1e3, 1e5), between(5e3, 5e5), between(0.3, 1.0), random.uniform(0.0, 0.4)
        if pressure * diameter / 2 <= SOFTEST * modulus / (1.0 - nu**2):
            break
    height, velocity = diameter * between(0.3, 3.0), between(1.0, 20.0)
    fidelity = str(random.choice(["axisymmetric", "full"]))
    generatrix, hoop = GRIDS[fidelity][random.integers(2)]
    belts = int(random.integers(0, 4))
    values = {
        "diameter": diameter,
        "height": height,
        "E": modulus,
        "nu": nu,
        "density": between(0.03, 0.3),
        "viscosity": float(random.choice([0.0, between(0.01, 1.0)])),
        "shear": float(random.choice([0.0, 0.1 * modulus])),
        "law": random.choice(["true_tension", "nominal_tension"]),
        "slack": random.choice(["cut", "wrinkle"]),
        "belts": belts,
        "layers": between(1.0, 20.0),
        "width": 0.5 * height / generatrix * between(1.0, 2.0),
        "mass": between(10.0, 1000.0),
        "velocity": velocity,
        "pressure": pressure,
        "contact": random.choice(["paper", "full"]),
        "generatrix": generatrix,
        "hoop": hoop,
        "fidelity": fidelity,
        "end": 3.0 * height / velocity,
    }
    return parse_case(TEXT.format(**values), f"random case {seed}")


def created(summary: softbrake.Summary) -> float:
    """Energy that the fabric gave beyond what it took, over the initial energy: more than the law's own leak is the scheme's."""
    work = summary.work
    scale = 0.5 * summary.free_fall_velocity**2  # of the cargo, per mass
    return (work.elastic + work.belts + work.viscous) / scale


def main(count: int, first: int) -> None:
    started, steps, outcomes, failures = time.perf_counter(), 0, {}, []
    worst, worst_created = 0.0, 0.0
    for seed in range(first, first + count):
        case = random_case(seed)
        began = time.perf_counter()
        try:
            summary = softbrake.run(case)
        except softbrake.Diverged as error:
            summary = error.summary
            failures.append((seed, str(error)))
        outcome = "burst" if failures and failures[-1][0] == seed and "bursts" in failures[-1][1] else summary.outcome
        outcomes[outcome] = outcomes.get(outcome, 0) + 1
        steps += summary.steps
        if summary.outcome != "diverged":
            residual = summary.energy_error
            worst = max(worst, abs(residual) if isfinite(residual) else np.inf)
            gain = created(summary) / case.cargo.mass
            if gain > worst_created:
                worst_created = gain
                print(f"{seed}: fabric gave {gain:.2e} of the initial energy ({case.fabric.law}, {case.fabric.slack})", flush=True)
        if time.perf_counter() - began > 5.0:
            print(f"{seed}: {time.perf_counter() - began:.1f} s, {summary.steps} steps", flush=True)
    for seed, message in failures:
        print(f"{seed}: {message}")
    print(f"{count} drops, {steps} steps, {time.perf_counter() - started:.0f} s: {outcomes}")
    print(f"largest energy residual {worst:.1e}, largest energy from nowhere {worst_created:.1e} of the initial energy")


if __name__ == "__main__":
    main(*(int(argument) for argument in [*sys.argv[1:], "1000", "0"][:2]) if len(sys.argv) != 2 else (int(sys.argv[1]), 0))
