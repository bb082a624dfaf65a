"""Rows of columns: how many entries a loop over a row takes, and the copies at both ends."""

from numba import uint64

from softbrake.kernels.jit import kernel
from softbrake.state import PAD

ONE = uint64(1)
LANES = uint64(PAD)


@kernel
def lanes(columns):
    """Return the columns of a row rounded up to whole cache lines: a loop over them has no remainder to be done one by one.

    What comes out beyond the columns is never read; state.Model.stride leaves room for it.
    """
    return (uint64(columns) + LANES - ONE) & ~(LANES - ONE)


@kernel
def turn_row(x, y, sector, first, columns):
    """Copy the last column of vectors, turned by a sector backwards, in front of a row and the first one, forwards, behind it."""
    before, last, behind = first - ONE, first + uint64(columns) - ONE, first + uint64(columns)
    x[before] = sector.cos * x[last] + sector.sin * y[last]
    y[before] = sector.cos * y[last] - sector.sin * x[last]
    x[behind] = sector.cos * x[first] - sector.sin * y[first]
    y[behind] = sector.cos * y[first] + sector.sin * x[first]


@kernel
def close_row(values, first, columns):
    """Copy the last column in front of a row and the first one behind it."""
    values[first - ONE] = values[first + uint64(columns) - ONE]
    values[first + uint64(columns)] = values[first]
