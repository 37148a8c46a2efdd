"""Places spread over an object: where they lie, how evenly, and what they are weights of."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from muslin.core.body import Body, cloth_grid, rope_line, solid_box
from muslin.core.subsets import thinned
from muslin.core.surface_samples import spread_over, surface_weights


def sheet() -> Body:
    """Two by one metres, in cells that are not square."""
    return cloth_grid(2.0, 1.0, 4, 9)


@pytest.mark.parametrize("body", [sheet(), rope_line(np.array([[0.0, 0, 0], [1.0, 0, 0]]), 7)], ids=["cloth", "rope"])
def test_weights_are_convex_and_of_one_element(body: Body) -> None:
    weights = surface_weights(body, 500)
    assert weights.shape == (500, len(body.vertices)) and weights.min() >= 0.0
    np.testing.assert_allclose(weights.sum(axis=1), 1.0)
    corners = {frozenset(e) for e in body.elements.tolist()}
    for row in weights:
        assert any(set(np.flatnonzero(row)) <= corner for corner in corners)


def test_a_sheet_is_covered_in_proportion_to_its_area() -> None:
    body = sheet()
    places = surface_weights(body, 2000) @ body.vertices
    low = body.vertices.min(axis=0)
    counts = np.histogram2d(places[:, 0] - low[0], places[:, 2] - low[2], bins=(8, 4), range=[[0, 2], [0, 1]])[0]
    assert counts.sum() == 2000 and np.abs(counts / (2000 / 32) - 1).max() < 0.35


def test_a_solid_has_them_on_its_skin() -> None:
    body = solid_box(np.zeros(3), np.array([1.0, 2.0, 3.0]), (3, 3, 3))
    places = surface_weights(body, 300) @ body.vertices
    on_a_face = np.isclose(places, 0.0) | np.isclose(places, [1.0, 2.0, 3.0])
    assert on_a_face.any(axis=1).all()
    share = [np.isclose(places[:, axis], 0.0).mean() for axis in range(3)]
    np.testing.assert_allclose(share, np.array([6.0, 3.0, 2.0]) / 22, atol=0.02)


def test_along_a_rope_they_are_evenly_apart() -> None:
    body = rope_line(np.array([[0.0, 0, 0], [1.0, 0, 0]]), 7)
    along = (surface_weights(body, 50) @ body.vertices)[:, 0]
    np.testing.assert_allclose(along, (np.arange(50) + 0.5) / 50, atol=1e-12)


@given(st.integers(1, 200), st.integers(0, 2**32 - 1))
def test_places_lie_within_their_triangles(count: int, seed: int) -> None:
    corners = np.random.default_rng(seed).normal(size=(5, 3, 3))
    which, a, b = spread_over(corners, count)
    assert which.shape == a.shape == b.shape == (count,)
    assert which.min() >= 0 and which.max() < 5
    assert min(a.min(), b.min(), (1 - a - b).min()) >= -1e-12


def test_thinning_leaves_one_point_a_voxel() -> None:
    rng = np.random.default_rng(0)
    places = rng.uniform(-0.1, 0.1, (5000, 3)) * (1, 1, 0)
    kept = thinned(places, 0.01, 10_000)
    cells = np.unique(np.floor(kept / 0.01), axis=0)
    assert len(kept) == len(cells) == 400
    assert len(thinned(places, 0.01, 50)) == 50
    assert len(thinned(places[:0], 0.01, 50)) == 0
