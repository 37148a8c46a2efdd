"""Least squares by secants: few steps where residuals are smooth, and none that small kinks stop."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import least_squares

from muslin.core.arrays import FloatArray
from muslin.inference.secants import Found, search

MATRIX = np.random.default_rng(0).normal(size=(60, 4)) * 20
NOISE = np.random.default_rng(1).normal(size=60)
TRUE = np.array([0.4, 0.7, 0.2, 1.0])


class Counted:
    """Residuals of a function of one point, and how often they were asked for."""

    def __init__(self, white: Callable[[FloatArray], FloatArray | None]) -> None:
        self.white, self.points, self.right = white, list[FloatArray](), False

    def __call__(self, units: FloatArray) -> list[FloatArray | None]:
        self.points.extend(units)
        return [self.white(u) for u in units]

    def search(self, start: FloatArray, evaluations: int = 100, **how: float) -> Found:
        white = self.white(start)
        assert white is not None
        begin = Found(start, white, np.zeros((len(white), len(start))))
        found, used, self.right = search(self, begin, evaluations, **{"enough": 1e-5, "least": 1e-4, **how})  # type: ignore[arg-type]
        assert len(self.points) <= used + 2 * len(start) and used <= evaluations
        return found


def linear(unit: FloatArray) -> FloatArray:
    return np.asarray(MATRIX @ (unit - TRUE) + NOISE)


def curved(unit: FloatArray) -> FloatArray:
    return np.asarray(MATRIX @ (np.exp(2.0 * unit) - np.exp(2.0 * TRUE)) + NOISE)


@settings(max_examples=20)
@given(st.lists(st.floats(0.0, 1.0), min_size=4, max_size=4))
def test_the_least_square_within_the_cube(start: list[float]) -> None:
    for function, most in ((linear, 12), (curved, 40)):
        best = least_squares(function, np.full(4, 0.5), bounds=(0.0, 1.0), xtol=1e-10, ftol=1e-10)
        counted = Counted(function)
        found = counted.search(np.array(start))
        assert found.rss < 2.0 * best.cost * 1.01
        assert len(counted.points) <= most
        assert all((p >= 0.0).all() and (p <= 1.0).all() for p in counted.points)


def test_derivatives_are_those_of_a_linear_function() -> None:
    counted = Counted(linear)
    np.testing.assert_allclose(counted.search(np.full(4, 0.3)).jacobian, MATRIX, rtol=1e-6)
    assert counted.right


def test_kinks_that_stop_derivatives_do_not_stop_it() -> None:
    """A staircase: small differences are zero nearly everywhere."""

    def flat(unit: FloatArray) -> FloatArray:
        return np.asarray(MATRIX @ (np.round(unit * 200.0) / 200.0 - TRUE) + NOISE)

    start = np.array([0.831, 0.121, 0.513, 0.443])
    stopped = least_squares(flat, start, bounds=(0.0, 1.0))
    np.testing.assert_array_equal(stopped.x, start)
    smooth = 2.0 * least_squares(linear, start, bounds=(0.0, 1.0)).cost
    counted = Counted(flat)
    assert counted.search(start).rss < 1.3 * smooth < 0.01 * stopped.cost
    assert not counted.right


def test_what_cannot_be_simulated_is_kept_away_from() -> None:
    counted = Counted(lambda u: None if u[0] > 0.45 else linear(u))
    found = counted.search(np.array([0.44, 0.2, 0.9, 0.5]))
    np.testing.assert_allclose(found.unit, TRUE, atol=0.02)


def test_a_corner_beside_which_nothing_can_be_simulated_is_left_alone() -> None:
    """An effect of zero whose least strength tears the object, and a parameter that does nothing."""
    counted = Counted(lambda u: None if u[0] > 0.0 else linear(u * [1, 1, 1, 0]))
    found = counted.search(np.zeros(4))
    assert found.unit[0] == 0.0
    best = least_squares(lambda v: linear(np.array([0.0, *v, 0.0])), [0.5, 0.5], bounds=(0.0, 1.0))
    assert found.rss < 2.0 * best.cost * 1.01


def test_known_derivatives_need_no_differences() -> None:
    counted = Counted(linear)
    start = np.full(4, 0.6)
    found, used, _ = search(counted, Found(start, linear(start), MATRIX), 50, enough=1e-5, least=1e-4, known=True)
    assert len(counted.points) == used <= 8
    np.testing.assert_allclose(found.unit, TRUE, atol=0.02)


@pytest.mark.parametrize("evaluations", [0, 1, 3])
def test_it_keeps_to_its_budget(evaluations: int) -> None:
    counted = Counted(curved)
    start = np.full(4, 0.9)
    found = counted.search(start, evaluations)
    assert len(counted.points) <= 4 + evaluations
    assert found.rss <= float(curved(start) @ curved(start))


def test_roughness_of_a_model_that_is_far_off_is_not_gone_into() -> None:
    """Thousands of times what noise leaves stay, whatever is done, and less than a hundredth of it scatters."""

    def rough(unit: FloatArray) -> FloatArray:
        scatter = np.random.default_rng(np.frombuffer(unit.tobytes(), np.uint32)).normal(size=60)
        return np.concatenate([linear(unit), [80.0] * 60, 3.0 * scatter])

    start, freely, soon = np.full(4, 0.5), Counted(rough), Counted(rough)
    told = {"enough": 1e-6, "least": 1e-4}
    far, near = freely.search(start, noise=np.inf, **told), soon.search(start, noise=120.0, **told)
    assert len(soon.points) < 0.6 * len(freely.points)
    assert near.rss < 1.01 * far.rss
