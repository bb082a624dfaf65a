"""A fixed loop to measure the machine with, in the same minute as the kernels."""

from math import sqrt
from time import process_time

import numpy as np
from numba import njit

SIZE = 4096  # doubles; three such arrays fill the first-level cache as a few rows of the shell do


@njit(error_model="numpy")
def stencil(x, force, count):
    """Pass count times over a chain of springs: a difference, a square root, a division, a sum at each element."""
    for _ in range(count):
        for j in range(1, x.size - 1):
            right = x[j + 1] - x[j]
            left = x[j] - x[j - 1]
            force[j] += right / sqrt(1.0 + right * right) - left / sqrt(1.0 + left * left)


class Calibration:
    """The loop, sized to take about `seconds` a call."""

    def __init__(self, seconds: float) -> None:
        self.x = np.sin(0.01 * np.arange(SIZE))
        self.force = np.zeros(SIZE)
        self.count = 1
        stencil(self.x, self.force, self.count)  # compiles
        self.count = 1000
        self.count = max(int(1e9 * seconds / (SIZE * self.nanoseconds())), 1)

    def nanoseconds(self) -> float:
        """Return what one element costs now, ns of CPU time."""
        start = process_time()
        stencil(self.x, self.force, self.count)
        return 1e9 * (process_time() - start) / (self.count * SIZE)
