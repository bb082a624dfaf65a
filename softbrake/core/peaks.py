"""The largest values of a run."""

from softbrake.core.jit import kernel


@kernel
def raise_peak(peaks, which, value, time, row):
    """Keep a value with its time (s) and row if it is the largest so far."""
    if value > peaks[which, 0]:
        peaks[which, 0] = value
        peaks[which, 1] = time
        peaks[which, 2] = row
