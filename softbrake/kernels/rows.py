"""Rows of columns: how many entries a loop over a row takes, and sums over them."""

from numba import uint64

from softbrake.kernels.jit import kernel
from softbrake.state import PAD

LANES = uint64(PAD)


@kernel
def lanes(columns):
    """Return the columns of a row rounded up to whole cache lines: a loop over them has no remainder to be done one by one.

    What comes out beyond the columns is never read; state.Model.stride leaves room for it.
    """
    return (uint64(columns) + LANES - uint64(1)) & ~(LANES - uint64(1))
