"""Error bars from three grids: Richardson's extrapolation and Roache's grid convergence index."""

from __future__ import annotations

import math
from dataclasses import dataclass

FORMAL_ORDER = 2.0  # of the scheme in space and time
SAFETY = 1.25  # of an index from three grids that converge as they should (ASME V&V 20)
CAUTION = 3.0  # of one from grids that do not


@dataclass(frozen=True)
class Estimate:
    """What three values on grids of constant refinement ratio say about the finest of them."""

    value: float  # on the finest grid
    order: float | None  # observed; None where the differences do not fall, or change sign
    limit: float | None  # extrapolated, at the observed order
    error: float  # estimated bound of |value - limit|, the index times |value|; inf where the differences do not fall
    trusted: bool  # whether the observed order is near the formal one


def estimate(coarse: float, medium: float, fine: float, ratio: float, formal: float = FORMAL_ORDER) -> Estimate:
    """Return order, limit and error bar of the finest of three values, cells shrinking by `ratio` from one to the next.

    order = ln((coarse - medium)/(medium - fine))/ln(ratio); error = safety |medium - fine|/(ratio^order - 1), the order not taken
    above the formal one. The safety factor is 1.25, and 3 where the observed order is unreasonable: above one and a half times
    the formal one, where errors of two kinds cancel; or below half of it, or none as differences change sign, and then the order
    is taken as 1 at most. Differences that do not fall at all give no bound. Roache, J. Fluids Eng. 116 (1994).
    """
    first, second = coarse - medium, medium - fine
    floor = 1e-12 * max(abs(fine), abs(medium))
    if abs(second) <= floor and abs(first) <= floor:
        return Estimate(fine, None, fine, floor, True)
    if abs(second) >= abs(first):
        return Estimate(fine, None, None, math.inf, False)
    order = math.log(abs(first) / max(abs(second), floor)) / math.log(ratio)
    monotone = first * second >= 0.0
    steep = order > 0.49 * formal
    trusted = monotone and steep and order < 1.5 * formal
    used = min(order, formal) if monotone and steep else min(order, formal, 1.0)
    error = (SAFETY if trusted else CAUTION) * abs(second) / (ratio**used - 1.0)
    limit = fine - second / (ratio**order - 1.0) if monotone else None
    return Estimate(fine, order if monotone else None, limit, error, trusted)
