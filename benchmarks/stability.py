"""Tables of docs/validation/stability.md: `python -m benchmarks.stability drops [count] [first]`, `wide`, `maps`, `slack`.

- drops: a thousand random drops with the automatic step; those that diverge, the largest residual and gains of energy;
- wide: the same with nothing left out;
- maps: the predicted step over that found by trial, at 228 points;
- slack: random drops of the tension field that gain energy, over damping and Courant number.

Ranges of the drops are wide but physical: see `random_case`. They were narrowed after failures; left out are

- fabric too soft for its pressure, p R > 0.2 E' with E' that of the hoop without belts: a ring that is inflated at once then
  stretches by half and more, and bursts (the paper's has p R = 0.18 E');
- tensions without a potential, which gain energy where fabric gets slack and taut again whatever the step
  (docs/explanation/stability.md), where viscosity does not take it: with a damping ratio of the shortest wave below 0.3 there are
  tension fields only.
"""

from __future__ import annotations

import sys
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from itertools import count as count_from
from itertools import islice
from math import sqrt
from pathlib import Path

import numpy as np

import softbrake
from softbrake.case.case import Case
from softbrake.case.case_file import load_case, parse_case
from softbrake.sim.build import initial_energy
from softbrake.sim.simulation import Simulation
from softbrake.studies.stability_map import read_axis, survey

SOFTEST = 0.2  # largest p R/E'
LEAKY = 0.3  # least damping ratio of the shortest wave with tensions without a potential
GRIDS = {"axisymmetric": ((12, 60), (24, 60)), "full": ((8, 16), (12, 24))}
TEXT = """
shell: {{diameter: {diameter}, height: {height}}}
fabric:
  {{E: {E}, nu12: {nu}, areal_density: {density}, viscosity: {viscosity}, G12: {shear}, law: {law}}}
belts: {{count: {belts}, layers: {layers}, width: {width}}}
cargo: {{mass: {mass}, velocity: {velocity}}}
pressure: {{law: constant, value: {pressure}}}
contact: {contact}
grid: {{generatrix: {generatrix}, hoop: {hoop}}}
model: {{fidelity: {fidelity}}}
time: {{courant: auto, end: {end}}}
"""
PAPER = Path(__file__).resolve().parents[1] / "configs" / "paper.yaml"
SMALL = ("grid={generatrix: 12, hoop: 24}",)
ROUND = ("model.fidelity=axisymmetric", "contact=paper")
EVEN = ("fabric.nu12=0.1",)
GRIDS_OVER = "grid={generatrix: 8, hoop: 16},{generatrix: 12, hoop: 24},{generatrix: 16, hoop: 48}"
SCHEMES = "model.scheme=edge,cell"
MAPS = (  # what is the same at all points, and the axes
    (SMALL, ("fabric.viscosity=0,0.05,0.2,2", "belts.layers=1,5,20", "fabric.G12=0,2 kN/m,10 kN/m", SCHEMES)),
    ((), (GRIDS_OVER, "pressure.value=2 kPa,8 kPa,15.7 kPa", "fabric.law=true_tension,nominal_tension,tension_field", SCHEMES)),
    (ROUND, ("fabric.viscosity=0,0.1,1,10", GRIDS_OVER, "belts.layers=1,5,20")),
    (SMALL, ("shell.height=0.3,1.5", "fabric.viscosity=0,2", "belts.layers=1,5,20", SCHEMES)),
    (
        (*SMALL, *EVEN),
        ("shell.height=0.15,0.3,0.6,1.2,1.8", "fabric.E11=5 kN/m,10 kN/m,20 kN/m,50 kN/m,100 kN/m,200 kN/m", SCHEMES),
    ),
)
LAWS = ("tension_field", "nominal_tension", "true_tension")
RATIOS, COURANTS = (0.0, 0.003, 0.01, 0.03, 0.1), (0.1, 0.2, 0.35, 0.5, 0.65, 0.8, 0.95)
DROPS, GAIN = 100, 0.01  # drops of each kind, and the gain of the initial energy that counts


def random_case(seed: int, narrow: bool = True) -> Case:
    """A physical case: pressure 1-100 kPa, E 5-500 kN/m, viscosity 0-1 N s/m, belts none to twenty layers, and so on.

    narrow: leave out what the header says.
    """
    random = np.random.default_rng(seed)
    softest, leaky = (SOFTEST, LEAKY) if narrow else (np.inf, 0.0)

    def between(least: float, most: float) -> float:
        return float(np.exp(random.uniform(np.log(least), np.log(most))))

    while True:
        pressure, modulus, diameter, nu = between(1e3, 1e5), between(5e3, 5e5), between(0.3, 1.0), random.uniform(0.0, 0.4)
        if pressure * diameter / 2 <= softest * modulus / (1.0 - nu**2):
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
        "nu": nu,
        "density": density,
        "viscosity": viscosity,
        "shear": float(random.choice([0.0, 0.1 * modulus])),
        "law": random.choice(LAWS) if damping_ratio >= leaky else LAWS[0],
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


def cases_with_potential(fidelity: str, ratio: float, courant: float) -> Iterator[Case]:
    """Random cases of a fidelity, but tension fields, with a damping ratio and courant."""
    for case in map(random_case, count_from()):
        if case.model.fidelity != fidelity:
            continue
        fabric, grid = case.fabric, case.grid
        edge = max(case.shell.height / grid.generatrix, np.pi * case.shell.diameter / grid.hoop)
        viscosity = ratio * edge * sqrt(fabric.E11 * fabric.areal_density)
        fabric = replace(fabric, law="tension_field", viscosity=viscosity)
        yield replace(case, fabric=fabric, time=replace(case.time, courant=courant))


def gains(case: Case) -> bool:
    """Whether fabric and belts give more than GAIN of the initial energy from nowhere."""
    drop = Simulation(case)
    try:
        drop.to_end()
    except softbrake.Diverged:
        return True
    return max(drop.made().values()) > GAIN * initial_energy(drop.case, drop.model)


def slack() -> None:
    """Print how many of DROPS drops gain energy."""
    for fidelity in GRIDS:
        print(f"{fidelity}: courant {COURANTS}, {DROPS} drops each", flush=True)
        for ratio in RATIOS:
            found = [sum(map(gains, islice(cases_with_potential(fidelity, ratio, part), DROPS))) for part in COURANTS]
            print(f"damping ratio {ratio}: {found}", flush=True)


def maps() -> None:
    """Print the range of predicted over found steps of each map."""
    for base, axes in MAPS:
        points = survey(lambda overrides, base=base: load_case(PAPER, [*base, *overrides]), [read_axis(text) for text in axes])
        ratios = [point.ratio for point in points]
        least, most, none = np.nanmin(ratios), np.nanmax(ratios), int(np.isnan(ratios).sum())
        print(f"{' x '.join(axes)}: {len(points)} points, {least:.3f} to {most:.3f}; none found at {none}", flush=True)


def wide(count: int = 150, first: int = 0) -> None:
    """As drops, with nothing left out."""
    drops(count, first, narrow=False)


def drops(count: int = 1000, first: int = 0, narrow: bool = True) -> None:
    """Print outcomes of random drops, the largest residual, and what gained energy."""
    started, steps, outcomes, failures = time.perf_counter(), 0, Counter(), []
    residual, gained = 0.0, {}
    for seed in range(first, first + count):
        drop = Simulation(random_case(seed, narrow))
        try:
            summary = drop.to_end()
            residual = max(residual, abs(summary.energy_error))
            gained[seed] = max(summary.energy_made.values())
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
    leading = sorted((seed for seed in gained if gained[seed] > GAIN), key=gained.get, reverse=True)
    print(f"gained above {GAIN:.0%} of it: " + (", ".join(f"{seed}: {gained[seed]:.1%}" for seed in leading) or "none"))


if __name__ == "__main__":
    task, *given = sys.argv[1:] or ["drops"]
    {"drops": drops, "wide": wide, "maps": maps, "slack": slack}[task](*map(int, given))
