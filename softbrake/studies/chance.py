"""What sampled runs say of the answers: the chance that limits hold, quantiles, Sobol' indices, means with a control.

An answer is an array of a number a run, in the order of a plan, NaN of a run that has none. Such a run keeps no limit.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray

from softbrake.core.arrays import Floats
from softbrake.studies.sampling import Sampling

CONFIDENCE = 0.95  # of all intervals
QUANTILES = (0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99)
RESAMPLES = 500  # of a bootstrap
ROUNDING = 1e-20  # of a square, relative
HELD = "chance of "  # in front of a limit, of a controlled mean that is one
ALL = "all limits"
SIGMAS = NormalDist().inv_cdf(0.5 + 0.5 * CONFIDENCE)


@dataclass(frozen=True)
class Estimate:
    """A number with its interval."""

    value: float
    low: float
    high: float

    @property
    def half(self) -> float:
        """Half the width of the interval."""
        return 0.5 * (self.high - self.low)


@dataclass(frozen=True)
class Spread:
    """How an answer is distributed over the runs that have one."""

    mean: float
    deviation: float
    quantiles: tuple[float, ...]  # of QUANTILES


@dataclass(frozen=True)
class Index:
    """What part of the variance of an answer is due to an input."""

    input: str
    first: Estimate  # by the input alone
    total: Estimate  # with what it does together with others


@dataclass(frozen=True)
class Controlled:
    """A mean over few dear runs, corrected by many cheap ones."""

    mean: Estimate
    plain: Estimate  # of the dear runs alone
    coefficient: float
    saved: float  # part of the variance of the plain mean; negative where the control adds to it


@dataclass(frozen=True)
class Chance:
    """What a sample says."""

    sampling: Sampling
    runs: int  # at the samples, at the case's own fidelity; of mode saltelli at A and B
    lost: int  # of them without an answer
    holds: Mapping[str, Estimate] = field(default_factory=dict)  # chance of each limit, and of ALL
    spreads: Mapping[str, Spread] = field(default_factory=dict)  # by answer
    indices: Mapping[str, Sequence[Index]] = field(default_factory=dict)  # by answer
    left_out: int = 0  # samples of mode saltelli that indices do without, as a run of theirs has no answer
    controlled: Mapping[str, Controlled] = field(default_factory=dict)  # by answer, and of chances by limit
    uncontrolled: int = 0  # most runs that one of these does without, as they have no such answer


def chance_of(sampling: Sampling, answers: Mapping[str, Floats], margins: Mapping[str, Floats]) -> Chance:
    """Evaluate a sample. answers, margins: a number a run in the order of the plan, of each answer and each limit."""
    samples = sampling.samples
    own = 2 * samples if sampling.mode == "saltelli" else samples
    there = [column[:own] for column in answers.values() if not np.isnan(column[:own]).all()]
    lost = np.logical_or.reduce([np.isnan(column[:own]) for column in (*there, *margins.values())])
    kept = {name: column >= 0.0 for name, column in margins.items()}  # NaN holds nothing
    if kept:
        kept[ALL] = np.logical_and.reduce(list(kept.values()))
    holds = {name: wilson(int(held[:own].sum()), own) for name, held in kept.items()}
    spreads = {name: _spread(column[:own]) for name, column in answers.items() if np.isfinite(column[:own]).any()}
    found = Chance(sampling, own, int(lost.sum()), holds, spreads)
    if sampling.mode == "saltelli":
        blocks = {name: column.reshape(-1, samples) for name, column in answers.items() if name in spreads}
        sound = np.logical_and.reduce([np.isfinite(block).all(axis=0) for block in blocks.values()])
        indices = {name: sobol_indices(block[:, sound], sampling.inputs) for name, block in blocks.items()}
        return Chance(sampling, own, found.lost, holds, spreads, indices, int((~sound).sum()))
    if sampling.control:
        numbers = {name: column for name, column in answers.items() if not _without(column, own)}
        for name, held in kept.items():  # one that never changes says nothing of its variance
            if not _uncontrolled(name, margins, own) and 0 < held[:own].sum() < own:
                numbers[f"{HELD}{name}"] = held.astype(float)
        parts = {name: _sound(column, own) for name, column in numbers.items()}
        lost_ones = max((int((~np.isfinite(column)).sum()) for column in numbers.values()), default=0)
        means = {name: controlled(*three) for name, three in parts.items()}
        return Chance(sampling, own, found.lost, holds, spreads, controlled=means, uncontrolled=lost_ones)
    return found


def _sound(column: Floats, own: int) -> list[Floats]:
    """Dear answers and their cheap twins, of samples where both are finite, and the finite of the others."""
    dear, beside, more = np.split(column, [own, 2 * own])
    both = np.isfinite(dear) & np.isfinite(beside)
    return [dear[both], beside[both], more[np.isfinite(more)]]


def _without(column: Floats, own: int) -> bool:
    """Whether too few samples have an answer to correct their mean: the control may have none at all."""
    dear, _, more = _sound(column, own)
    return len(dear) < 3 or not len(more)


def _uncontrolled(name: str, margins: Mapping[str, Floats], own: int) -> bool:
    """Whether the control has no answer to a limit, or to one of all."""
    return any(np.isnan(column[own:]).all() for limit, column in margins.items() if name in (limit, ALL))


def wilson(holds: int, runs: int) -> Estimate:
    """Chance by independent runs, with the interval of Wilson (1927).

    Of Sobol' points and Latin hypercubes, whose counts scatter less, the interval holds the chance more often than stated.
    """
    share, squared = holds / runs, SIGMAS**2 / runs
    middle = (share + 0.5 * squared) / (1.0 + squared)
    half = SIGMAS * math.sqrt(share * (1.0 - share) / runs + 0.25 * squared / runs) / (1.0 + squared)
    return Estimate(share, max(middle - half, 0.0), min(middle + half, 1.0))


def _spread(values: Floats) -> Spread:
    sound = values[np.isfinite(values)]
    deviation = float(sound.std(ddof=1)) if len(sound) > 1 else math.nan
    return Spread(float(sound.mean()), deviation, tuple(map(float, np.quantile(sound, QUANTILES))))


def sobol_indices(blocks: Floats, inputs: Sequence[str], seed: int = 0) -> list[Index]:
    """First and total indices by A, B and A with one input from B; blocks: (inputs + 2, samples), finite.

    Estimators of Saltelli et al. (2010), table 2 (b) and (f), and of scipy.stats.sobol_indices, on answers less their mean;
    intervals by a bootstrap over samples. An answer that does not vary has the index NaN.
    """
    count = blocks.shape[1]
    random = np.random.default_rng(seed)
    first, total = _indices(blocks, np.arange(count))
    again = np.array([_indices(blocks, np.array(random.integers(0, count, count))) for _ in range(RESAMPLES)])
    tail = 0.5 - 0.5 * CONFIDENCE
    low, high = np.quantile(again, [tail, 1.0 - tail], axis=0) if count else np.full((2, 2, len(inputs)), math.nan)
    return [
        Index(
            name,
            Estimate(float(first[k]), float(low[0, k]), float(high[0, k])),
            Estimate(float(total[k]), float(low[1, k]), float(high[1, k])),
        )
        for k, name in enumerate(inputs)
    ]


def _indices(blocks: Floats, chosen: NDArray[np.int64]) -> tuple[Floats, Floats]:
    """First and total indices of some samples, each (inputs,)."""
    a, b, *mixed = blocks[:, chosen]
    mean = np.concatenate((a, b)).mean() if len(chosen) else math.nan
    a, b, ab = a - mean, b - mean, np.array(mixed) - mean
    variance = (np.concatenate((a, b)) ** 2).mean() if len(chosen) else math.nan
    variance = variance if variance > 0.0 else math.nan
    return (b * (ab - a)).mean(axis=1) / variance, 0.5 * ((a - ab) ** 2).mean(axis=1) / variance


def controlled(dear: Floats, beside: Floats, more: Floats) -> Controlled:
    """Mean of a dear answer (n,), by a cheap one at the same samples, beside (n,), and at others, more (m,); all independent.

    Each dear answer is corrected by c (cheap - mean of the others), with the c of all *other* samples: no sample has part in
    its own coefficient, so the mean is unbiased for any n > 2. c = covariance/(variance (1 + n/m)) takes off the most.
    """
    n, m = len(dear), len(more)
    x, y = beside - beside.mean(), dear - dear.mean()
    inverse = n / (n - 1.0)  # sums over all samples but one, about their own means
    still = ROUNDING * n * beside.mean() ** 2  # below which a control does not vary
    xx, xy = (x * x).sum() - inverse * x * x, (x * y).sum() - inverse * x * y
    fewer = 1.0 + (n - 1.0) / m
    coefficients = np.where(xx > still, xy / np.where(xx > still, xx, 1.0), 0.0) / fewer
    mean = float((dear - coefficients * (beside - more.mean())).mean())
    coefficient = float((x * y).sum() / (x * x).sum()) / (1.0 + n / m) if (x * x).sum() > still else 0.0
    plain = dear.var(ddof=1) / n
    rest = (y - coefficient * x).var(ddof=1) / n + coefficient**2 * more.var(ddof=1) / m
    return Controlled(_by_variance(mean, rest), _by_variance(float(dear.mean()), plain), coefficient, _saved(rest, plain))


def _by_variance(mean: float, variance: float) -> Estimate:
    half = SIGMAS * math.sqrt(variance)
    return Estimate(mean, mean - half, mean + half)


def _saved(rest: float, plain: float) -> float:
    return float(1.0 - rest / plain) if plain > 0.0 else 0.0
