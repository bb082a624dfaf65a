"""A computed drop beside measured channels: the same filter, one even axis, one shift in time."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from softbrake.core.arrays import Floats
from softbrake.signals.channel import Channel
from softbrake.sim.filters import BOTH, filtered, filtered_slope, unfit

RATE = 10_000  # samples per second of the even axis, as ISO/TS 18571 asks
MOST_STEPS = 1 << 40  # of the axis; no bound
LEAST = 0.01  # s, of an interval compared; a rating takes slopes over 0.9 ms
MOST_RATED = 6000  # samples of a pair; the package takes 1.4 GB for them, and memory grows as their square
NEAR = 1e-9  # s
SAMPLE = 1.0 / RATE  # s, by which filtered records begin late and end early
FLAT = 1e-9  # of the largest value, what a curve must change by to be rated
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
    if cfc is not None and channel.cfc is not None and channel.cfc < cfc:
        raise ValueError(f"'{channel.name}' has passed CFC {channel.cfc}; this class or a lower one is expected")
    if cfc is None or channel.cfc == cfc:
        return Curve(channel.time, channel.values)
    found = filtered(channel.time, channel.values, cfc)
    if found is None:
        raise ValueError(f"{channel.name}: CFC {cfc}: {unfit(channel.time, cfc) or 'values that are no numbers'}")
    return Curve(*found)


def common(test: Curve, computed: Curve, shift: float) -> tuple[float, float]:
    """Return the times (s, of the drop) from which and until which both curves are known, `shift` (s) added to the test's."""
    return max(test.time[0] + shift, computed.time[0]), min(test.time[-1] + shift, computed.time[-1])


def _cut(curve: Curve, start: float, stop: float) -> Curve:
    """The part of a curve within times (s), its ends included."""
    within = (curve.time > start) & (curve.time < stop)
    time = np.concatenate(([start], curve.time[within], [stop]))
    return Curve(time, np.interp(time, *curve))


def _paired(test: Curve, computed: Curve, shift: float, interval: tuple[float, float]) -> Pair:
    """Return both curves at 10 kHz over an interval (s, of the drop) that both cover."""
    start, stop = interval
    time = start + np.arange(round((stop - start) * RATE) + 1) / RATE
    return Pair(time, np.interp(time - shift, *test), np.interp(time, *computed))


def found_shift(curves: Sequence[tuple[Curve, Curve]], least: float = -np.inf, most: float = np.inf) -> float:
    """Return the shift (s) of the tests' times, within bounds, at which (test, computed) curves differ least.

    The measure is the sum over the curves of the mean square difference where both are known, over the variance of the test
    there is to compare; at least half of the shorter of the two must be shared. Steps of 0.1 ms, then a parabola through the
    lowest three. Raises ValueError where no shift shares enough.
    """
    found = [_misfits(test, computed) for test, computed in curves]
    first = max([math.ceil(least * RATE) if np.isfinite(least) else -MOST_STEPS, *(start for start, _ in found)])
    last = min([math.floor(most * RATE) if np.isfinite(most) else MOST_STEPS, *(start + len(each) - 1 for start, each in found)])
    if last < first:
        raise ValueError("no shift lays half of the test over the drop")
    misfit = np.sum([each[first - start : last + 1 - start] for start, each in found], axis=0)
    k = int(np.argmin(misfit))
    if 0 < k < len(misfit) - 1:
        before, here, after = misfit[k - 1 : k + 2]
        if (bend := before - 2.0 * here + after) > 0.0:
            return float((first + k + 0.5 * (before - after) / bend) / RATE)
    return (first + k) / RATE


def _turned(test: Curve, computed: Curve, shift: float | None) -> bool:
    """Whether a test with the other sign comes nearer to the drop, at its own best shift unless one is given."""

    def least(curve: Curve) -> float:
        first, misfits = _misfits(curve, computed)
        if shift is None:
            return float(misfits.min())
        at = round(shift * RATE) - first
        return float(misfits[at]) if 0 <= at < len(misfits) else math.inf

    return least(Curve(test.time, -test.values)) < least(test)


def _misfits(test: Curve, computed: Curve) -> tuple[int, Floats]:
    """Return the least shift, in steps of the axis, that shares half of the shorter curve, and the misfits from there on.

    Squares and products are summed for all shifts at once, by Fourier transforms.
    """
    (begin, measured), (start, drop) = _on_axis(test), _on_axis(computed)
    m, n = len(measured), len(drop)
    size = 1 << (m + n).bit_length()

    def moved(one: Floats, other: Floats) -> Floats:
        """Sum of one[i] other[i + lag] for lags from 1 - m to n - 1."""
        product = np.fft.irfft(np.conj(np.fft.rfft(one, size)) * np.fft.rfft(other, size), size)
        return np.concatenate((product[size - m + 1 :], product[:n]))

    mean = measured.mean()
    measured, drop = measured - mean, drop - mean  # smaller numbers, smaller round-off
    shared = np.rint(moved(np.ones(m), np.ones(n)))
    squares = moved(measured**2, np.ones(n)) - 2.0 * moved(measured, drop) + moved(np.ones(m), drop**2)
    enough = np.flatnonzero(shared >= 0.5 * min(m, n))
    within = slice(enough[0], enough[-1] + 1)
    spread = float(np.mean(measured**2)) or 1.0
    return int(start - begin + 1 - m + enough[0]), np.maximum(squares[within], 0.0) / shared[within] / spread


def _on_axis(curve: Curve) -> tuple[int, Floats]:
    """The first step of the axis, 1/RATE apart from 0 on, that a curve covers, and its values from there on."""
    first, last = math.ceil(curve.time[0] * RATE - 1e-6), math.floor(curve.time[-1] * RATE + 1e-6)
    if last <= first:
        raise ValueError(f"a record of {curve.time[-1] - curve.time[0]:.3g} s is too short to compare")
    return first, np.interp(np.arange(first, last + 1) / RATE, *curve)


@dataclass(frozen=True)
class Marks:
    """Numbers by which a pulse is known, over the interval compared; SI."""

    peak: float  # largest; of a height the lowest, of a velocity the largest downwards
    time: float  # s, of the peak
    width: float | None  # s, from the first to the last time at half the peak or above; None of velocity and height
    change: float | None  # m/s, of velocity, also that of a deceleration net of gravity; m of a height; None of a pressure


@dataclass(frozen=True)
class Rating:
    """Objective rating of ISO/TS 18571, 0 to 1, test as the reference."""

    overall: float
    corridor: float
    phase: float
    magnitude: float
    slope: float


@dataclass(frozen=True)
class Compared:
    """One quantity of a drop beside its channel."""

    quantity: str  # of QUANTITIES
    channel: str  # its name in the test
    unit: str  # of the channel
    pair: Pair
    test: Marks
    computed: Marks
    turned: bool  # whether the test with the other sign comes nearer to the drop
    rms: float  # of the difference, SI
    rating: Rating | None
    unrated: str | None  # why there is no rating, else None


@dataclass(frozen=True)
class Comparison:
    """A drop beside a test."""

    shift: float  # s, added to the times of the test
    shift_found: bool  # by least squares, not given
    interval: tuple[float, float]  # s, of the drop
    cfc: int | None
    added: float  # m/s^2, that the decelerations have above those net of gravity
    quantities: tuple[Compared, ...]

    @property
    def opposed(self) -> list[str]:
        """Channels that come nearer to the drop with the other sign."""
        return [each.channel for each in self.quantities if each.turned]


def compare(
    history: NDArray[Any],
    channels: Sequence[Channel],
    *,
    cfc: int | None,
    added: float,
    shift: float | None = None,
    interval: tuple[float, float] | None = None,
) -> Comparison:
    """Lay channels of a test, each of another quantity, beside the history of a drop.

    added: m/s^2, what the test's accelerometer reads above the net deceleration: the case's gravity, or 0 where it was taken out.
    shift: s, added to the test's times; None finds it. interval: s, of the drop; None is all that drop and test share, but a
    period of the class's corner at both ends of the drop: what was before and after it is in the test's there.
    Raises ValueError.
    """
    margin = 0.0 if cfc is None else 1.0 / (BOTH * cfc)
    curves = []
    for channel in channels:
        assert channel.quantity is not None
        test = measured_curve(channel, cfc)
        try:
            drop = computed_curve(history, channel.quantity, cfc, added)
        except ValueError as error:
            cure = "a smaller output.history_interval or class is expected"
            raise ValueError(f"the history of the drop: {error}; {cure}") from None
        start, stop = interval or (drop.time[0] + margin, drop.time[-1] - margin)
        if stop - start < LEAST or start < drop.time[0] - SAMPLE or stop > drop.time[-1] + SAMPLE:
            asked, known = f"{start:.6g} to {stop:.6g} s", f"{drop.time[0]:.6g} to {drop.time[-1]:.6g} s"
            raise ValueError(f"{asked} of a drop known from {known}; {LEAST:g} s at least, within it, are expected")
        curves.append((test, _cut(drop, start, stop)))
    moved = found_shift(curves) if shift is None else shift
    shared = [common(test, computed, moved) for test, computed in curves]
    within = max(start for start, _ in shared), min(stop for _, stop in shared)
    lacking = interval is not None and (within[0] > interval[0] + NEAR or within[1] < interval[1] - NEAR)
    if within[1] - within[0] < LEAST or lacking:
        known = f"they share {within[0]:.6g} to {within[1]:.6g} s" if within[1] > within[0] else "they share no time"
        expected = f"{LEAST:g} s at least are" if not lacking else "an interval within is"
        raise ValueError(f"test and drop, shifted by {moved:.6g} s: {known}; {expected} expected")
    found = []
    for channel, (test, computed) in zip(channels, curves, strict=True):
        pair = _paired(test, computed, moved, within)
        rating, unrated = rate(pair)
        quantity = str(channel.quantity)
        rms = float(np.sqrt(np.mean((pair.computed - pair.test) ** 2)))
        ours, theirs = (marks_of(quantity, pair.time, values, added) for values in (pair.computed, pair.test))
        turned = _turned(test, computed, shift)
        found.append(Compared(quantity, channel.name, channel.unit, pair, theirs, ours, turned, rms, rating, unrated))
    return Comparison(moved, shift is None, within, cfc, added, tuple(found))


def marks_of(quantity: str, time: Floats, values: Floats, added: float) -> Marks:
    """Return the marks of even samples. added: m/s^2, as of `compare`; the change of velocity is without it."""
    downwards = quantity in ("velocity", "height")
    at = int(np.argmin(values) if downwards else np.argmax(values))
    peak, width, change = float(values[at]), None, None
    if not downwards and peak > 0.0:
        high = np.flatnonzero(values >= 0.5 * peak)
        width = float(time[high[-1]] - time[high[0]])
    if downwards:
        change = float(values[-1] - values[0])
    elif quantity == "deceleration":
        change = float(np.sum((0.5 * (values[1:] + values[:-1]) - added) * np.diff(time)))
    return Marks(peak, float(time[at]), width, change)


def rate(pair: Pair) -> tuple[Rating | None, str | None]:
    """Return the rating of ISO/TS 18571 of a pair, or why there is none.

    The package sees values alone, not their times, and divides by the slope and size of the test: pairs are on one even axis
    here, and a flat curve gets no rating.
    """
    for name, values in (("test", pair.test), ("drop", pair.computed)):
        if np.ptp(values) <= FLAT * np.abs(values).max():
            return None, f"the {name} is flat"
    if len(pair.time) > MOST_RATED:
        return None, f"{(len(pair.time) - 1) / RATE:.3g} s are too long, up to {MOST_RATED / RATE:g} s are expected; --interval"
    try:
        from dtwalign import backtrack, cost
        from objective_rating_metrics.rating import ISO18571
    except ImportError:
        return None, "needs objective-rating-metrics: pip install 'softbrake[test-data]'"
    for module in (backtrack, cost):  # which else compiles anew, for ten seconds, in each process
        for kernel in vars(module).values():
            if hasattr(kernel, "enable_caching"):
                kernel.enable_caching()
    rated = ISO18571(np.column_stack((pair.time, pair.test)), np.column_stack((pair.time, pair.computed)))
    parts = (rated.corridor_rating, rated.phase_rating, rated.magnitude_rating, rated.slope_rating)
    return Rating(float(rated.overall_rating(-1)), *(float(part(-1)) for part in parts)), None
