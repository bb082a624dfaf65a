"""Error bars from three grids against Roache's published set and made-up sequences of known order."""

import math

import pytest

from softbrake.convergence import CAUTION, SAFETY, estimate


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
