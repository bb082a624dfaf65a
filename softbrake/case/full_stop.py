"""Section 2.2 of the paper: the pressure that stops the cargo on the ground."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class FullStop:
    """Pressure that absorbs the cargo's energy over the shell's height, section 2.2."""

    energy: float  # J, m g l1 + m V^2/2
    mean: float  # Pa, P~
    largest: float  # Pa, P_max of (2.10): pi/2 of the mean, wherever the peak stands
    end_time: float  # s, t_k


def full_stop(mass: float, velocity: float, gravity: float, height: float, diameter: float) -> FullStop:
    """Section 2.2 for a piston of the cover's area: P~ = E/(F l1), t_k = V/(P~ F/m - g), which is 2 l1/V with this P~.

    mass: kg; velocity: m/s; gravity: m/s^2; height, diameter of the shell: m.
    """
    energy = mass * (gravity * height + velocity**2 / 2)
    mean = energy / (math.pi * diameter**2 / 4 * height)
    return FullStop(energy, mean, math.pi / 2 * mean, 2 * height / velocity)
