"""A table that is not level, against closed forms and against gravity that is not."""

import numpy as np
import pytest
from effect_objects import G, cases, engine
from hypothesis import given
from hypothesis import strategies as st

from muslin.core.body import Body, cloth_grid
from muslin.core.material import ClothMaterial
from muslin.core.motion import IDENTITY_POSE, Motion, rotate
from muslin.core.obstacles import Table
from muslin.core.rollout import rollout
from muslin.core.scenario import Scenario
from muslin.plugins.effects.observation import CameraRotation, rotation_matrix
from muslin.plugins.effects.table import TableTilt

GRID = cloth_grid(0.1, 0.1, 3, 3)
FLAT = Body("cloth", GRID.vertices[:, [0, 2, 1]], GRID.elements, GRID.grid)
ICE = ClothMaterial(friction=0.0, stretch_stiffness=100.0)


def task(motion, times, grasps=(), obstacles=()):
    return Scenario(
        "tilt", FLAT, grasps, motion, np.asarray(times, float), np.eye(9), np.zeros(0, np.int64), 0.0, obstacles
    )


TABLE = (Table(0.0),)


def done(*effects, name="reference", motion=None, times=(0.0, 0.2), grasps=(), obstacles=TABLE, material=ICE):
    return rollout(engine(name), task(motion or Motion.still(), times, grasps, obstacles), material, effects)


def points(*effects, **more):
    return done(*effects, **more).series.points


@pytest.mark.parametrize("name", ["reference", "mujoco"])
@pytest.mark.parametrize("tilt", [0.02, -0.03])
def test_on_ice_it_slides_down_the_slope(name, tilt):
    """Turned about y by b the table falls along x by sin b: a = g sin b cos b along x."""
    moved = (points(TableTilt(about_y=tilt), name=name)[1] - points(name=name)[1]).mean(axis=0)
    assert moved[0] == pytest.approx(0.5 * G * np.sin(tilt) * np.cos(tilt) * 0.2**2, rel=0.06)
    assert abs(moved[1]) < 1e-6


def test_without_a_table_nothing_changes_to_the_eye():
    """Everything but the obstacles is where it was: the object moves and is seen the same, to rounding."""
    path = Motion.from_positions(
        np.array([0.0, 0.1, 0.2]), np.array([[0.2, 0, 0.1], [0.25, 0, 0.1], [0.2, 0.1, 0.2]])[:, None]
    )
    seen = {"motion": path, "times": np.linspace(0, 0.2, 5), "grasps": (np.array([0, 2]),), "obstacles": ()}
    np.testing.assert_allclose(points(TableTilt(about_x=0.03, about_y=-0.02), **seen), points(**seen), atol=1e-9)


def test_a_hand_that_moves_level_meets_the_table_where_it_rises():
    """What the hand holds stays level; the free rest lies on the slope, z = -x tan b."""
    path = Motion.from_positions(np.array([0.0, 0.5]), np.array([[0.0, 0, 0.004], [-0.15, 0, 0.004]])[:, None])
    seen = {"motion": path, "times": (0.0, 0.5), "grasps": (np.array([0]),)}
    seen["material"] = ClothMaterial(stretch_stiffness=100.0, friction=0.0)
    last = points(TableTilt(about_y=0.03), **seen)[-1]
    np.testing.assert_allclose(last[0, 2], 0.004, atol=1e-9)
    height = last[:, 2] + np.tan(0.03) * last[:, 0]  # above the slope
    assert height[1:].min() > -1e-4
    assert np.median(height) < 1e-3


def test_mesh_and_grippers_are_told_in_the_world_too():
    """Every vertex is a marker, so mesh and points are the same; the hand is where it was told to be."""
    path = Motion.from_positions(np.array([0.0, 0.2]), np.array([[0.0, 0, 0.004], [-0.15, 0.1, 0.004]])[:, None])
    told = done(TableTilt(about_x=-0.02, about_y=0.03), motion=path, times=(0.0, 0.1, 0.2), grasps=(np.array([0]),))
    np.testing.assert_allclose(told.vertices, told.series.points, atol=1e-15)
    np.testing.assert_allclose(told.poses, path.at(np.array([0.0, 0.1, 0.2])), atol=1e-12)
    np.testing.assert_allclose(told.vertices[:, 0], FLAT.vertices[0] + told.poses[:, 0, :3], atol=1e-9)


def test_a_camera_that_is_off_sees_the_same_whichever_comes_first():
    effects = [TableTilt(about_x=0.03), CameraRotation(about_z=0.02)]
    np.testing.assert_array_equal(points(*effects), points(*effects[::-1]))


@cases
@given(st.floats(-0.035, 0.035), st.floats(-0.035, 0.035))
def test_the_tilt_is_a_turn_by_that_rotation_vector(a, b):
    quaternion = TableTilt(about_x=a, about_y=b).on_obstacles(IDENTITY_POSE[3:])
    np.testing.assert_allclose(rotate(quaternion, np.eye(3)), rotation_matrix(np.array([a, b, 0.0])).T, atol=1e-12)
