"""The first look: least squares of a linear model inside the unit cube, and the shortest span of most of an error."""

import numpy as np
import pytest

from muslin.inference.criticism.linear import least_square
from muslin.inference.criticism.where import _shortest


def test_a_solution_inside_the_cube_is_found_and_its_square_told() -> None:
    rng = np.random.default_rng(0)
    j = 100 * rng.normal(size=(60, 3))
    truth = np.array([0.4, 0.6, 0.5])
    start = np.array([0.5, 0.5, 0.5])
    noise = rng.normal(size=60)
    white = noise - j @ (truth - start)
    at, rss = least_square(start, white, j)
    np.testing.assert_allclose(at, truth, atol=0.02)
    assert rss == pytest.approx(float(np.sum((white + j @ (at - start)) ** 2)), rel=1e-6)
    assert rss < noise @ noise + 1


def test_a_solution_outside_stops_at_the_wall() -> None:
    j = np.eye(2) * 50
    at, rss = least_square(np.array([0.5, 0.5]), np.array([-100.0, 5.0]), j)
    assert at[0] == pytest.approx(0.99, abs=1e-6)
    assert at[1] == pytest.approx(0.4, abs=0.01)
    assert rss > 75.0**2


def test_a_start_on_a_face_is_no_error() -> None:
    at, _ = least_square(np.array([0.0, 1.0]), np.array([-10.0, 5.0]), np.eye(2) * 50)
    assert at[0] == pytest.approx(0.2, abs=0.01)
    assert at[1] == pytest.approx(0.9, abs=0.01)


@pytest.mark.parametrize(
    ("weights", "span"), [([0, 0, 9, 0, 1], (2, 2)), ([1, 1, 1, 1, 1], (0, 2)), ([5, 0, 0, 0, 5], (0, 4))]
)
def test_the_shortest_span_holds_most(weights: list[float], span: tuple[int, int]) -> None:
    assert _shortest(np.array(weights, float)) == span
