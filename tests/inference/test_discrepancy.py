"""Numerical error as a nuisance: whitening by it is exact, and takes off what lies along it, no more."""

import numpy as np
import pytest

from muslin.inference.discrepancy import NONE, Discrepancy


@pytest.fixture
def directions() -> np.ndarray:
    return np.random.default_rng(0).normal(size=(40, 3)) * np.array([5.0, 1.0, 0.1])


def test_the_covariance_of_whitened_residuals_is_the_identity(directions: np.ndarray) -> None:
    d = Discrepancy({"fling": directions})
    w = np.stack([d.whitened("fling", e) for e in np.eye(40)], axis=1)
    np.testing.assert_allclose(w @ (np.eye(40) + directions @ directions.T) @ w.T, np.eye(40), atol=1e-10)


def test_without_directions_nothing_changes(directions: np.ndarray) -> None:
    white = np.arange(40.0)
    assert NONE.whitened("fling", white) is white
    np.testing.assert_array_equal(Discrepancy({"other": directions}).whitened("fling", white), white)


def test_what_lies_along_a_direction_is_taken_off_and_what_lies_across_is_not(directions: np.ndarray) -> None:
    d = Discrepancy({"fling": 20 * directions[:, :1]})
    along = 20 * directions[:, 0]
    across = np.random.default_rng(1).normal(size=40)
    across -= along * (across @ along) / (along @ along)
    seen = d.whitened("fling", along)
    assert seen @ seen < 1.0  # an amplitude of one is one standard deviation
    np.testing.assert_allclose(d.whitened("fling", across), across, atol=1e-10)
