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


class Membrane(NamedTuple):
    """Axisymmetric membrane with the law (2.9), cut as a cylinder, under constant pressure. Taut everywhere: no cut at zero.

    Let s be the unloaded arc length, ψ the angle of the meridian from the vertical, λ1 = ds*/ds, λ2 = r/R. Forces per unloaded
    width are N1 = T11 λ2, N2 = T22 λ1 for true tensions (2.9), N = T for nominal ones. With the unit vectors
    t = (sin ψ, cos ψ) along the meridian and n = (cos ψ, -sin ψ) outwards, in (r, z), t' = ψ' n and n' = -ψ' t. The forces on
    the unloaded area ds R dθ are N1 t on its lower and upper edge, N2/R towards the axis and p λ1 λ2 along n:

        (N1 t)' - (N2/R) e_r + p λ1 λ2 n = 0

    Along t and n:   N1' = N2 sin ψ/R,   N1 ψ' = N2 cos ψ/R - p λ1 λ2;   and r' = λ1 sin ψ,   z' = λ1 cos ψ.
    """

    c11: float  # N/m, E11/(1 - ν12 ν21)
    c22: float  # N/m, E22/(1 - ν12 ν21)
    c12: float  # N/m, of e2 in T11 and of e1 in T22
    pressure: float  # Pa
    radius: float  # m, R
    true_tension: bool

    def force_1(self, r: float, stretch_1: float) -> float:
        """N1 (N/m)."""
        tension_1 = self.c11 * (stretch_1 - 1.0) + self.c12 * (r / self.radius - 1.0)
        return tension_1 * (r / self.radius if self.true_tension else 1.0)

    def resultants(self, force_1: float, r: float) -> tuple[float, float]:
        """λ1 and N2 (N/m)."""
        e2 = r / self.radius - 1.0
        e1 = (force_1 / (r / self.radius if self.true_tension else 1.0) - self.c12 * e2) / self.c11
        tension_2 = self.c22 * e2 + self.c12 * e1
        return 1.0 + e1, tension_2 * (1.0 + e1 if self.true_tension else 1.0)

    def free(self, state: Floats) -> Floats:
        """Derivatives of (r, z, ψ, N1) by s."""
        r, _, angle, force_1 = state
        stretch_1, force_2 = self.resultants(force_1, r)
        turn = (force_2 * cos(angle) / self.radius - self.pressure * stretch_1 * r / self.radius) / force_1
        return np.array([stretch_1 * sin(angle), stretch_1 * cos(angle), turn, force_2 * sin(angle) / self.radius])

    def lying(self, state: Floats) -> Floats:
        """The same where a smooth horizontal plane below takes up the pressure: ψ stays π/2."""
        r, _, _, force_1 = state
        stretch_1, force_2 = self.resultants(force_1, r)
        return np.array([stretch_1, 0.0, 0.0, force_2 / self.radius])


def static_cylinder(
    stiffness: float, poisson: float, pressure: float, radius: float, height: float, true_tension: bool, steps: int = 200
) -> StaticCylinder:
    """Equilibrium between the covers; stiffness is E/(1 - ν²), N/m.

    Shooting: from mid-height, ψ = 0 and z = 0, with r and λ1 unknown, by Runge's and Kutta's fourth-order method to the cover,
    where r = R and z = H/2; Newton's method on the two unknowns.
    """
    membrane = Membrane(stiffness, stiffness, poisson * stiffness, pressure, radius, true_tension)

    def shoot(unknown: Floats) -> Floats:
        start = np.array([unknown[0], 0.0, 0.0, membrane.force_1(*unknown)])
        return step(membrane.free, start, 0.5 * height, steps)[-1]

    unknown = newton(lambda unknown: shoot(unknown)[:2] - np.array([radius, 0.5 * height]), np.array([1.2 * radius, 1.02]))
    end = shoot(unknown)
    wide = unknown[0] / radius if true_tension else 1.0
    force_1 = membrane.force_1(*unknown)
    stretch_1, force_2 = membrane.resultants(force_1, unknown[0])
    tension_2 = force_2 / (stretch_1 if true_tension else 1.0)
    return StaticCylinder(unknown[0], force_1 / wide, tension_2, 2.0 * pi * radius * end[3] * cos(end[2]))


class Pressed(NamedTuple):
    """Inflated shell between the ground and a wide plate."""

    contact: float  # m, radius to which the wall lies on either
    force: float  # N, on either: the pressure on all that lies there, since the wall leaves it level
    meridian: Floats  # unloaded arc length from the lower cover (m), r (m) and T11 (N/m), up to mid-height; (k, 3)


def pressed_shell(membrane: Membrane, length: float, height: float, steps: int = 200) -> Pressed:
    """Shell of unloaded length between the ground and a wide smooth plate, which holds the upper cover, at a height (m).

    From the rim of the lower cover, r = R with an unknown λ1, flat on the ground for an unknown length, then free, the angle
    going on from π/2; by symmetry ψ = 0 and z = H/2 at half the length. Shooting as for static_cylinder.
    """

    def shoot(unknown: Floats) -> tuple[Floats, Floats]:
        stretch_1, flat = unknown
        rim = np.array([membrane.radius, 0.0, 0.5 * pi, membrane.force_1(membrane.radius, stretch_1)])
        lying = step(membrane.lying, rim, flat, steps)
        return lying, step(membrane.free, lying[-1], 0.5 * length - flat, steps)

    def miss(unknown: Floats) -> Floats:
        _, z, angle, _ = shoot(unknown)[1][-1]
        return np.array([angle, z - 0.5 * height])

    unknown = newton(miss, np.array([1.1, 0.15 * length]))
    lying, free = shoot(unknown)
    if not (unknown[1] > 0.0 and lying[0, 3] > 0.0):
        raise ArithmeticError("the wall does not lie on the ground, or is slack")
    flat, parts = unknown[1], np.linspace(0.0, 1.0, steps + 1)
    lengths = np.concatenate([flat * parts, flat + (0.5 * length - flat) * parts[1:]])
    r, _, _, force_1 = np.concatenate([lying, free[1:]]).T
    tension_1 = force_1 / (r / membrane.radius if membrane.true_tension else 1.0)
    contact = lying[-1, 0]
    return Pressed(contact, membrane.pressure * pi * contact**2, np.column_stack([lengths, r, tension_1]))


class Stadium(NamedTuple):
    """Long smooth cylinder lying between two plates, per metre of its length."""

    width: float  # m, in contact with either plate
    force: float  # N/m, on either plate
    tension: float  # N/m, T22
    area: float  # m^2, of the cross-section


def stadium(stiffness: float, pressure: float, radius: float, gap: float) -> Stadium:
    """Tube of unloaded radius R at a gap h, λ1 = 1; stiffness E/(1 - ν²), N/m, inf for an inextensible one.

    Free arcs carry T = p times their radius, which the straight contacts, level and smooth, make h/2; T is the same all around,
    so λ2 = 1 + T/E'. Two half-circles and two straight lines b: πh + 2b = 2πR λ2. The gas acts through the cloth: force p b.
    """
    tension = 0.5 * pressure * gap
    width = pi * (radius * (1.0 + tension / stiffness) - 0.5 * gap)
    return Stadium(width, pressure * width, tension, width * gap + 0.25 * pi * gap**2)


def newton(miss: Callable[[Floats], Floats], unknown: Floats) -> Floats:
    """Zero of miss by Newton's method with slopes from differences, its step halved until it leads nearer."""
    missed = miss(unknown)
    while np.abs(missed).max() > 1e-11:
        slope = np.stack([(miss(unknown + shift) - missed) / 1e-7 for shift in 1e-7 * np.eye(len(unknown))], axis=1)
        change = np.linalg.solve(slope, -missed)
        while not np.linalg.norm(miss(unknown + change)) < np.linalg.norm(missed):
            change *= 0.5
            if np.abs(change).max() < 1e-14:
                raise ArithmeticError("the shooting does not converge")
        unknown = unknown + change
        missed = miss(unknown)
    return unknown


def step(rates: Callable[[Floats], Floats], state: Floats, length: float, steps: int) -> Floats:
    """States at the ends of equal steps over a length, (steps + 1, len(state))."""
    states = [state]
    for _ in range(steps):
        states.append(runge_kutta(rates, states[-1], length / steps))
    return np.array(states)


def runge_kutta(rates: Callable[[Floats], Floats], state: Floats, step: float) -> Floats:
    """One step of the classical fourth-order method."""
    a = rates(state)
    b = rates(state + 0.5 * step * a)
    c = rates(state + 0.5 * step * b)
    d = rates(state + step * c)
    return state + step / 6.0 * (a + 2.0 * b + 2.0 * c + d)
