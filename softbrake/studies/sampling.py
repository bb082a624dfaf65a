"""Where the runs of a sampled sweep stand: places in the unit cube, by mode and seed."""

from __future__ import annotations

import random
from collections.abc import Iterator
from typing import Any, NamedTuple

SAMPLED = ("random", "lhs", "sobol", "saltelli")  # modes
NESTED = ("random", "sobol")  # of which more samples begin with those of fewer


class Sampling(NamedTuple):
    """How a sweep was sampled, as its plan keeps it."""

    mode: str  # of SAMPLED
    samples: int
    seed: int
    inputs: tuple[str, ...]  # that vary by themselves: keys, or tables of joint samples
    control: str = ""  # cheaper fidelity that is run beside the case's own; empty without
    control_samples: int = 0  # of it alone, beside those at the samples

    @property
    def unbalanced(self) -> str | None:
        """What to say of a number of Sobol' points that is no power of two; None of others."""
        if self.mode not in ("sobol", "saltelli") or self.samples & (self.samples - 1) == 0:
            return None
        more = 1 << self.samples.bit_length()
        return f"mode {self.mode}: {self.samples} samples are no power of two; {more // 2} or {more} fill the cube evenly"

    def points(self) -> Iterator[tuple[float, ...]]:
        """Places of the runs, one number from 0 to 1 an input. Raises ImportError without scipy for Sobol' points.

        Of mode saltelli the samples A, then B, then A with its first input from B, and so on: (inputs + 2) samples in all.
        """
        count, total = len(self.inputs), self.samples + self.control_samples
        if self.mode == "lhs":
            yield from latin_hypercube(count, total, self.seed)
        elif self.mode == "random":
            chance = random.Random(self.seed)
            for _ in range(total):
                yield tuple(chance.random() for _ in range(count))
        elif self.mode == "sobol":
            yield from map(tuple, _sobol(count, total, self.seed))
        else:
            both = _sobol(2 * count, total, self.seed)
            a, b = [point[:count] for point in both], [point[count:] for point in both]
            for first in (a, b):
                yield from map(tuple, first)
            for k in range(count):
                yield from ((*one[:k], other[k], *one[k + 1 :]) for one, other in zip(a, b, strict=True))


def _sobol(dimensions: int, samples: int, seed: int) -> list[list[float]]:
    """Scrambled Sobol' points: the first of as many as the next power of two has, so that more samples begin with them."""
    import numpy as np
    from scipy.stats import qmc

    sequence = qmc.Sobol(dimensions, scramble=True, seed=np.random.default_rng(seed))  # of a number, seed and rng would differ
    points: Any = sequence.random_base2((samples - 1).bit_length())[:samples]
    return points.tolist()  # type: ignore[no-any-return]


def latin_hypercube(axes: int, samples: int, seed: int) -> Iterator[tuple[float, ...]]:
    """Places in the unit cube: of each axis one in each of as many equal parts as there are samples, in an order of its own."""
    chance = random.Random(seed)
    columns = []
    for _ in range(axes):
        parts = [(k + chance.random()) / samples for k in range(samples)]
        chance.shuffle(parts)
        columns.append(parts)
    return zip(*columns, strict=True)
