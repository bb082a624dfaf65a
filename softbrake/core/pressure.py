"""Excess pressure: of a gas with a state, or in time by Eq. (2.10); its damping by the moving fabric, Eq. (2.11)."""

from math import cos, pi, sin, sqrt

from numba import uint64

from softbrake.core.arrays import PressureLaw
from softbrake.core.columns import History
from softbrake.core.gas import advance_gas
from softbrake.core.jit import kernel
from softbrake.core.lanes import FIRST
from softbrake.core.tables import integral_of_table

SMALLEST_AREA = 1e-60  # m^2


@kernel
def pressure_at(pressure, time):
    """Return p~ (Pa) at a time (s): constant, Eq. (2.10), or a table, linear between its rows and level outside."""
    if pressure.law == PressureLaw.CONSTANT:
        return pressure.value
    if pressure.law == PressureLaw.SINE:
        if time <= pressure.peak_time:
            return pressure.value * sin(0.5 * pi * time / pressure.peak_time)
        if time < pressure.end_time:
            return pressure.value * cos(0.5 * pi * (time - pressure.peak_time) / (pressure.end_time - pressure.peak_time))
        return 0.0
    times = pressure.times
    values = pressure.values
    if time <= times[0]:
        return values[0]
    for k in range(1, times.size):
        if time < times[k]:
            share = (time - times[k - 1]) / (times[k] - times[k - 1])
            return values[k - 1] + share * (values[k] - values[k - 1])
    return values[-1]


@kernel
def mean_of_table(pressure, start, end):
    """Return the mean of a table over a time (s), exact: no pulse is lost or doubled, however short beside a step."""
    times, values = pressure.times, pressure.values
    last = times.size - 1
    outside = values[0] * max(min(end, times[0]) - start, 0.0) + values[last] * max(end - max(start, times[last]), 0.0)
    return (outside + integral_of_table(times, values, start, end)) / (end - start)


@kernel
def update_pressure(model, state, before, after):
    """Update p~ (Pa) of all the shell: the one place that knows what the pressure depends on. Eq. (2.10), or core.gas.

    At the time of state.now; of a table the mean over the step, from so long (s) before that time to so long after it.
    """
    time = state.now[History.TIME]
    if model.gas.exponent > 0.0:
        advance_gas(model.gas, state.gas, state.vents, state.now, state.peaks)
    elif model.pressure.law == PressureLaw.TABLE and before + after > 0.0:
        state.now[History.PRESSURE] = mean_of_table(model.pressure, time - before, time + after)
    else:
        state.now[History.PRESSURE] = pressure_at(model.pressure, time)


@kernel
def pressure_bound(model, i, around, length_1, length_2):
    """Return what pressure adds to w² (1/s^2) and D (1/s) of row i, for the bound of the step: see core.loop.step_size.

    Pressure turns with the cloth: no more than p times the sum of the lengths (m) of both edges, that of the generatrix as far as
    waves run around the hoop: around, 1, or the angle of the column of an axisymmetric shell. By (2.11), 2 nu^n p for small
    velocities damps a node by its area, taken as if it acted along the wave.
    """
    push = model.pressure.most * model.hoop.gas * model.per_mass[i]
    return push * (around * length_1 + length_2), 2.0 * model.pressure.damping * push * length_1 * length_2


@kernel
def update_damped_pressure(pressure, uniform, nodes, area, on_nodes, node, count):
    """Update the pressure on a number of nodes in a row by their normal velocities V^n at n-1/2. Eq. (2.11).

    Reads uniform: p~ (Pa); nodes at offset node; area. Writes on_nodes (Pa).
    """
    for j in range(uint64(count)):
        a = node + j
        b = FIRST + j
        square = area.x[b] * area.x[b] + area.y[b] * area.y[b] + area.z[b] * area.z[b]
        through = nodes.u[a] * area.x[b] + nodes.v[a] * area.y[b] + nodes.w[a] * area.z[b]
        factor = 1.0 - pressure.damping * through / sqrt(max(square, SMALLEST_AREA))
        on_nodes[j] = uniform * factor * abs(factor)
