"""Error bars: of three grids against Roache's published set, of grids beside one another, of another drop."""

import math

import numpy as np
import pytest
from scipy import stats

from softbrake.studies.convergence import CAUTION, NEIGHBOURLY, SAFETY, estimate, estimate_of_neighbours, prediction


def test_published_set() -> None:
    """Roache's worked example: .97050, .96854, .96178 at ratio 2 give order 1.786185, limit .971300, index 0.10308 %."""
    found = estimate(0.96178, 0.96854, 0.97050, 2.0)
    assert found.order == pytest.approx(1.786185, abs=2e-5)  # of rounded values
    assert found.limit == pytest.approx(0.971300, abs=2e-5)
    assert found.error / found.value == pytest.approx(0.0010308, abs=3e-8)


@pytest.mark.parametrize("ratio", [1.5, 2.0])
@pytest.mark.parametrize("order", [1.0, 1.5, 2.0])
def test_sequence_of_known_order(order: float, ratio: float) -> None:
    values = [3.0 - 0.2 * ratio ** (-order * k) for k in range(3)]
    found = estimate(*values, ratio)
    assert found.order == pytest.approx(order)
    assert found.limit == pytest.approx(3.0)
    assert found.error == pytest.approx(SAFETY * (3.0 - values[2]))
    assert found.trusted


def test_order_above_the_formal_one_is_not_believed() -> None:
    values = [1.0 + 0.1 * 2.0 ** (-4 * k) for k in range(3)]
    found = estimate(*values, 2.0)
    assert found.order == pytest.approx(4.0)
    assert found.error == pytest.approx(CAUTION * (values[1] - values[2]) / 3.0)
    values = [1.0 + 0.1 * 2.0 ** (-2.5 * k) for k in range(3)]
    assert estimate(*values, 2.0).error == pytest.approx(SAFETY * (values[1] - values[2]) / 3.0)


def test_doubtful_sequences_get_a_wider_bar_or_none() -> None:
    swinging = estimate(1.0, 1.2, 1.1, 2.0)
    assert not swinging.trusted and swinging.order is None and swinging.limit is None
    assert swinging.error == pytest.approx(CAUTION * 0.1)
    slow = estimate(1.0, 1.1, 1.18, 2.0)
    assert not slow.trusted and slow.error > CAUTION * 0.08
    assert estimate(1.0, 1.1, 1.3, 2.0).error == math.inf
    assert estimate(2.0, 2.0, 2.0, 2.0).error < 1e-11


def test_grids_that_agree_by_accident_are_no_certainty() -> None:
    assert estimate(1.0, 1.2, 1.2, 2.0).error == math.inf
    assert estimate(3.0, 0.0, 0.0, 1.5).error == math.inf  # and no division by zero
    assert estimate(0.0, 0.0, 0.0, 1.5).error == 0.0
    nearly = estimate(1.0, 1.2, 1.2 + 1e-9, 2.0)
    assert nearly.error == pytest.approx(CAUTION * 0.2 / 2.0**4 / 3.0)  # as if the difference had fallen at order 4


def test_differences_that_hardly_fall_give_no_bound() -> None:
    assert estimate(1.0, 1.1, 1.19, 2.0).error == math.inf


# Grids beside one another

BESIDE = (18, 22, 26, 32, 38)


def series(order: float, limit: float = 3.0, part: float = 1.0) -> list[float]:
    return [limit + part * (10.0 / n) ** order for n in BESIDE]


@pytest.mark.parametrize("part", [-1.0, 1e-3, 1.0])
@pytest.mark.parametrize("order", [1.0, 2.0])
def test_neighbours_of_known_order_give_their_limit(order: float, part: float) -> None:
    values = series(order, part=part)
    found = estimate_of_neighbours(BESIDE, values)
    assert (found.order, found.value, found.trusted) == (order, values[-1], True)
    assert found.limit == pytest.approx(3.0, abs=1e-12)
    assert found.error == pytest.approx(NEIGHBOURLY * abs(values[-1] - 3.0), rel=1e-6)


@pytest.mark.parametrize("order", [0.9, 1.0, 1.3, 1.5, 1.7, 1.9, 2.0, 2.5])
def test_bar_of_neighbours_holds_the_limit_of_other_orders(order: float) -> None:
    found = estimate_of_neighbours(BESIDE, series(order))
    assert abs(found.value - 3.0) <= found.error


def test_order_of_the_grids_is_no_matter() -> None:
    values = [value + 0.01 * (-1) ** n for n, value in enumerate(series(1.5))]
    found = estimate_of_neighbours(BESIDE, values)
    turned = estimate_of_neighbours(BESIDE[::-1], values[::-1])
    assert (turned.value, turned.order) == (found.value, found.order)
    assert turned.error == pytest.approx(found.error)


def test_scatter_widens_the_bar() -> None:
    """By more than it is; and the limit is inside in 19 of 20 cases."""
    none = estimate_of_neighbours(BESIDE, series(2.0)).error
    bars = []
    for size in (0.01, 0.1):
        values = [value + size * (-1) ** n for n, value in enumerate(series(2.0))]
        bars.append(estimate_of_neighbours(BESIDE, values).error)
    assert none + 0.01 < bars[0] < bars[1] - 0.1
    random = np.random.default_rng(0)
    for order in (1.0, 2.0):
        held = 0
        for _ in range(1000):
            found = estimate_of_neighbours(BESIDE, list(np.array(series(order)) + 0.02 * random.normal(size=5)))
            held += abs(found.value - 3.0) <= found.error
        assert held >= 950


def test_neighbours_that_agree_by_accident_are_no_certainty() -> None:
    """However near the finest two or three are, the bar is that of all."""
    for values in ([1.0, 1.2, 0.9, 1.1, 1.1], [1.2, 0.9, 1.1, 1.1, 1.1], [1.1, 1.2, 1.1, 1.0, 1.1]):
        assert estimate_of_neighbours(BESIDE, values).error > 0.1
    assert estimate_of_neighbours(BESIDE, [1.1] * 5).error < 1e-11


def test_one_neighbour_far_off_is_scatter() -> None:
    far = series(2.0)
    far[1] += 1.0
    assert estimate_of_neighbours(BESIDE, far).error > 0.5


# Another drop


@pytest.mark.parametrize("count", [2, 3, 4, 8, 12, 17, 18])
def test_prediction_is_that_of_student(count: int) -> None:
    """mean ± t s sqrt(1 + 1/n), t of n - 1 degrees of freedom."""
    values = np.random.default_rng(count).normal(3.0, 0.1, count)
    mean, bar = prediction(list(values))
    t = stats.t.ppf(0.975, min(count - 1, 15))
    assert mean == pytest.approx(values.mean())
    assert bar == pytest.approx(t * values.std(ddof=1) * math.sqrt(1.0 + 1.0 / count), rel=1e-3)


@pytest.mark.parametrize("count", [1, 2, 5])
def test_prediction_takes_the_spread_of_other_values_too(count: int) -> None:
    """Pooled variance of two groups, each about its own mean: Student's t of n + m - 2 degrees of freedom."""
    random = np.random.default_rng(count)
    values, beside = random.normal(3.0, 0.1, count), random.normal(4.0, 0.1, 4)
    mean, bar = prediction(list(values), list(beside))
    pooled = np.concatenate([values - values.mean(), beside - beside.mean()])
    degrees = count + 2
    spread = math.sqrt((pooled**2).sum() / degrees)
    assert mean == pytest.approx(values.mean())
    assert bar == pytest.approx(stats.t.ppf(0.975, degrees) * spread * math.sqrt(1.0 + 1.0 / count), rel=1e-3)


def test_one_drop_predicts_no_other() -> None:
    assert prediction([3.0]) == (3.0, math.inf)
    assert prediction([3.0], [4.0]) == (3.0, math.inf)


@pytest.mark.parametrize("others", [0, 3])
@pytest.mark.parametrize("count", [2, 4, 8])
def test_prediction_holds_another_drop_in_19_of_20_cases(count: int, others: int) -> None:
    random, trials, held = np.random.default_rng(count), 4000, 0
    for _ in range(trials):
        *values, other = random.normal(3.0, 0.1, count + 1)
        mean, bar = prediction(values, random.normal(2.0, 0.1, others).tolist())
        held += abs(other - mean) <= bar
    assert held / trials == pytest.approx(0.95, abs=0.012)
