"""A simulated mesh as a detector would have seen it: the projection, with flaws that a seed decides."""

import pickle
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from simulated import TIME, take

from muslin.core.errors import InputError, RolloutFailed
from muslin.core.obstacles import Cylinder
from muslin.core.series import PointSeries
from muslin.perception.mesh import MeshExtractor

#: Between the camera and the middle column of the cloth.
ROD = Cylinder(np.array([0.015, -0.3, 0.0]), np.array([0.0, 0.0, 1.0]), 0.012, 2.0)


def test_without_flaws_it_is_the_projection() -> None:
    found = MeshExtractor(occluded=False).observe(take())
    np.testing.assert_array_equal(found.points, take().projected().points)
    assert found.unit == "px" and found.correspondence
    clean = take().projected()
    np.testing.assert_array_equal(MeshExtractor().extract(clean, TIME).points, clean.points)


def test_noise_and_misses_are_as_large_as_asked_for() -> None:
    still = take().projected()
    long = PointSeries(np.arange(400) / 10.0, np.repeat(still.points[:1], 400, axis=0), "px")
    found = MeshExtractor(noise=2.0, missed=0.1).extract(long, long.time)
    off = found.points - long.points
    assert np.nanstd(off) == pytest.approx(2.0, rel=0.02) and np.nanmean(off) == pytest.approx(0.0, abs=0.05)
    assert found.valid.mean() == pytest.approx(0.9, abs=0.01)


def test_shuffled_points_are_the_same_set_in_another_order() -> None:
    found = MeshExtractor(permuted=True, occluded=False).observe(take())
    assert not found.correspondence
    for spots, right in zip(found.points, take().projected().points, strict=True):
        assert not np.array_equal(spots, right)
        np.testing.assert_array_equal(spots[np.lexsort(spots.T)], right[np.lexsort(right.T)])


def test_what_a_rod_hides_is_not_seen() -> None:
    hidden = ~MeshExtractor().observe(take("cloth", ROD)).valid
    columns = hidden[0].reshape(7, 7).all(axis=0)
    assert columns.tolist() == [False, False, False, True, False, False, False]
    assert not (~MeshExtractor(occluded=False).observe(take("cloth", ROD)).valid).any()


def test_the_same_take_gets_the_same_flaws_and_another_one_others() -> None:
    made = MeshExtractor(noise=1.0, missed=0.2, permuted=True)
    first = made.observe(take()).points
    again = pickle.loads(pickle.dumps(made)).observe(take()).points
    np.testing.assert_array_equal(first, again)
    other = made.observe(take(shift=1e-6)).points
    assert not np.array_equal(np.isnan(first), np.isnan(other))
    seeded = MeshExtractor(noise=1.0, missed=0.2, permuted=True, seed=1).observe(take()).points
    assert not np.array_equal(np.isnan(first), np.isnan(seeded))


@pytest.mark.parametrize(("points", "count"), [("markers", 49), ("vertices", 49), ("keypoints", 4)])
def test_points_are_those_asked_for(points: Any, count: int) -> None:
    assert MeshExtractor(points, occluded=False).observe(take()).points.shape == (4, count, 2)
    corners = MeshExtractor("keypoints", occluded=False).observe(take()).points
    np.testing.assert_allclose(corners, take().projected().points[:, [0, 6, 42, 48]])


def test_a_take_out_of_view_is_a_failed_draw() -> None:
    with pytest.raises(RolloutFailed, match="out of view"):
        MeshExtractor().observe(take(shift=1000.0))


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"noise": -1.0}, "0 px or more"),
        ({"missed": 1.0}, "under 1"),
        ({"points": "corners"}, "'keypoints'"),
        ({"count": 0}, "1 or more"),
        ({"seed": -1}, "0 or more"),
    ],
)
def test_options_that_cannot_be_are_refused(options: dict[str, Any], told: str) -> None:
    with pytest.raises(InputError, match=told):
        MeshExtractor(**options)


def test_no_camera_and_noise_on_metres_are_refused() -> None:
    with pytest.raises(InputError, match="needs a camera"):
        MeshExtractor().observe(replace(take(), camera=None))
    with pytest.raises(InputError, match="in metres"):
        MeshExtractor(noise=1.0).extract(take().series, TIME)
