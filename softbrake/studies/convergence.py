"""Error bars: of three grids by Roache's grid convergence index, of neighbouring ones by least squares, of ensembles."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import fmean

FORMAL_ORDER = 2.0  # of the scheme in space and time
SAFETY = 1.25  # of an index from three grids that converge as they should (ASME V&V 20)
NEIGHBOURLY = 2.0  # of a limit by neighbouring grids, whose order may lie between those fitted
DEVIATIONS = 3.0  # of values from such a fit, of which a few grids tell little
CAUTION = 3.0  # of one from grids that do not
LEAST_ORDER = 0.3  # below it the bar is many times the differences, and means nothing


@dataclass(frozen=True)
class Estimate:
    """What three values on grids of constant refinement ratio say about the finest of them."""

    value: float  # on the finest grid
    order: float | None  # observed; None where the differences hardly fall, or change sign
    limit: float | None  # extrapolated, at the observed order
    error: float  # estimated bound of |value - limit|, the index times |value|; inf where none can be told
    trusted: bool  # whether the observed order is near the formal one


def estimate(coarse: float, medium: float, fine: float, ratio: float, formal: float = FORMAL_ORDER) -> Estimate:
    """Return order, limit and error bar of the finest of three values, cells shrinking by `ratio` from one to the next.

    order = ln((coarse - medium)/(medium - fine))/ln(ratio); error = safety |medium - fine|/(ratio^order - 1), the order not taken
    above the formal one. The safety factor is 1.25, and 3 where the observed order is unreasonable: above one and a half times
    the formal one, where errors of two kinds cancel; or below about half of it, or none as differences change sign, and then the
    order is taken as 1 at most. Finer grids may agree by accident: where the second difference falls faster than at twice the
    formal order, it is taken as large as that. Differences that hardly fall, or a second one of round-off only, give no bound.
    Roache, J. Fluids Eng. 116 (1994).
    """
    first, second = coarse - medium, medium - fine
    floor = 1e-12 * max(abs(fine), abs(medium), abs(coarse))
    if abs(second) <= floor and abs(first) <= floor:
        return Estimate(fine, None, fine, floor, True)
    if abs(second) <= floor or abs(second) >= abs(first):
        return Estimate(fine, None, None, math.inf, False)
    order = math.log(abs(first) / abs(second)) / math.log(ratio)
    if order < LEAST_ORDER:
        return Estimate(fine, None, None, math.inf, False)
    monotone = first * second >= 0.0
    steep = order > 0.49 * formal
    trusted = monotone and steep and order < 1.5 * formal
    used = min(order, formal) if monotone and steep else min(order, formal, 1.0)
    least = abs(first) / ratio ** (2.0 * formal)
    error = (SAFETY if trusted else CAUTION) * max(abs(second), least) / (ratio**used - 1.0)
    limit = fine - second / (ratio**order - 1.0) if monotone else None
    return Estimate(fine, order if monotone else None, limit, error, trusted)


def estimate_of_neighbours(cells: Sequence[int], values: Sequence[float]) -> Estimate:
    """Return limit and error bar of the finest of four values or more, on grids of so many cells in any order.

    Least squares of a + b h^p for p = 1 and 2. The one that leaves less is taken, and where it leaves more than a quarter of the
    other's squares, the one whose limit is further from the finest value. error = 2 |finest - a| + 3 standard deviations of the
    values from the fit, so grids that scatter have a wide bar, however near two or three of them are. One value that is far off
    counts as scatter.
    """
    finest = max(cells)
    value = values[list(cells).index(finest)]
    fits = []
    for order in (1.0, 2.0):
        x = [(finest / n) ** order for n in cells]
        mean_x, mean = fmean(x), fmean(values)
        slope = sum((a - mean_x) * (b - mean) for a, b in zip(x, values, strict=True)) / sum((a - mean_x) ** 2 for a in x)
        left = sum((b - mean - slope * (a - mean_x)) ** 2 for a, b in zip(x, values, strict=True))
        fits.append((left, order, mean - slope * mean_x))
    fits.sort()
    (least, order, limit), (other, other_order, other_limit) = fits
    clear = least < 0.25 * other
    if not clear and abs(value - other_limit) > abs(value - limit):
        order, limit = other_order, other_limit
    scatter = math.sqrt(least / (len(values) - 2))
    floor = 1e-12 * max(map(abs, values))
    error = NEIGHBOURLY * abs(value - limit) + DEVIATIONS * scatter + floor
    return Estimate(value, order if clear else None, limit, error, clear)


# Student's t of 95 %, two-sided, by degrees of freedom from 1 on; beyond the list that of the last is taken
STUDENT = (12.71, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228, 2.201, 2.179, 2.160, 2.145, 2.131)


def prediction(values: Sequence[float], beside: Sequence[float] = ()) -> tuple[float, float]:
    """Return the mean of some values, and by how much another one differs from it at most in 19 of 20 cases; inf of one value.

    beside: values about a mean of their own, with the same spread; the variance is that of both, pooled.
    """
    mean = fmean(values)
    groups = [group for group in (values, beside) if group]
    degrees = sum(len(group) - 1 for group in groups)
    if degrees < 1:
        return mean, math.inf
    squares = sum((value - fmean(group)) ** 2 for group in groups for value in group)
    return mean, STUDENT[min(degrees, len(STUDENT)) - 1] * math.sqrt(squares / degrees * (1.0 + 1.0 / len(values)))
