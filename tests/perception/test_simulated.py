"""Annotated frames from simulations."""

import numpy as np
import pytest

from muslin.core.body import cloth_grid
from muslin.core.camera import Camera
from muslin.core.errors import InputError
from muslin.core.keypoints import keypoint_weights
from muslin.core.material import ClothMaterial
from muslin.core.obstacles import Cylinder
from muslin.core.scene import Scene
from muslin.core.series import PointSeries
from muslin.core.simulated_take import SimulatedTake
from muslin.perception.randomisation import random_appearance, shaken
from muslin.perception.simulated import simulated_annotations, training_set

CAMERA = Camera.look_at(np.array([0.0, -1.0, -0.1]), np.array([0.0, 0.0, -0.1]), width=96, height=80)
SHEET = cloth_grid(0.2, 0.2, 5, 5)


def test_annotations_lie_on_the_drawn_corners_and_what_a_post_hides_is_nan() -> None:
    post = Cylinder(np.array([-0.05, -0.5, 0.0]), np.array([0.0, 0.0, 1.0]), 0.02, 0.1)
    scene = Scene(SHEET, ClothMaterial(), np.zeros(3), (), np.zeros(25), (post,))
    vertices = np.repeat(SHEET.vertices[None], 2, axis=0)
    take = SimulatedTake(PointSeries(np.array([0.0, 1.0]), vertices), vertices, scene, CAMERA)
    frames, points = simulated_annotations(take, keypoint_weights(SHEET, 4))
    assert frames.rgb.shape == (2, 80, 96, 3)
    assert np.isnan(points[:, 0]).all()  # the upper left one
    np.testing.assert_allclose(points[0, 1:], CAMERA.project(SHEET.vertices[[4, 20, 24]])[0])
    background = frames.rgb[0, 0, 0].astype(int)
    for (u, v), inward in zip(points[0, 1:], ([-2, 2], [2, -2], [-2, -2]), strict=True):
        inside, outside = (np.round([v + s * inward[1], u + s * inward[0]]).astype(int) for s in (1, -1))
        assert np.abs(frames.rgb[0, inside[0], inside[1]].astype(int) - background).sum() > 30
        assert np.abs(frames.rgb[0, outside[0], outside[1]].astype(int) - background).sum() == 0


def test_looks_and_cameras_follow_the_seed() -> None:
    one, two, other = (random_appearance(np.random.default_rng(seed), 2) for seed in (1, 1, 2))
    assert np.array_equal(one.background, two.background) and one.light == two.light != other.light
    moved = shaken(CAMERA, np.random.default_rng(0))
    apart = np.linalg.norm(moved.project(SHEET.vertices)[0] - CAMERA.project(SHEET.vertices)[0], axis=1)
    assert 0.1 < apart.max() < 20.0


@pytest.mark.slow
def test_a_training_set_is_the_same_for_the_same_seed() -> None:
    one, two = (training_set("fling", frames=7, size=48, seed=3, draws=2) for _ in range(2))
    assert one.frames.rgb.shape == (7, 48, 48, 3) and one.keypoints.shape == (7, 4, 2)
    assert one.draws.tolist() == [0, 0, 0, 1, 1, 1, 1]
    assert np.array_equal(one.frames.rgb, two.frames.rgb)
    assert np.array_equal(one.keypoints, two.keypoints, equal_nan=True)
    seen = one.keypoints[np.isfinite(one.keypoints).all(axis=2)]
    assert len(seen) and ((seen > -0.5) & (seen < 47.5)).all()


def test_numbers_that_cannot_be_are_told() -> None:
    with pytest.raises(InputError, match="2 frames or more"):
        training_set("fling", frames=1)
