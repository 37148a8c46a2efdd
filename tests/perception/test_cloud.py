"""Clouds lie on the surface that the camera sees, from depth as from the simulated mesh."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.spatial import cKDTree
from simulated import TIME, pictures, take

from muslin.core.errors import InputError, RolloutFailed
from muslin.core.surface import object_surface
from muslin.perception.cloud import CloudExtractor


@pytest.mark.parametrize("kind", ["cloth", "rope", "solid"])
def test_depth_and_mesh_give_the_same_surface(kind: str) -> None:
    made = CloudExtractor(points=200)
    drawn, sampled = made.extract(pictures(kind), TIME), made.observe(take(kind))
    assert (drawn.unit, drawn.correspondence, drawn.points.shape) == ("m", False, (4, 200, 3))
    assert (sampled.unit, sampled.correspondence, sampled.points.shape) == ("m", False, (4, 200, 3))
    for one, other in zip(drawn.points, sampled.points, strict=True):
        one, other = (p[np.isfinite(p).all(axis=1)] for p in (one, other))
        assert min(len(one), len(other)) > 60
        there, back = cKDTree(one).query(other)[0], cKDTree(other).query(one)[0]
        assert max(np.median(there), np.median(back)) < 0.02 and max(there.max(), back.max()) < 0.045
        np.testing.assert_allclose(one.mean(axis=0), other.mean(axis=0), atol=0.012)


def test_only_the_side_that_is_seen_is_sampled() -> None:
    found = CloudExtractor().observe(take("solid")).points
    assert np.nanmax(found[..., 1]) < 0.061 and np.nanmin(found[..., 1]) == pytest.approx(-0.06, abs=1e-6)
    back = np.abs(found[..., 1] - 0.06) < 1e-9  # the face away from the camera
    assert back.mean() < 0.05  # its rim alone


def test_samples_lie_on_the_surface() -> None:
    shown = take("rope")
    found = CloudExtractor().observe(shown).points[0]
    found = found[np.isfinite(found).all(axis=1)]
    surface = object_surface(shown.scene)
    corners = surface.place(shown.vertices[0])[surface.triangles]
    line = shown.vertices[0]
    direction = (line[-1] - line[0]) / np.linalg.norm(line[-1] - line[0])
    apart = np.linalg.norm(np.cross(found - line[0], direction), axis=1)
    widest = np.linalg.norm(np.cross(corners.reshape(-1, 3) - line[0], direction), axis=1).max()
    assert apart.max() <= widest + 1e-9 and np.median(apart) > 0.9 * widest


def test_holes_are_left_out_and_a_box_cuts() -> None:
    frames = pictures()
    assert frames.depth is not None
    depth = frames.depth.copy()
    depth[1] = np.nan
    depth[2, ::2] = 0.0
    found = CloudExtractor().extract(replace(frames, depth=depth), TIME)
    assert found.valid.sum(axis=1)[[0, 1]].tolist() == [128, 0] and found.valid[2].any()
    upper = CloudExtractor(box=[[-1, -1, -0.1], [1, 1, 1]]).extract(frames, TIME).points
    assert np.nanmin(upper[..., 2]) >= -0.1 and np.nanmax(upper[..., 2]) < 0.01


def test_points_are_as_dense_everywhere() -> None:
    found = CloudExtractor(points=100).extract(pictures(), TIME).points[0]
    quarters = np.histogram2d(found[:, 0], found[:, 2], bins=2)[0]
    assert quarters.min() >= 15 and quarters.max() <= 35


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"depth": None}, "needs depth"),
        ({"camera": None}, "needs the camera"),
        ({"depth": np.full((4, 120, 160), np.nan, np.float32)}, "no pixel of the object has depth"),
        ({"rgb": np.full((4, 120, 160, 3), 128, np.uint8)}, "pictures are grey 100%"),
    ],
)
def test_frames_that_do_not_do_are_refused(change: dict[str, Any], told: str) -> None:
    with pytest.raises(InputError, match=told):
        CloudExtractor().extract(replace(pictures(), **change), TIME)


def test_a_take_out_of_view_is_a_failed_draw_and_one_without_camera_is_refused() -> None:
    with pytest.raises(RolloutFailed, match="out of view"):
        CloudExtractor().observe(take(shift=1000.0))
    with pytest.raises(InputError, match="needs a camera"):
        CloudExtractor().observe(take(seen=False))


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"box": [[0, 0, 0], [1, 1, -1]]}, "low and its high corner"),
        ({"box": "all"}, "low and its high corner"),
        ({"points": 0}, "1 or more"),
        ({"voxel": 0.0}, "0.00001 to 1 m"),
    ],
)
def test_options_that_cannot_be_are_refused(options: dict[str, Any], told: str) -> None:
    with pytest.raises(InputError, match=told):
        CloudExtractor(**options)
