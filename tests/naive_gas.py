"""Slow twin of a piston on gas: mass and internal energy of the gas as state, by SciPy's integrator, events located on their own.

P V = m R T, U = m cv T, dU = -P dV + sum of h dm with h = cp T upstream (Moran and Shapiro, ch. 4); isentropic nozzle (ch. 9).
None of it uses the package.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from math import inf, pi, sqrt

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

Floats = NDArray[np.float64]
HEIGHT, VELOCITY, MASS, ENERGY, VENTED = range(5)  # of the state


def critical_ratio(gamma: float) -> float:
    """Pressure outside over that inside at which the flow is that of sound."""
    return (2.0 / (gamma + 1.0)) ** (gamma / (gamma - 1.0))


def mass_flux(pressure: float, temperature: float, outside: float, gamma: float, constant: float) -> float:
    """Through an ideal nozzle, kg/(m^2 s)."""
    r = max(outside / pressure, critical_ratio(gamma))
    bracket = 2.0 * gamma / (gamma - 1.0) * (r ** (2.0 / gamma) - r ** ((gamma + 1.0) / gamma))
    return pressure / sqrt(constant * temperature) * sqrt(max(bracket, 0.0))


@dataclass
class Orifice:
    """Vent, gauge thresholds (Pa), a time (s), heights (m); coefficient over the pressure ratio."""

    area: float
    coefficient: Callable[[float], float]
    opens_pressure: float = inf
    opens_time: float = inf
    opens_height: float = -inf
    closes_pressure: float = -inf
    closes_height: float = -inf
    inflow: bool = False
    open: bool = field(init=False)
    shut: bool = field(init=False, default=False)
    times: list[tuple[float, bool]] = field(init=False, default_factory=list)  # s; whether it opened

    def __post_init__(self) -> None:
        self.open = self.opens_pressure == inf and self.opens_time == inf and self.opens_height == -inf

    def switch(self, time: float, shut: bool) -> None:
        self.open = not self.open
        self.shut = shut
        self.times.append((time, self.open))


@dataclass
class Piston:
    """Cargo on a rigid cylinder of gas."""

    diameter: float
    height: float
    mass: float
    velocity: float
    pressure: float  # Pa, gauge
    gravity: float = 9.80665
    gamma: float = 1.4
    constant: float = 287.05287
    ambient: float = 101325.0
    temperature: float = 288.15
    orifices: tuple[Orifice, ...] = ()
    leakage: float = 0.0  # of the wall below the cover
    darcy: float = 0.0  # m/(s Pa)
    inflow: tuple[tuple[float, ...], tuple[float, ...], float] = ((0.0, 1.0), (0.0, 0.0), 300.0)  # s, kg/s, K
    suction: bool = False  # whether the wall holds a pressure below ambient's
    rigid: bool = False  # whether the cargo stays where it is

    @property
    def area(self) -> float:
        return 0.25 * pi * self.diameter**2

    def inside(self, state: Floats) -> tuple[float, float, float]:
        """Pressure (Pa) that the vents see, that on the cargo, and temperature (K).

        A limp wall has gas of ambient pressure; an open vent draws as if the wall were stiff, which only it would do.
        """
        volume, inner = self.area * state[HEIGHT], (self.gamma - 1.0) * state[ENERGY]
        temperature = inner / (state[MASS] * self.constant)
        if self.suction or inner >= self.ambient * volume:
            return inner / volume, inner / volume, temperature
        return self.ambient * (max(inner, 0.0) / (self.ambient * volume)) ** self.gamma, self.ambient, temperature

    def rates(self, time: float, state: Floats) -> Floats:
        """Of the state."""
        seen, pressure, temperature = self.inside(state)
        cp, out, drawn = self.gamma / (self.gamma - 1.0) * self.constant, 0.0, 0.0
        area = self.leakage * pi * self.diameter * state[HEIGHT]
        if seen > self.ambient:
            area += sum(one.area * one.coefficient(self.ambient / seen) for one in self.orifices if one.open)
            out = area * mass_flux(seen, temperature, self.ambient, self.gamma, self.constant)
            through = self.darcy * (seen - self.ambient) * pi * self.diameter * state[HEIGHT]
            out += through * seen / (self.constant * temperature)
        elif seen < self.ambient:
            area = sum(one.area * one.coefficient(seen / self.ambient) for one in self.orifices if one.open and one.inflow)
            drawn = area * mass_flux(self.ambient, self.temperature, seen, self.gamma, self.constant)
        fed = float(np.interp(time, self.inflow[0], self.inflow[1], 0.0, 0.0))
        heat = cp * (fed * self.inflow[2] + drawn * self.temperature - out * temperature)
        acceleration = (pressure - self.ambient) * self.area / self.mass - self.gravity
        velocity = 0.0 if self.rigid else state[VELOCITY]
        energy = heat - pressure * self.area * velocity if pressure == seen else heat / self.gamma
        return np.array([velocity, 0.0 if self.rigid else acceleration, fed + drawn - out, energy, out])

    def start(self) -> Floats:
        """State at first contact; below ambient pressure the wall hangs slack."""
        absolute, volume = self.ambient + self.pressure, self.area * self.height
        mass = absolute * volume / (self.constant * self.temperature)
        return np.array([self.height, -self.velocity, mass, absolute * volume / (self.gamma - 1.0), 0.0])

    def _events(self) -> list[tuple[Callable[[float, Floats], float], Callable[[float], None]]]:
        """What switches a vent: a function that rises through 0 then, and what it does."""
        found = []
        for one in self.orifices:
            if one.shut:
                continue

            def gauge(state: Floats) -> float:
                return self.inside(state)[0] - self.ambient

            if one.closes_height > -inf:
                found.append((lambda _, s, o=one: o.closes_height - s[HEIGHT], lambda t, o=one: _shut(o, t)))
            if one.open and one.closes_pressure > -inf:
                again = one.opens_pressure < inf
                found.append((lambda _, s, o=one: o.closes_pressure - gauge(s), lambda t, o=one, a=again: o.switch(t, not a)))
            if not one.open and one.opens_pressure < inf:
                found.append((lambda _, s, o=one: gauge(s) - o.opens_pressure, lambda t, o=one: o.switch(t, False)))
            if not one.open and one.opens_height > -inf:
                found.append((lambda _, s, o=one: o.opens_height - s[HEIGHT], lambda t, o=one: o.switch(t, False)))
        return found

    def fall(self, end: float, least: float = 0.0) -> "Course":
        """Follow the cargo up to a time (s), or down to a height (m)."""
        state, time, parts = self.start(), 0.0, []
        stops = sorted({*(one.opens_time for one in self.orifices), *self.inflow[0], end})
        while time < end:
            events = self._events()
            functions = [lambda _, s: least - s[HEIGHT], *(event for event, _ in events)]
            for function in functions:
                function.terminal, function.direction = True, 1.0  # type: ignore[attr-defined]
            until = min(stop for stop in stops if stop > time)
            part = solve_ivp(
                self.rates,
                (time, min(until, end)),
                state,
                method="DOP853",
                events=functions,
                dense_output=True,
                rtol=1e-11,
                atol=1e-13,
                max_step=2e-3,
            )
            parts.append(part)
            time, state = float(part.t[-1]), part.y[:, -1]
            if part.t_events[0].size:
                break
            for (_, act), times in zip(events, part.t_events[1:], strict=True):
                if times.size:
                    act(time)
            for one in self.orifices:
                if one.opens_time == time:
                    one.switch(time, False)
        return Course(self, parts)


def _shut(one: Orifice, time: float) -> None:
    if one.open:
        one.switch(time, True)
    one.shut = True


class Course:
    """The motion, by dense output."""

    def __init__(self, piston: Piston, parts: list) -> None:
        self.piston, self.parts = piston, parts
        self.end = float(parts[-1].t[-1])

    def at(self, time: float) -> Floats:
        """State at a time (s)."""
        part = next(part for part in self.parts if time <= part.t[-1])
        return part.sol(time)

    def samples(self, per_part: int = 4000) -> tuple[Floats, Floats]:
        """Times (s) and states, (5, k)."""
        times = [np.linspace(part.t[0], part.t[-1], per_part) for part in self.parts]
        return np.concatenate(times), np.concatenate([part.sol(t) for part, t in zip(self.parts, times, strict=True)], axis=1)

    def peak(self) -> tuple[float, float, float]:
        """Largest absolute pressure (Pa), its time (s), and largest temperature (K)."""
        times, states = self.samples()
        found = np.array([self.piston.inside(state)[1:] for state in states.T])
        highest = int(found[:, 0].argmax())
        return float(found[highest, 0]), float(times[highest]), float(found[:, 1].max())

    def passes(self, height: float) -> tuple[float, float]:
        """Time (s) and velocity (m/s) at which it last falls through a height (m)."""
        times, states = self.samples()
        above = states[HEIGHT] > height
        k = int(np.flatnonzero(above[:-1] & ~above[1:])[-1])
        low, high = times[k], times[k + 1]
        for _ in range(60):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if self.at(middle)[HEIGHT] > height else (low, middle)
        return high, float(self.at(high)[VELOCITY])
