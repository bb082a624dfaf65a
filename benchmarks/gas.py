"""Random drops on gas with a state: `python -m benchmarks.gas [count] [first]`, some minutes for the 500.

Prints outcomes, the largest residuals of energy and mass, and what gained energy; ends with 1 where a drop diverged, came to no
end, or gained more than GAIN of its energy. Ranges are wide, see `random_case`: bags that hardly brake, bags that are crushed
flat, vents as wide as the cover, the air of Mars. Fabric is no softer than SOFTEST at the pressure of the bag as it hangs; one
that its gas then presses beyond what fabric can hold bursts, which is counted apart.
"""

from __future__ import annotations

import sys
import time
from collections import Counter
from typing import Any

import numpy as np

import softbrake
from softbrake.case.case import Case
from softbrake.case.case_file import load_case
from softbrake.core.arrays import GasState, Outcome
from softbrake.sim.simulation import Simulation

SOFTEST = 0.2  # largest p R/E' as it hangs
GAIN = 0.01  # of the initial energy, that counts
ENDLESS = 600_000  # steps, ten times what the longest of these drops take
GRIDS = {"lumped": ((12, 60),), "axisymmetric": ((12, 60), (24, 60)), "full": ((8, 16), (12, 24))}
GASES = ("air", "nitrogen", "carbon_dioxide", "helium")


class _Chance:
    """Draws of a seed."""

    def __init__(self, seed: int) -> None:
        self.random = np.random.default_rng(seed)

    def between(self, least: float, most: float) -> float:
        """Evenly over the logarithm."""
        return float(np.exp(self.random.uniform(np.log(least), np.log(most))))

    def one_of(self, choices: Any) -> Any:
        """One of several."""
        return choices[self.random.integers(len(choices))]

    def some(self, part: float) -> bool:
        """True in a part of the draws."""
        return bool(self.random.uniform() < part)


def _vent(chance: _Chance, cover: float, pressure: float, height: float, span: float) -> dict[str, Any]:
    """A vent of up to the cover's area (m^2); height: of the shell, m; span: s, in which it would be passed."""
    table = {"pressure_ratio": [0.5, 1.0], "coefficient": [chance.between(0.5, 1.0), chance.between(0.3, 0.9)]}
    opening, closing = chance.one_of(("always", "pressure", "time", "height")), chance.one_of(("", "", "pressure", "height"))
    opens: dict[str, float] = {}
    if opening == "pressure":
        opens = {opening: pressure * chance.between(0.3, 10.0)}
    elif opening == "time":
        opens = {opening: span * chance.random.uniform()}
    elif opening == "height":
        opens = {opening: height * chance.random.uniform(0.3, 1.0)}
    closes: dict[str, float] = {}
    if closing == "pressure":
        closes = {closing: 0.9 * chance.random.uniform() * opens.get(closing, pressure)}
    elif closing == "height":
        closes = {closing: 0.9 * chance.random.uniform(0.1, 1.0) * opens.get(closing, height)}
    return {
        "area": cover * min(chance.between(1e-3, 1.2), 1.0),
        "discharge": table if chance.some(0.3) else chance.between(0.4, 1.0),
        "opens": opens or "always",
        "closes": closes or "never",
        "inflow": chance.one_of(("none", "allowed")),
    }


def random_case(seed: int) -> Case:
    """A bag of 0.5 to 100 kPa between 600 Pa and 1 bar, with vents, leaks, inflators and a cargo that may crush it."""
    chance = _Chance(seed)
    while True:
        pressure, modulus, diameter = chance.between(500.0, 1e5), chance.between(1e4, 1e6), chance.between(0.3, 2.0)
        if 0.5 * pressure * diameter <= SOFTEST * modulus:
            break
    height, velocity, cover = diameter * chance.between(0.3, 2.0), chance.between(1.0, 20.0), 0.25 * np.pi * diameter**2
    ambient, span = chance.between(600.0, 1e5), height / velocity
    fidelity = chance.one_of(("lumped", "axisymmetric", "full"))
    generatrix, hoop = chance.one_of(GRIDS[fidelity])
    gas = {"pressure": pressure, "name": chance.one_of(GASES), "temperature": chance.random.uniform(200.0, 350.0)}
    stored = (ambient + pressure) * cover * height  # J
    case: dict[str, Any] = {
        "shell": {"diameter": diameter, "height": height},
        "fabric": {
            "E": modulus,
            "nu12": chance.random.uniform(0.0, 0.4),
            "areal_density": chance.between(0.03, 0.3),
            "damping_ratio": chance.one_of((0.0, chance.between(0.003, 0.3))),
        },
        "cargo": {"mass": max(stored * chance.between(0.03, 10.0) / velocity**2, 1.0), "velocity": velocity},
        "gas": gas,
        "ambient": {"pressure": ambient, "temperature": chance.random.uniform(200.0, 320.0)},
        "contact": chance.one_of(("solid", "full")),
        "model": {"fidelity": fidelity},
        "grid": {"generatrix": generatrix, "hoop": hoop},
        "time": {"end": 8.0 * span, "after": chance.one_of(("stop", "rebound", "rebound"))},
    }
    vents = int(chance.one_of((0, 1, 1, 2)))
    if vents:
        case["vents"] = [_vent(chance, cover, pressure, height, span) for _ in range(vents)]
    wall = chance.one_of(("tight", "tight", "leakage", "parabola", "ergun"))
    if wall == "leakage":
        case["leakage"] = chance.between(1e-4, 0.1)
    elif wall == "parabola":
        case["permeability"] = {"linear": chance.between(1e-6, 1e-4), "quadratic": -chance.one_of((0.0, 1e-10))}
    elif wall == "ergun":
        case["permeability"] = {"viscous": chance.between(1e4, 1e6), "inertial": chance.between(1e2, 1e5)}
    if chance.some(0.2):
        filled = (ambient + pressure) * cover * height / (287.0 * gas["temperature"])
        flow = filled / span * chance.between(0.05, 2.0)
        case["inflator"] = {
            "times": [0.0, 0.1 * span, 0.5 * span, 0.6 * span],
            "mass_flow": [0.0, flow, flow, 0.0],
            "temperature": chance.random.uniform(250.0, 800.0),
        }
    if not vents and wall == "tight" and "inflator" not in case:
        gas["process"] = chance.one_of(("adiabatic", "isothermal", "polytropic"))
        if gas["process"] == "polytropic":
            gas["exponent"] = chance.random.uniform(1.0, 1.6)
    return load_case(case)


class Found:
    """What drops of seeds did."""

    def __init__(self) -> None:
        self.outcomes: Counter[str] = Counter()
        self.failures: list[str] = []  # messages of what diverged or came to no end
        self.energy = self.mass = 0.0  # largest residuals, of the initial energy and of the mass there was in all
        self.made: dict[int, float] = {}  # by seed, of the initial energy
        self.steps = 0

    def drop(self, seed: int) -> None:
        """Run a drop to its end."""
        case = random_case(seed)
        try:
            drop = Simulation(case)
        except softbrake.NotInflated:
            self.outcomes["not inflated"] += 1
            return
        begun, ended = float(drop.state.gas[GasState.MASS]), Outcome.RUNNING
        while ended == Outcome.RUNNING and drop.state.steps[0] < ENDLESS:
            _, ended = drop.advance(most=drop.most)
        if ended == Outcome.RUNNING:
            self.outcomes["endless"] += 1
            self.failures.append(f"{seed}, {case.model.fidelity}: not at its end after {drop.state.steps[0]} steps")
            return
        try:
            summary = drop.finish(ended)
            outcome: str = summary.outcome
        except softbrake.Diverged as error:
            summary = error.summary
            outcome = "burst" if "bursts" in str(error) else "diverged"
            self.failures.append(f"{seed}, {case.model.fidelity}: {error}")
        chamber = drop.state.gas
        supplied = begun + float(chamber[GasState.FILLED])
        self.outcomes[outcome] += 1
        self.steps += summary.steps
        if outcome not in ("burst", "diverged"):
            self.energy = max(self.energy, abs(summary.energy_error))
            self.mass = max(self.mass, abs(supplied - float(chamber[GasState.VENTED] + chamber[GasState.MASS])) / supplied)
            self.made[seed] = max(summary.energy_made.values())

    @property
    def gained(self) -> list[int]:
        """Seeds of drops that gained more than GAIN, the most first."""
        return sorted((seed for seed in self.made if self.made[seed] > GAIN), key=lambda seed: -self.made[seed])


def main(count: int = 500, first: int = 0) -> int:
    """Print what so many drops did. Returns the exit code."""
    started, found = time.perf_counter(), Found()
    for seed in range(first, first + count):
        found.drop(seed)
        if (seed - first + 1) % 50 == 0:
            print(f"{seed - first + 1} drops: {dict(found.outcomes)}", file=sys.stderr, flush=True)
    print("".join(f"{failure}\n" for failure in found.failures), end="")
    print(f"{count} drops, {found.steps} steps, {time.perf_counter() - started:.0f} s: {dict(found.outcomes)}")
    print(f"largest residual of the energy {found.energy:.1e}, of the mass {found.mass:.1e}")
    gains = ", ".join(f"{seed}: {found.made[seed]:.1%}" for seed in found.gained) or "none"
    print(f"largest gain {max(found.made.values(), default=0.0):.2%} of the initial energy; above {GAIN:.0%} of it: {gains}")
    return int(found.outcomes["diverged"] + found.outcomes["endless"] > 0 or bool(found.gained))


if __name__ == "__main__":
    sys.exit(main(*map(int, sys.argv[1:])))
