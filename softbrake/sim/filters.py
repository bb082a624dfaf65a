"""Peaks of a recorded pulse behind a channel frequency class (CFC) of SAE J211-1, as crash and drop tests give them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from softbrake.core.arrays import Floats
from softbrake.core.columns import History
from softbrake.core.second_order import filter_samples
from softbrake.sim.summary import FilteredPeaks, PeakValue, Phase

CORNER = 2.0775  # Hz per class, where one pass has the gain 0.707
BOTH = 5.0 / 3.0  # Hz per class, where both passes have the gain 0.707
SAMPLES = 100  # in a period of the corner; a mean over one takes 2e-4 off what the corner lets through
LEAST_ROWS = 10.0  # per second and class: the standard's lowest rate of sampling
UNEVEN = 0.01  # of the time between samples, that written times may be off
LEAST_PERIODS = 3.0  # of the corner in a record
MIRRORED = 0.01  # s, at both ends
TENSIONS = {
    "peak_tension_generatrix": History.TENSION_GENERATRIX,
    "peak_tension_hoop": History.TENSION_HOOP,
    "peak_tension_belt": History.TENSION_BELT,
}
PEAKS = ("peak_deceleration", *TENSIONS)  # of Summary that a class filters
COLUMNS = (History.TIME, History.HEIGHT, History.VELOCITY, *TENSIONS.values())  # of the history that filtered peaks need


def low_pass(values: Floats, rate: float, cfc: float) -> Floats:
    """Return even samples behind a class: two poles forward and backward, both ends mirrored by 10 ms or what there is.

    rate: samples per second. Equal to the recursion of SAE J211-1, appendix C, to round-off; of no phase. Raises ValueError where
    wd T/2 reaches pi/2, at 4.155 samples per second and class.
    """
    section = butterworth(CORNER * cfc, rate)
    b, a = section[:3], np.append(1.0, section[3:])
    settled = np.linalg.solve([[1.0 + a[1], -1.0], [a[2], 1.0]], b[1:] - a[1:] * b[0])  # delays after a long record of ones
    mirrored = min(round(MIRRORED * rate), len(values) - 1)
    samples = np.concatenate((values[mirrored:0:-1], values, values[-2 : -mirrored - 2 : -1]))
    for _ in range(2):
        filter_samples(section, settled * samples[0], samples)
        samples = samples[::-1].copy()
    return samples[mirrored : len(samples) - mirrored]


def butterworth(corner: float, rate: float) -> Floats:
    """Return b0, b1, b2, a1, a2 of the low-pass of Butterworth with two poles by the bilinear transform.

    corner: Hz, where its gain is 0.707. rate: samples per second. Raises ValueError where the corner is half of that or more.
    """
    if corner >= 0.5 * rate:
        raise ValueError(f"a corner of {corner:.4g} Hz needs more than {2.0 * corner:.4g} samples a second, not {rate:.4g}")
    warped = 4.0 * np.tan(0.5 * np.pi * (corner / (0.5 * rate)))
    poles = warped * -np.exp(1j * np.pi * np.array([-1.0, 1.0]) / 4.0)
    gain = warped**2 * (1.0 / np.prod(4.0 - poles)).real
    one, other = (4.0 + poles) / (4.0 - poles)
    pole = 0.5 * (one + other.conjugate())
    return np.array([gain, 2.0 * gain, gain, -2.0 * pole.real, pole.real * pole.real + pole.imag * pole.imag])


def unfit(time: Floats, cfc: float) -> str | None:
    """Say in a few words why a record at these times (s) is too coarse or too short for a class; None where it is not.

    At fewer than 10 samples per second and class the standard allows none, at 4.155 the corner would be above what they can show.
    """
    if len(time) < 2:
        return "fewer than two rows"
    if not np.isfinite(time).all():
        return "rows that are no numbers"
    apart, allowed = float(np.diff(time).max(initial=0.0)), 1.0 / (LEAST_ROWS * cfc)
    if apart > allowed * (1.0 + UNEVEN):
        return f"rows {apart * 1e3:.3g} ms apart, {allowed * 1e3:.3g} allowed"
    lasts, least = float(time[-1] - time[0]), LEAST_PERIODS / (CORNER * cfc)
    return f"{lasts * 1e3:.2g} ms long, {least * 1e3:.2g} expected" if lasts < least else None


def filtered(time: Floats, values: Floats, cfc: float) -> tuple[Floats, Floats] | None:
    """Return even times (s) and values behind a class, of a record at times that need not be even; None where it is unfit.

    None also where a value is no number. Samples are means of the record, linear between its times, over 1/100 of a period of the
    corner, which is more than 10 kHz in each class: no blow between them is lost.
    """
    if unfit(time, cfc) is not None or not np.isfinite(values).all():
        return None
    edges = _edges(time, cfc)
    return _filtered_slope(edges, integral(time, values, edges), cfc)


def integral(time: Floats, values: Floats, until: Floats) -> Floats:
    """Return the integrals of a record, linear between its times (s), from the first one until others within it."""
    whole = np.concatenate(([0.0], np.cumsum(0.5 * np.diff(time) * (values[1:] + values[:-1]))))
    row = np.clip(np.searchsorted(time, until, side="right") - 1, 0, len(time) - 2)
    integrals: Floats = whole[row] + 0.5 * (until - time[row]) * (values[row] + np.interp(until, time, values))
    return integrals


def filtered_slope(time: Floats, values: Floats, cfc: float) -> tuple[Floats, Floats] | None:
    """As `filtered`, of what the values change by in a second: so an acceleration keeps the momentum between rows."""
    if unfit(time, cfc) is not None or not np.isfinite(values).all():
        return None
    edges = _edges(time, cfc)
    return _filtered_slope(edges, np.interp(edges, time, values), cfc)


def filtered_peaks(history: Floats, cfc: int, crushing: float, names: Sequence[str]) -> FilteredPeaks:
    """Return the peaks behind a class of history rows, (rows, len(COLUMNS)).

    crushing: height of the cover (m) where that phase begins. names: the fields of FilteredPeaks that the run has.
    """
    columns = dict(zip(COLUMNS, history.T, strict=True))
    time, height = columns[History.TIME], columns[History.HEIGHT]
    if not np.isfinite(history).all():
        return FilteredPeaks(cfc, "rows that are no numbers")
    if (fault := unfit(time, cfc)) is not None:
        return FilteredPeaks(cfc, fault)
    low = np.flatnonzero(height <= crushing)
    k = int(low[0]) if low.size else 0
    over = float(np.interp(-crushing, -height[k - 1 : k + 1], time[k - 1 : k + 1])) if k > 0 else time[0] if low.size else np.inf
    peaks = {}
    for name in names:
        if name == "peak_deceleration":
            pulse = filtered_slope(time, columns[History.VELOCITY], cfc)
        else:
            pulse = filtered(time, columns[TENSIONS[name]], cfc)
        assert pulse is not None
        peaks[name] = _peak(*pulse, over)
    return FilteredPeaks(cfc, None, **peaks)


def larger(overshoot: PeakValue, crushing: PeakValue) -> PeakValue:
    """Return the larger one of the peaks of both phases, with the other in it unless that phase has none, nothing above 0."""
    first, second = (crushing, overshoot) if crushing.value > overshoot.value else (overshoot, crushing)
    return PeakValue(first.value, first.time, first.height, first.phase, second if second.value > 0.0 else None)


def _edges(time: Floats, cfc: float) -> Floats:
    """Times (s) between even samples of a record."""
    count = max(round((time[-1] - time[0]) * CORNER * cfc * SAMPLES), 1)
    edges: Floats = np.linspace(time[0], time[-1], count + 1)
    return edges


def _filtered_slope(edges: Floats, values: Floats, cfc: float) -> tuple[Floats, Floats]:
    """Even times (s) and the change of the values in a second behind a class."""
    rate = (len(edges) - 1) / (edges[-1] - edges[0])
    return 0.5 * (edges[1:] + edges[:-1]), low_pass(rate * np.diff(values), rate, cfc)


def _peak(time: Floats, values: Floats, over: float) -> PeakValue:
    """Largest value and its phase; the overshoot ends at the time `over` (s)."""

    def largest(phase: Phase, within: NDArray[np.bool_]) -> PeakValue:
        if not within.any():
            return PeakValue(0.0, 0.0, None, phase)
        at = int(np.argmax(np.where(within, values, -np.inf)))
        return PeakValue(max(float(values[at]), 0.0), float(time[at]), None, phase)

    return larger(largest("overshoot", time <= over), largest("crushing", time > over))
