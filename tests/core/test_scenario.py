from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from muslin.core.errors import InputError
from muslin.core.measurement import Recording
from muslin.core.motion import Motion
from muslin.core.obstacles import Table
from muslin.core.scenario import bound_markers, marker_weights
from muslin.core.scenarios.starts import GivenShape
from muslin.core.series import PointSeries
from muslin.core.testing.samples import sample_body, sample_scenario


def test_a_grasp_vertex_that_does_not_exist() -> None:
    with pytest.raises(InputError, match="gripper 0 takes vertex 99, but the mesh has vertices 0 to 11"):
        replace(sample_scenario("cloth"), grasps=(np.array([0, 99]),))
    with pytest.raises(InputError, match="takes vertex -1"):
        replace(sample_scenario("cloth"), grasps=(np.array([-1]),))


def test_more_grippers_than_the_motion_moves() -> None:
    scenario = sample_scenario("cloth")
    with pytest.raises(InputError, match="2 grippers, but the motion moves 1"):
        replace(scenario, grasps=(np.array([0]), np.array([3])))
    series = PointSeries(np.array([0.0, 1.0]), np.zeros((2, 1, 3)))
    two = replace(scenario, grasps=(np.array([0]), np.array([3])), motion=Motion.still(2))
    with pytest.raises(InputError, match="poses of 1 grippers"):
        two.for_recording(Recording("take", series, Motion.still(1)))


def test_a_load_with_nowhere_to_hang() -> None:
    with pytest.raises(InputError, match=r"nowhere to hang a load of 0\.1 kg"):
        replace(sample_scenario("cloth"), load=0.1)


def test_marker_weights_of_another_mesh() -> None:
    with pytest.raises(InputError, match="marker weights are for 7 vertices"):
        replace(sample_scenario("cloth"), markers=np.eye(7))
    with pytest.raises(InputError, match="vertex 12"):
        marker_weights(12, np.array([12]))


def test_a_take_of_the_same_motion_has_the_same_rollout() -> None:
    first = sample_scenario("cloth")
    again = sample_scenario("cloth")
    late = Motion(again.motion.times, again.motion.poses + 1e-9)
    assert first.same_rollout(replace(again, times=again.times + 1e-9, motion=late))


@pytest.mark.parametrize(
    "change",
    [
        {"settle": 0.5},
        {"grasps": (np.array([1]),)},
        {"obstacles": (Table(0.0),)},
        {"start": GivenShape(np.zeros((12, 3)), 1.0, np.zeros(3))},
        {"motion": Motion(np.zeros(1), np.tile([0, 0, 1e-3, 1, 0, 0, 0.0], (1, 1, 1)))},
        {"times": np.linspace(0.0, 0.123, 7)},
        {"markers": marker_weights(12, np.array([3]))},
    ],
    ids=lambda change: next(iter(change)),
)
def test_whatever_differs_makes_another_rollout(change: dict[str, Any]) -> None:
    first = sample_scenario("cloth")
    other = replace(first, **change)
    assert not first.same_rollout(other) and not other.same_rollout(first)
    assert other.same_rollout(replace(other))


def test_held_vertices_follow_a_turning_gripper() -> None:
    scenario = sample_scenario("cloth")
    quarter = np.array([np.cos(np.pi / 4), 0, 0, np.sin(np.pi / 4)])
    poses = np.array([[[0, 0, 0, 1.0, 0, 0, 0]], [[0.1, 0, 0, *quarter]]])
    motion = Motion(np.array([0.0, 1.0]), poses)
    vertices = scenario.world_vertices()
    held = replace(scenario, motion=motion).held_positions(np.array([0.0, 1.0]), vertices)
    start = vertices[scenario.grasps[0]]
    np.testing.assert_allclose(held[0], start, atol=1e-12)
    turned = np.stack([-start[:, 1] + 0.1, start[:, 0], start[:, 2]], axis=1)
    np.testing.assert_allclose(held[1], turned, atol=1e-12)


def test_bound_markers_turn_with_the_body() -> None:
    body = sample_body("solid")
    points = body.vertices[[0, 26]] + np.array([0.004, -0.003, 0.01])
    weights = bound_markers(body.vertices, points)
    turn = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    np.testing.assert_allclose(weights @ (body.vertices @ turn.T + 1.0), points @ turn.T + 1.0, atol=1e-9)
    np.testing.assert_allclose(weights.sum(axis=1), 1.0)


def test_a_marker_off_a_flat_sheet_cannot_be_bound() -> None:
    body = sample_body("cloth")
    with pytest.raises(
        InputError, match=r"0\.051 m from the object, cannot be tied .* lie in one plane; check the size"
    ):
        bound_markers(body.vertices, body.vertices[:1] + np.array([0.0, 0.01, 0.05]))
