"""What least squares tell of unknowns: intervals from differences that are a sequence in time, directions that nothing tells.

Squares are not weighted by the correlation of what is left: a filter has all but nothing left where such weights would look.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from softbrake.core.arrays import Floats

CONFIDENCE = 0.95
CERTAIN = 3.0  # times its error, that a change must be to be known
PART_OF_DIRECTION = 0.2  # of the largest, that an unknown has in a combination that names it


class TooFewSamples(Exception):
    """A channel has no more samples than there are unknowns."""


class Known(NamedTuple):
    """What slopes and differences tell of inputs, in parts of their ranges, and of shifts, in spacings."""

    inverse: Floats  # (inputs and shifts, samples), of the slopes; 0 of inputs at an end
    covariance: Floats
    half_widths: Floats  # of the intervals
    quantile: float  # of 95 %, two-sided, by the degrees of freedom of the first input
    correlations: list[float]  # of each channel, from one sample to the next
    unseen: list[dict[int, float]]  # combinations of inputs, by number, that change nothing beyond the errors of the slopes
    allowed: float  # how many times the least sum of squares is as likely

    def wide(self, inputs: int) -> list[dict[int, float]]:
        """Combinations of inputs that the tests tell no better than their ranges do."""
        values, directions = np.linalg.eigh(self.covariance[:inputs, :inputs])
        wide = self.quantile * np.sqrt(np.maximum(values, 0.0)) > 0.5
        return [_parts(direction) for direction in directions.T[wide]]


def _parts(direction: Floats) -> dict[int, float]:
    """Parts of a direction that count, by number."""
    largest = np.abs(direction).max()
    return {k: float(part) for k, part in enumerate(direction) if abs(part) > PART_OF_DIRECTION * largest}


def known_by(slopes: Floats, errors: Floats, fixed: NDArray[np.bool_], left: Sequence[Floats]) -> Known:
    """Return what is known. slopes: (samples, inputs and shifts); errors: norms, of inputs; left: of channels, weighted.

    Directions that change no more than the errors of slopes would are left out. What is left of a channel is taken as a sequence
    of first order, its correlation and size by restricted likelihood, which counts what the fit has taken away. Squares are not
    weighted by it: a filter has all but nothing left where such weights would look.
    """
    from scipy.special import fdtri, stdtrit

    n = len(errors)
    free = np.append(~fixed, np.ones(slopes.shape[1] - n, bool))
    sizes = np.linalg.norm(slopes, axis=0)
    scaled = np.where(free & (sizes > 0.0), slopes / np.where(sizes > 0.0, sizes, 1.0), 0.0)
    u, s, vt = np.linalg.svd(scaled, full_matrices=False)
    relative = np.zeros(len(free))
    relative[:n] = np.where(sizes[:n] > 0.0, errors / np.where(sizes[:n] > 0.0, sizes[:n], 1.0), 1.0)
    seen = s > CERTAIN * np.sqrt((vt**2) @ relative**2) + 1e-8
    inverse = (vt[seen].T / s[seen]) @ u[:, seen].T / np.where(sizes > 0.0, sizes, 1.0)[:, None]
    inverse[~free] = 0.0
    unseen = []
    for direction in vt[~seen]:
        direction = np.where(free, direction, 0.0)
        if np.abs(direction[:n]).max() > PART_OF_DIRECTION:
            parts = {k: part for k, part in _parts(direction).items() if k < n}
            unseen.append({k: part / (sizes[k] or 1.0) for k, part in parts.items()})
    covariance, squares = np.zeros((len(free), len(free))), np.zeros(len(free))
    correlations, start, degrees = [], 0, 0.0
    for one in left:
        rows = slice(start, start + len(one))
        correlation, variance, freedom = _sequence(one, scaled[rows])
        apart = np.abs(np.subtract.outer(np.arange(len(one)), np.arange(len(one))))
        part = variance * inverse[:, rows] @ (correlation**apart) @ inverse[:, rows].T
        covariance += part
        squares += np.diag(part) ** 2 / freedom
        degrees += freedom * (1.0 - correlation) / (1.0 + correlation)
        correlations.append(correlation)
        start += len(one)
    own = np.diag(covariance)
    freedoms = np.where(squares > 0.0, own**2 / np.where(squares > 0.0, squares, 1.0), degrees)
    quantiles = stdtrit(freedoms, 0.5 + 0.5 * CONFIDENCE)
    allowed = 1.0 + n / degrees * float(fdtri(n, degrees, CONFIDENCE))
    return Known(inverse, covariance, quantiles * np.sqrt(own), float(quantiles[0]), correlations, unseen, allowed)


def _sequence(left: Floats, slopes: Floats) -> tuple[float, float, float]:
    """Correlation from sample to sample, variance and its degrees of freedom, of what a fit by slopes has left.

    A sequence of first order, correlation >= 0, of the largest restricted likelihood. Raises TooFewSamples for too few samples.
    """
    from scipy.optimize import minimize_scalar

    u, s, _ = np.linalg.svd(slopes, full_matrices=False)
    basis = u[:, s > 1e-6 * s.max(initial=0.0)] if s.max(initial=0.0) > 0.0 else u[:, :0]
    freedom = len(left) - basis.shape[1]
    if freedom < 3:
        raise TooFewSamples(f"{len(left)} samples of a channel for {basis.shape[1]} unknowns; a longer interval is expected")
    both = np.column_stack((basis, left))

    def whitened(correlation: float) -> tuple[float, float]:
        """Sum of squares beyond the basis, and the likelihood but for its sign and size."""
        rest = math.sqrt(1.0 - correlation**2)
        white = np.vstack((both[:1], (both[1:] - correlation * both[:-1]) / rest))
        diagonal = np.abs(np.diag(np.linalg.qr(white, "r")))
        square = max(float(diagonal[-1]) ** 2, 1e-300)
        logs = 2.0 * (len(left) - 1) * math.log(rest) + 2.0 * float(np.sum(np.log(diagonal[:-1])))
        return square, freedom * math.log(square) + logs

    found = minimize_scalar(lambda one: whitened(one)[1], bounds=(0.0, 0.98), method="bounded", options={"xatol": 1e-3})
    correlation = float(found.x) if found.fun < whitened(0.0)[1] else 0.0
    return correlation, whitened(correlation)[0] / freedom, float(freedom)
