"""Markers of a bent sheet laid flat: distances along the sheet, whatever way it bends."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from muslin.cli.unrolling import unrolled

#: Markers on a flat sheet of 0.3 x 0.25 m, not quite evenly.
SHEET = np.array([[0.05 * i + 0.01 * np.sin(7 * i + j), 0.05 * j] for i in range(7) for j in range(6)])


def rolled(radius: float, angle: float) -> np.ndarray:
    """The sheet on a cylinder whose axis is at an angle to its edges ``(42, 3)``."""
    along = SHEET @ [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    turn = along[:, 0] / radius
    return np.stack([radius * np.sin(turn), along[:, 1], radius * (1 - np.cos(turn))], axis=1)


def distances(points: np.ndarray) -> np.ndarray:
    return np.linalg.norm(points[:, None] - points[None], axis=2)


@given(st.floats(0.12, 1.0), st.floats(0.0, 3.0), st.tuples(*[st.floats(-3.0, 3.0)] * 3), st.integers(0, 9))
def test_a_sheet_on_a_cylinder_is_unrolled(radius: float, angle: float, turn: tuple, seed: int) -> None:
    """But for what a chord between neighbours is shorter than the sheet, wherever it is and in whatever order."""
    order = np.random.default_rng(seed).permutation(len(SHEET))
    found = unrolled(Rotation.from_rotvec(turn).apply(rolled(radius, angle))[order] + 0.3)
    assert found is not None and found.shape == (42, 2)
    np.testing.assert_allclose(found.mean(axis=0), 0.0, atol=1e-9)
    np.testing.assert_allclose(distances(found), distances(SHEET[order]), rtol=0.035, atol=1e-3)


def test_noise_moves_places_by_little_more_than_itself() -> None:
    noise = 0.002 * np.random.default_rng(0).normal(size=(42, 3))
    found = unrolled(rolled(0.2, 0.4) + noise)
    assert found is not None
    assert np.sqrt(np.mean((distances(found) - distances(SHEET)) ** 2)) < 0.005


def test_of_many_markers_some_are_unrolled_and_the_others_follow() -> None:
    flat = np.array([[x, z] for z in np.linspace(0.0, 0.3, 30) for x in np.linspace(0.0, 0.4, 30)])
    turn = flat[:, 0] / 0.15
    found = unrolled(np.stack([0.15 * np.sin(turn), 0.15 * np.cos(turn), flat[:, 1]], axis=1))
    assert found is not None
    np.testing.assert_allclose(found.mean(axis=0), 0.0, atol=1e-9)
    np.testing.assert_allclose(distances(found), distances(flat), atol=0.004)


@pytest.mark.parametrize(
    "points",
    [
        rolled(0.2, 0.0)[:8],  # too few
        rolled(0.03, 0.0),  # rolled up, in layers
        np.vstack([rolled(0.2, 0.0)[:20], rolled(0.2, 0.0)[:20] + 5.0]),  # two of them
        np.random.default_rng(0).normal(size=(30, 3)),  # no sheet
    ],
)
def test_what_is_no_sheet_or_folds_is_not_unrolled(points: np.ndarray) -> None:
    assert unrolled(points) is None
