"""Grippers that turn a rope about itself."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from muslin.backends.mujoco import MujocoSimulator
from muslin.core.arrays import FloatArray
from muslin.core.body import rope_line
from muslin.core.clamps import clamp_turns, clamped_segments
from muslin.core.material import RopeMaterial
from muslin.core.motion import Motion, multiply, rotate, turns_about
from muslin.core.rollout import rollout
from muslin.core.scenario import Scenario

CLOCK = np.linspace(0.0, 1.0, 201)
X = np.array([1.0, 0.0, 0.0])


def about(axis: FloatArray, angles: FloatArray) -> FloatArray:
    half = np.asarray(angles)[..., None] / 2
    return np.concatenate([np.cos(half), np.sin(half) * axis], axis=-1)


@given(st.floats(-12.0, 12.0))
def test_a_turn_about_a_fixed_axis_is_told_whole_turns_and_all(angle: float) -> None:
    turns = turns_about(np.tile(X, (201, 1)), about(X, angle * CLOCK))
    np.testing.assert_allclose(turns, angle * CLOCK, atol=1e-9)


def test_an_axis_that_goes_round_a_cone_turns_by_the_solid_angle() -> None:
    """What is carried along without a turn is back after a round turned by the solid angle (Gauss and Bonnet).

    What goes round rigidly is back as it was: so it has turned by 2 pi (1 - cos) less a whole turn, of which it made
    one about the axis of the cone.
    """
    tilt = 0.5
    axis = np.array([np.sin(tilt), 0.0, np.cos(tilt)])
    quaternions = about(np.array([0.0, 0.0, 1.0]), 2 * np.pi * CLOCK)
    turns = turns_about(rotate(quaternions, np.tile(axis, (201, 1))), quaternions)
    assert turns[-1] == pytest.approx(2 * np.pi * np.cos(tilt), rel=1e-3)


def test_only_segments_that_are_held_at_both_ends_turn_each_with_its_own_gripper() -> None:
    body = rope_line(np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]), 11)
    grasps = (np.array([0, 1, 2]), np.array([9, 10]))
    assert np.flatnonzero(clamped_segments(body, np.concatenate(grasps))).tolist() == [0, 1, 9]
    quaternions = np.stack([about(X, 0.0 * CLOCK), about(X, 2.0 * CLOCK)], axis=1)
    held = np.tile(body.vertices[np.concatenate(grasps)], (201, 1, 1))
    turns = clamp_turns(body, grasps, quaternions, held)
    np.testing.assert_allclose(turns, CLOCK[:, None] * [0.0, 0.0, 2.0], atol=1e-9)
    assert clamp_turns(body, (np.array([0]), np.array([10])), quaternions, held[:, [0, -1]]).shape == (201, 0)


def test_a_gripper_that_turns_takes_a_bent_rope_round() -> None:
    """A stiff arc held by its first segment goes round as a rigid one, whichever way the gripper itself moves."""
    angle = np.linspace(0.0, 1.2, 13)
    arc = rope_line(0.2 * np.stack([np.sin(angle), 1 - np.cos(angle), 0 * angle], axis=1), 13)
    along = (arc.vertices[1] - arc.vertices[0]) / np.linalg.norm(arc.vertices[1] - arc.vertices[0])
    slow = CLOCK - np.sin(2 * np.pi * CLOCK) / (2 * np.pi)
    turn = multiply(about(np.array([0.0, 0.0, 1.0]), 0.5 * slow), about(along, -2.0 * slow))
    poses = np.concatenate([0.1 * slow[:, None] * X, turn], axis=1)[:, None]
    scenario = Scenario(
        "turned", arc, (np.array([0, 1]),), Motion(CLOCK, poses), CLOCK, np.eye(13), np.zeros(0, np.int64)
    )
    material = RopeMaterial(0.01, 2000.0, 0.05, 0.05, damping_time=0.01)
    seen = rollout(MujocoSimulator(), scenario, material).series.points
    rigid = rotate(turn[:, None], arc.vertices) + poses[:, :, :3]
    assert np.linalg.norm(seen - rigid, axis=2).max() < 0.006
    unturned = np.linalg.norm(
        rigid[-1] - (rotate(about(np.array([0.0, 0.0, 1.0]), 0.5), arc.vertices) + 0.1 * X), axis=1
    )
    assert unturned.max() > 0.1


def test_a_rope_of_one_segment_has_no_twist_to_turn() -> None:
    body = rope_line(np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0]]), 2)
    poses = np.concatenate([np.zeros((201, 3)), about(X, 2.0 * CLOCK)], axis=1)[:, None]
    scenario = Scenario("one", body, (np.array([0, 1]),), Motion(CLOCK, poses), CLOCK, np.eye(2), np.zeros(0, np.int64))
    seen = rollout(MujocoSimulator(), scenario, RopeMaterial()).series.points
    np.testing.assert_allclose(seen, np.tile(body.vertices, (201, 1, 1)), atol=1e-9)
