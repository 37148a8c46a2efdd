"""Cameras that are late, displaced or turned."""

import numpy as np
import pytest
from effect_objects import SHEET, cases, engine
from hypothesis import given
from hypothesis import strategies as st

from muslin.core.material import ClothMaterial
from muslin.core.motion import Motion
from muslin.core.rollout import rollout
from muslin.core.scenario import Scenario
from muslin.plugins.effects.observation import CameraLatency, CameraOffset, CameraRotation, rotation_matrix

TIMES = np.linspace(0.0, 0.3, 31)
MATERIAL = ClothMaterial(stretch_stiffness=60.0)


def carried(*effects, times=TIMES):
    places = np.array([[0, 0, 0], [0.05, 0, 0], [0.05, 0.1, 0], [0, 0, 0]])
    path = Motion.from_positions(np.array([0.0, 0.1, 0.2, 0.3]), places[:, None])
    task = Scenario("carry", SHEET, (np.array([0, 4]),), path, times, np.eye(20), np.zeros(0, np.int64))
    return rollout(engine("reference"), task, MATERIAL, effects)


def test_latency_shows_what_was():
    """At t the points of t - latency; before the start those of the start."""
    plain, late = carried().series.points, carried(CameraLatency(latency=0.05)).series.points
    np.testing.assert_allclose(late[5:], plain[:-5], atol=1e-12)
    np.testing.assert_array_equal(late[:6], np.tile(plain[0], (6, 1, 1)))


@cases
@given(st.floats(0.0, 0.1), st.floats(-5.0, 5.0))
def test_the_clock_never_runs_ahead(latency, start):
    seen = CameraLatency(latency=latency).on_clock(TIMES + start)
    assert (seen <= TIMES + start).all()
    assert (np.diff(seen) >= 0).all()


def test_latency_leaves_the_gripper_on_time():
    np.testing.assert_array_equal(carried(CameraLatency(latency=0.05)).poses, carried().poses)


def test_offset_moves_every_point_alike_and_nothing_else():
    plain, moved = carried(), carried(CameraOffset(x=0.01, z=-0.02))
    np.testing.assert_allclose(
        moved.series.points - plain.series.points, np.full((31, 20, 3), [0.01, 0, -0.02]), atol=1e-15
    )
    np.testing.assert_array_equal(moved.vertices, plain.vertices)


def test_rotation_turns_about_the_centroid_of_the_first_frame():
    plain, turned = carried(), carried(CameraRotation(about_z=0.02))
    pivot = plain.series.points[0].mean(axis=0)
    np.testing.assert_allclose(turned.series.points[0].mean(axis=0), pivot, atol=1e-15)
    cos, sin = np.cos(0.02), np.sin(0.02)
    expected = (plain.series.points - pivot) @ np.array([[cos, sin, 0], [-sin, cos, 0], [0, 0, 1]]) + pivot
    np.testing.assert_allclose(turned.series.points, expected, atol=1e-15)
    np.testing.assert_array_equal(turned.vertices, plain.vertices)


@cases
@given(st.tuples(*[st.floats(-3.0, 3.0)] * 3))
def test_a_rotation_vector_is_a_turn_about_itself_by_its_length(vector):
    turn, angle = rotation_matrix(np.array(vector)), np.linalg.norm(vector)
    np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(turn @ vector, vector, atol=1e-12)
    assert np.trace(turn) == pytest.approx(1 + 2 * np.cos(angle), abs=1e-12)
    assert np.linalg.det(turn) == pytest.approx(1.0)


def test_offset_and_rotation_and_latency_add_up():
    effects = CameraOffset(x=0.004), CameraRotation(about_x=0.01, about_y=-0.01), CameraLatency(latency=0.02)
    together = carried(*effects).series.points
    late = carried(effects[2]).series.points
    np.testing.assert_allclose(together, effects[1].on_points(effects[0].on_points(late)), atol=1e-15)
    other = carried(*effects[::-1]).series.points
    np.testing.assert_allclose(together, other, atol=2e-4 * 0.2)  # turning and moving swap up to their product
