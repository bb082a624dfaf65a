"""Exact solutions to test against, each with its derivation. SI units; none of it uses the package."""

from collections.abc import Callable
from itertools import pairwise
from math import cos, pi, sin, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


class Ring(NamedTuple):
    """Ring of a long cylinder, pressure put on it at rest and unloaded at t = 0.

    At stretch λ = r/R, with λ1 = 1, the tension is T22 = E'(λ - 1), E' = E/(1 - ν²), and both it and the pressure act on the
    width of cloth that has the mass ρ per unloaded area. Newton's law for an arc R dθ of unit width, T22 dθ inwards and p r dθ
    outwards:

        ρ R dθ (R λ'') = p R λ dθ - E'(λ - 1) dθ   =>   λ'' = -ω² (λ - λs),   ω² = (E' - pR)/(ρR²),   λs = 1/(1 - pR/E')

    linear, although the stretch is large: λ = λs - (λs - 1) cos ωt. A belt that covers the width adds to E' its force per
    elongation over its width, and to ρ its line density over its width.
    """

    stiffness: float  # N/m, E'
    density: float  # kg/m^2
    radius: float  # m
    pressure: float  # Pa

    @property
    def frequency(self) -> float:
        """Hz."""
        return sqrt((self.stiffness - self.pressure * self.radius) / self.density) / self.radius / (2.0 * pi)

    @property
    def static(self) -> float:
        """Stretch λs, in equilibrium."""
        return 1.0 / (1.0 - self.pressure * self.radius / self.stiffness)

    @property
    def largest(self) -> float:
        """Stretch at half a period."""
        return 2.0 * self.static - 1.0

    def stretch(self, time: Floats) -> Floats:
        """Stretch λ at times from the start."""
        return self.static - (self.static - 1.0) * np.cos(2.0 * pi * self.frequency * time)

    def polygon(self, columns: int) -> "Ring":
        """The ring of `columns` straight edges, its mass in the corners.

        Let s = sin(π/n), c = cos(π/n). A corner at radius r = λR has the mass ρ 2Rs, two edges of length 2rs pull it inwards
        by T22 s each, and the pressure on half of each edge, along the edge's normal, pushes it outwards by p rs c each:

            ρ 2Rs (R λ'') = 2 p λR s c - 2 E'(λ - 1) s

        which is the ring above with p cos(π/n) for p.
        """
        return self._replace(pressure=self.pressure * cos(pi / columns))

    def damped(self, time: Floats, viscosity: float = 0.0, aerodynamic: float = 0.0, substeps: int = 5) -> Floats:
        """Stretch at increasing times from 0, with the viscous tension viscosity λ' (N s/m) and the pressure of (2.11).

        ρR² λ'' = p R λ (1 - νR λ')|1 - νR λ'| - E'(λ - 1) - viscosity λ', by Runge's and Kutta's fourth-order method.
        """

        def rates(state: Floats) -> Floats:
            stretch, rate = state
            factor = 1.0 - aerodynamic * self.radius * rate
            load = self.pressure * self.radius * stretch * factor * abs(factor)
            tension = self.stiffness * (stretch - 1.0) + viscosity * rate
            return np.array([rate, (load - tension) / (self.density * self.radius**2)])

        state = np.array([1.0, 0.0])
        stretches = [1.0]
        for start, end in pairwise(time):
            for _ in range(substeps):
                state = runge_kutta(rates, state, (end - start) / substeps)
            stretches.append(state[0])
        return np.array(stretches)


def free_fall(height: float, velocity: float, gravity: float) -> tuple[float, float]:
    """Velocity (m/s) and time (s) at the ground, thrown down from a height.

    Energy: v² = V² + 2 g H. Uniform acceleration: H = (V + v) t/2.
    """
    impact = sqrt(velocity**2 + 2.0 * gravity * height)
    return impact, 2.0 * height / (velocity + impact)


def piston(height: float, velocity: float, gravity: float, mass: float, area: float, pressure: float) -> float:
    """Velocity (m/s) at the ground of a cargo on a column of gas of constant excess pressure and cross-section.

    The column takes the energy p F H: free fall with g - pF/m.
    """
    return free_fall(height, velocity, gravity - pressure * area / mass)[0]


class StaticCylinder(NamedTuple):
    """Inflated cylinder between two rigid covers at its cutting height."""

    radius: float  # m, at mid-height
    tension_1: float  # N/m, T11 at mid-height
    tension_2: float  # N/m, T22 at mid-height
    pull: float  # N, of the wall on a cover


def static_cylinder(
    stiffness: float, poisson: float, pressure: float, radius: float, height: float, true_tension: bool, steps: int = 200
) -> StaticCylinder:
    """Equilibrium of an axisymmetric isotropic membrane; stiffness is E/(1 - ν²), N/m.

    Let s be the unloaded arc length, ψ the angle of the meridian from the vertical, λ1 = ds*/ds, λ2 = r/R. Forces per unloaded
    width are N1 = T11 λ2, N2 = T22 λ1 for true tensions (2.9), N = T for nominal ones. With the unit vectors
    t = (sin ψ, cos ψ) along the meridian and n = (cos ψ, -sin ψ) outwards, in (r, z), t' = ψ' n and n' = -ψ' t. The forces on
    the unloaded area ds R dθ are N1 t on its lower and upper edge, N2/R towards the axis and p λ1 λ2 along n:

        (N1 t)' - (N2/R) e_r + p λ1 λ2 n = 0

    Along t and n:   N1' = N2 sin ψ/R,   N1 ψ' = N2 cos ψ/R - p λ1 λ2;   and r' = λ1 sin ψ,   z' = λ1 cos ψ.

    Shooting: from mid-height, ψ = 0 and z = 0, with r and λ1 unknown, by Runge's and Kutta's fourth-order method to the cover,
    where r = R and z = H/2; Newton's method on the two unknowns.
    """

    def resultants(force_1: float, r: float) -> tuple[float, float]:
        """λ1 and N2."""
        e2 = r / radius - 1.0
        e1 = force_1 / (stiffness * (r / radius if true_tension else 1.0)) - poisson * e2
        tension_2 = stiffness * (e2 + poisson * e1)
        return 1.0 + e1, tension_2 * (1.0 + e1 if true_tension else 1.0)

    def rates(state: Floats) -> Floats:
        r, _, angle, force_1 = state
        stretch_1, force_2 = resultants(force_1, r)
        turn = (force_2 * cos(angle) / radius - pressure * stretch_1 * r / radius) / force_1
        return np.array([stretch_1 * sin(angle), stretch_1 * cos(angle), turn, force_2 * sin(angle) / radius])

    def tension_1(unknown: Floats) -> float:
        return stiffness * (unknown[1] - 1.0 + poisson * (unknown[0] / radius - 1.0))

    def shoot(unknown: Floats) -> Floats:
        wide = unknown[0] / radius if true_tension else 1.0
        state = np.array([unknown[0], 0.0, 0.0, tension_1(unknown) * wide])
        for _ in range(steps):
            state = runge_kutta(rates, state, 0.5 * height / steps)
        return state

    def miss(unknown: Floats) -> Floats:
        return shoot(unknown)[:2] - np.array([radius, 0.5 * height])

    unknown = np.array([1.2 * radius, 1.02])  # m, -
    missed = miss(unknown)
    while np.abs(missed).max() > 1e-11 * height:
        slope = np.stack([(miss(unknown + shift) - missed) / 1e-7 for shift in 1e-7 * np.eye(2)], axis=1)
        change = np.linalg.solve(slope, -missed)
        while not np.hypot(*miss(unknown + change)) < np.hypot(*missed):
            change *= 0.5
            if np.abs(change).max() < 1e-14:
                raise ArithmeticError("the shooting does not converge")
        unknown = unknown + change
        missed = miss(unknown)
    end = shoot(unknown)
    force_1 = tension_1(unknown) * (unknown[0] / radius if true_tension else 1.0)
    stretch_1, force_2 = resultants(force_1, unknown[0])
    tension_2 = force_2 / (stretch_1 if true_tension else 1.0)
    return StaticCylinder(unknown[0], tension_1(unknown), tension_2, 2.0 * pi * radius * end[3] * cos(end[2]))


def runge_kutta(rates: Callable[[Floats], Floats], state: Floats, step: float) -> Floats:
    """One step of the classical fourth-order method."""
    a = rates(state)
    b = rates(state + 0.5 * step * a)
    c = rates(state + 0.5 * step * b)
    d = rates(state + step * c)
    return state + step / 6.0 * (a + 2.0 * b + 2.0 * c + d)
