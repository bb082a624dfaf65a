"""Scenes drawn by chance as an engineer would draw them, by a seed: for the checks of law, grid and error bars.

A scene is a text of a case file: cloth, gas and cargo of airdrops, capsules and drones. All is drawn evenly over the logarithm,
but ratios and velocity. The cargo is so heavy that the gas, held at its pressure over the whole height, would take between half
and all of its energy; a third of the scenes has belts.
"""

from __future__ import annotations

import math

import numpy as np

GRAVITY = 9.80665


def scene(seed: int, damping: float = 0.03) -> str:
    """Return the text of the case file of a seed. damping: of critical damping of the breathing hoop."""
    random = np.random.default_rng(seed)

    def spread(low: float, high: float) -> float:
        return float(math.exp(random.uniform(math.log(low), math.log(high))))

    while True:
        diameter, pressure, modulus = spread(0.3, 2.0), spread(5e3, 60e3), spread(20e3, 300e3)
        if pressure * diameter / 2.0 / modulus < 0.15:
            break
    height = diameter * random.uniform(0.4, 1.5)
    density, velocity, taken = spread(0.05, 0.4), random.uniform(4.0, 9.0), random.uniform(0.5, 1.0)
    gas = pressure * math.pi * diameter**2 / 4.0 * height
    mass = gas / (taken * (GRAVITY * height + velocity**2 / 2.0))
    belts = (
        f"belts: {{count: {random.integers(1, 4)}, layers: 4, width: {0.02 * height:.4g}}}" if random.uniform() < 1 / 3 else ""
    )
    return f"""title: scene {seed}
shell: {{diameter: {diameter:.4g}, height: {height:.4g}}}
fabric: {{E: {modulus:.4g}, nu12: {random.uniform(0.1, 0.35):.3g}, areal_density: {density:.3g}, damping_ratio: {damping:g}}}
{belts}
cargo: {{mass: {mass:.4g}, velocity: {velocity:.3g}}}
pressure: {{law: constant, value: {pressure:.4g}}}
time: {{end: {6.0 * height / velocity:.3g}}}
"""
