"""A thousand random drops with the automatic step: none may diverge. `python -m benchmarks.stability [count] [first]`.

Ranges are wide but physical: see `random_case`. Left out are

- fabric too soft for its pressure, p R > 0.2 E' with E' that of the hoop without belts: a ring that is inflated at once then
  stretches by half and more, and bursts (the paper's has p R = 0.18 E');
- tensions without a potential, which gain energy where fabric gets slack and taut again whatever the step (docs/stability.md),
  where viscosity does not take it: with a damping ratio of the shortest wave below 0.03 tensions are nominal and nu = 0, and
  below 0.3 none is cut at zero (fabric.slack: cut) but these;
- folds on the full shell: its contact is `paper` or `solid`, that of the axisymmetric one `paper` or `full`.
"""

from __future__ import annotations

import sys
import time
from collections import Counter

import numpy as np

import softbrake
from softbrake.build import initial_energy
from softbrake.case import Case, parse_case
from softbrake.drop import Drop

SOFTEST = 0.2  # largest p R/E'
CUT, LEAKY = 0.3, 0.03  # least damping ratios of the shortest wave: tensions cut at zero, those without a potential at all
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
    belts, density = int(random.integers(0, 4)), between(0.03, 0.3)
    viscosity = float(random.choice([0.0, between(0.01, 1.0)]))
    edge = max(height / generatrix, np.pi * diameter / hoop)
    damping_ratio = viscosity / (edge * np.sqrt(modulus * density / (1.0 - nu**2)))
    values = {
        "diameter": diameter,
        "height": height,
        "E": modulus,
        "nu": nu if damping_ratio >= LEAKY else 0.0,
        "density": density,
        "viscosity": viscosity,
        "shear": float(random.choice([0.0, 0.1 * modulus])),
        "law": random.choice(["true_tension", "nominal_tension"]) if damping_ratio >= LEAKY else "nominal_tension",
        "slack": random.choice(["cut", "wrinkle"]) if damping_ratio >= CUT or damping_ratio < LEAKY else "wrinkle",
        "belts": belts,
        "layers": between(1.0, 20.0),
        "width": 0.5 * height / generatrix * between(1.0, 2.0),
        "mass": between(10.0, 1000.0),
        "velocity": velocity,
        "pressure": pressure,
        "contact": random.choice(["paper", "full" if fidelity == "axisymmetric" else "solid"]),
        "generatrix": generatrix,
        "hoop": hoop,
        "fidelity": fidelity,
        "end": 3.0 * height / velocity,
    }
    return parse_case(TEXT.format(**values), f"random case {seed}")


def main(count: int, first: int) -> None:
    started, steps, outcomes, failures = time.perf_counter(), 0, Counter(), []
    residual, gain, where = 0.0, -np.inf, -1
    for seed in range(first, first + count):
        drop = Drop(random_case(seed))
        try:
            summary = drop.run()
            residual = max(residual, abs(summary.energy_error))
            gained = drop.fabric_gain() / initial_energy(drop.case, drop.model)
            gain, where = max((gain, where), (gained, seed))
            outcome = summary.outcome
        except softbrake.Diverged as error:
            summary = error.summary
            outcome = "burst" if "bursts" in str(error) else "diverged"
            failures.append(f"{seed}: {error}")
        outcomes[outcome] += 1
        steps += summary.steps
        if (seed - first + 1) % 50 == 0:
            print(f"{seed - first + 1} drops: {dict(outcomes)}", file=sys.stderr, flush=True)
    print("\n".join(failures))
    print(f"{count} drops, {steps} steps, {time.perf_counter() - started:.0f} s: {dict(outcomes)}")
    print(f"largest energy residual {residual:.1e} of the initial energy")
    print(f"largest gain from fabric and belts {gain:.1e} of it, in case {where} (below 0: they took energy)")


if __name__ == "__main__":
    given = [int(argument) for argument in sys.argv[1:3]]
    main(*(given + [1000, 0][len(given) :]))
