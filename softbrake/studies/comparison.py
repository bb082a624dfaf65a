"""A computed drop beside measured channels: the same filter, one even axis, one shift in time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from softbrake.core.arrays import Floats
from softbrake.signals.channel import Channel
from softbrake.sim.filters import filtered, filtered_slope, unfit

RATE = 10_000  # samples per second of the even axis, as ISO/TS 18571 asks
COLUMNS = {"deceleration": "acceleration", "pressure": "pressure", "velocity": "velocity", "height": "height"}


class Curve(NamedTuple):
    """A quantity at rising times, linear between them."""

    time: Floats  # s
    values: Floats  # SI


class Pair(NamedTuple):
    """Two curves on one even axis."""

    time: Floats  # s, of the drop
    test: Floats  # SI
    computed: Floats  # SI


def computed_curve(history: NDArray[Any], quantity: str, cfc: int | None, gravity: float = 0.0) -> Curve:
    """Return a quantity of QUANTITIES of a history, a structured array as `read_history` returns it, behind a class if any.

    gravity: m/s^2, what the test's accelerometer adds to the net deceleration; 0 where it was taken out. Pressure is gauge,
    velocity negative downwards. A deceleration behind a class comes from velocities, which lose no blow between rows.
    Raises ValueError where the history is too coarse or too short for the class.
    """
    time, values = history["time"], history[COLUMNS[quantity]]
    if cfc is not None:
        found = filtered_slope(time, history["velocity"], cfc) if quantity == "deceleration" else filtered(time, values, cfc)
        if found is None:
            raise ValueError(f"CFC {cfc}: {unfit(time, cfc) or 'values that are no numbers'}")
        time, values = found
    return Curve(time, values + gravity if quantity == "deceleration" else values)


def measured_curve(channel: Channel, cfc: int | None) -> Curve:
    """Return a channel behind a class, if any; one that has passed it stays as it is. Raises ValueError as `computed_curve`."""
    if channel.fault is not None:
        raise ValueError(channel.fault)
    if cfc is None or channel.cfc == cfc:
        return Curve(channel.time, channel.values)
    found = filtered(channel.time, channel.values, cfc)
    if found is None:
        raise ValueError(f"{channel.name}: CFC {cfc}: {unfit(channel.time, cfc) or 'values that are no numbers'}")
    return Curve(*found)


def common(test: Curve, computed: Curve, shift: float) -> tuple[float, float]:
    """Return the times (s, of the drop) from which and until which both curves are known, `shift` (s) added to the test's."""
    return max(test.time[0] + shift, computed.time[0]), min(test.time[-1] + shift, computed.time[-1])


def paired(test: Curve, computed: Curve, shift: float, interval: tuple[float, float]) -> Pair:
    """Return both curves at 10 kHz over an interval (s, of the drop) that both cover. Raises ValueError where it does not."""
    start, stop = interval
    first, last = common(test, computed, shift)
    count = round((stop - start) * RATE) + 1
    near = 1e-9
    if start < first - near or stop > last + near or count < 2:
        raise ValueError(f"from {start:.6g} to {stop:.6g} s: test and drop share {first:.6g} to {last:.6g} s")
    time = start + np.arange(count) / RATE
    return Pair(time, np.interp(time - shift, *test), np.interp(time, *computed))


def found_shift(curves: Sequence[tuple[Curve, Curve]], least: float, most: float) -> float:
    """Return the shift (s) of the tests' times, within bounds, at which (test, computed) curves differ least.

    The measure is the sum over the curves of the mean square difference where both are known, over the test's mean square
    about its mean; at least half of the shorter of the two must be shared. Steps of 0.1 ms, then a parabola through the
    lowest three. Raises ValueError where no shift shares enough.
    """
    steps = np.arange(np.ceil(least * RATE), np.floor(most * RATE) + 1) / RATE
    misfit = np.zeros(len(steps))
    for test, computed in curves:
        shorter = min(test.time[-1] - test.time[0], computed.time[-1] - computed.time[0])
        count = int((test.time[-1] - test.time[0]) * RATE) + 1
        time = test.time[0] + np.arange(count) / RATE
        values = np.interp(time, *test)
        spread = float(np.var(values)) or 1.0
        for at, shift in enumerate(steps):
            moved = time + shift
            within = (moved >= computed.time[0]) & (moved <= computed.time[-1])
            if within.sum() < 0.5 * shorter * RATE:
                misfit[at] = np.inf
                continue
            misfit[at] += float(np.mean((np.interp(moved[within], *computed) - values[within]) ** 2)) / spread
    if not len(steps) or not np.isfinite(misfit).any():
        raise ValueError(f"no shift from {least:.6g} to {most:.6g} s lays half of the test over the drop")
    k = int(np.argmin(misfit))
    if 0 < k < len(steps) - 1 and np.isfinite(misfit[k - 1 : k + 2]).all():
        before, here, after = misfit[k - 1 : k + 2]
        if (bend := before - 2.0 * here + after) > 0.0:
            return float(steps[k] + 0.5 * (before - after) / bend / RATE)
    return float(steps[k])
