"""Grasps that give way and grasps that slip."""

import numpy as np
import pytest
from effect_objects import G, engine

from muslin.core.body import cloth_grid, rope_line
from muslin.core.material import ClothMaterial, RopeMaterial
from muslin.core.motion import Motion, rotate
from muslin.core.rollout import rollout
from muslin.core.scenario import Scenario
from muslin.core.scene import Scene
from muslin.core.simulator import State
from muslin.core.testing.reference import ReferenceSimulator
from muslin.plugins.effects.grasp import CREEP_SPEED, GraspCompliance, GraspSlip, _moved
from muslin.plugins.effects.grip_load import BendingPull, GripLoad

SHEET = cloth_grid(0.2, 0.2, 6, 6)
ROPE = rope_line(np.array([[0.0, 0.0, 0.0], [0.0, 0.0, -0.3]]), 9)
CLOTH, LINE = ClothMaterial(stretch_stiffness=100.0), RopeMaterial(stretch_stiffness=100.0)


def simulator_of(name):
    return ReferenceSimulator() if name == "reference" else engine(name)


def seen(name, body, material, grasps, effects, times=(0.0, 0.01), settle=0.6, **more):
    scenario = Scenario(
        name="hang",
        body=body,
        grasps=tuple(np.asarray(g) for g in grasps),
        motion=Motion.still(max(1, len(grasps))),
        times=np.asarray(times, float),
        markers=np.eye(len(body.vertices)),
        settle=settle,
        **{"load_vertices": np.zeros(0, np.int64), **more},
    )
    return rollout(simulator_of(name), scenario, material, effects).vertices


@pytest.mark.parametrize("name", ["reference", "mujoco", "pybullet"])
@pytest.mark.parametrize(
    ("body", "material", "grasps"),
    [
        pytest.param(SHEET, CLOTH, [[0, 5]], id="cloth by one gripper"),
        pytest.param(SHEET, CLOTH, [[0], [5]], id="cloth by two"),
        pytest.param(SHEET, CLOTH, [[0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11]], id="cloth by a bar"),
        pytest.param(ROPE, LINE, [[0]], id="rope"),
        pytest.param(ROPE, LINE, [[0, 1]], id="clamped rope"),
    ],
)
@pytest.mark.parametrize("compliance", [0.001, 0.02])
def test_gives_way_by_compliance_times_weight(name, body, material, grasps, compliance):
    last = seen(name, body, material, grasps, [GraspCompliance(compliance=compliance)])[-1]
    weight = G * material.density * body.measures.sum() / len(grasps)
    for ids in grasps:
        sunk = body.vertices[ids] - last[ids]
        np.testing.assert_allclose(sunk[:, 2], compliance * weight, rtol=0.02)
        np.testing.assert_allclose(sunk, np.tile(sunk[:1], (len(ids), 1)), atol=1e-12)  # no grasp turns or deforms


@pytest.mark.parametrize("name", ["reference", "mujoco", "pybullet"])
def test_turns_by_compliance_times_the_torque_of_the_weight(name):
    """A cloth in one gripper near its corner: the torque about the grasp is weight times overhang."""
    held = np.array([0, 1])
    last = seen(name, SHEET, CLOTH, [held], [GraspCompliance(turn_compliance=20.0)], settle=1.5)[-1]
    masses = SHEET.vertex_measures * CLOTH.density
    torque = G * masses @ (last[:, 0] - last[held, 0].mean())
    arm = last[1] - last[0]
    turned = np.arctan2(-arm[2], arm[0])
    assert turned > 0.02
    assert turned == pytest.approx(20.0 * torque, rel=0.05)
    np.testing.assert_allclose(last[held].mean(axis=0), SHEET.vertices[held].mean(axis=0), atol=1e-12)


@pytest.mark.parametrize("name", ["mujoco", "pybullet"])
def test_a_clamp_bears_the_weight_and_the_torque_of_a_stiff_rope_that_sticks_out(name):
    """All of the bend beside a clamp is that of half a segment, so the load there is what bends that much."""
    body = rope_line(np.array([[0.0, 0.0, 0.0], [0.3, 0.0, 0.0]]), 16)
    stiff = RopeMaterial(
        linear_density=0.02, bending_rigidity=5e-3, twist_rigidity=5e-3, stretch_stiffness=2000.0, damping_time=0.02
    )
    masses, weight = stiff.density * body.vertex_measures, G * stiff.density * 0.3
    sunk = seen(name, body, stiff, [[0, 1]], [GraspCompliance(compliance=0.02)], settle=2.0)[-1]
    np.testing.assert_allclose(body.vertices[[0, 1], 2] - sunk[[0, 1], 2], 0.02 * weight, rtol=0.02)
    last = seen(name, body, stiff, [[0, 1]], [GraspCompliance(turn_compliance=0.5)], settle=2.0)[-1]
    arm = last[1] - last[0]
    torque = G * masses @ (last[:, 0] - last[:2, 0].mean())
    assert np.arctan2(-arm[2], arm[0]) == pytest.approx(0.5 * torque, rel=0.02)
    still = seen(name, body, stiff, [[0, 1]], [GraspSlip(slipperiness=0.5 / weight)], settle=1.0)[-1]
    np.testing.assert_allclose(still[:2], body.vertices[:2], atol=1e-4)  # it holds twice the weight


@pytest.mark.parametrize("name", ["reference", "mujoco", "pybullet"])
@pytest.mark.parametrize(("body", "material", "held"), [(SHEET, CLOTH, [0, 5]), (ROPE, LINE, [0])])
def test_slides_at_the_speed_of_what_is_beyond_its_hold(name, body, material, held):
    """v_0 (W / F_max - 1) once the object has come along; W is its weight."""
    weight = G * material.density * body.measures.sum()
    times = np.array([0.0, 0.6, 1.2])
    path = seen(name, body, material, [held], [GraspSlip(slipperiness=1.4 / weight)], times, settle=0.5)
    speed = -(path[2, held, 2] - path[1, held, 2]) / 0.6
    np.testing.assert_allclose(speed, 0.4 * CREEP_SPEED, rtol=0.05)


@pytest.mark.parametrize("name", ["reference", "mujoco"])
def test_holds_fast_below_its_hold(name):
    weight = G * LINE.density * ROPE.measures.sum()
    path = seen(name, ROPE, LINE, [[0]], [GraspSlip(slipperiness=0.3 / weight)], np.linspace(0, 0.5, 6))
    np.testing.assert_array_equal(path[:, 0], np.tile(ROPE.vertices[0], (6, 1)))


@pytest.mark.parametrize(
    "effect", [GraspCompliance(compliance=0.02, turn_compliance=50.0), GraspSlip(slipperiness=1.0)]
)
def test_nothing_held_nothing_gives_way(effect):
    free = Scene(SHEET, CLOTH, np.zeros(3), (), np.zeros(36))
    assert effect.bind_grasp(free, np.ones(36)) is None


@pytest.mark.parametrize(("body", "material", "held"), [(SHEET, CLOTH, [0, 1, 6]), (ROPE, LINE, [0, 1])])
def test_the_load_is_the_gradient_of_the_energy_and_its_stiffness_bounds_the_change(body, material, held):
    """Work on the gripper over small motions of the grasp; at rest the stiffness is the second derivative."""
    ids = np.array(held)
    scene = Scene(body, material, np.zeros(3), (ids,), np.zeros(len(body.vertices)))
    load = GripLoad(scene, np.full(len(body.vertices), 1e9), ids)
    pull = BendingPull(scene) if body.kind == "rope" else lambda positions: None
    zero, stiffness = load(body.vertices, 1e-3, pull(body.vertices))
    np.testing.assert_allclose(zero, 0.0, atol=1e-9)
    moved, step = body.vertices.copy(), 1e-6
    for k, motion in enumerate(np.eye(6)):
        arms = body.vertices[ids] - body.vertices[ids].mean(axis=0)
        moved[ids] = body.vertices[ids] + step * (motion[:3] + np.cross(motion[3:], arms))
        force, _ = load(moved, 1e-3, pull(moved))
        change = -force / step
        assert change[k] >= -1e-6
        assert change[k] <= stiffness[k, k] * (1 + 1e-3) + 1e-6
        if body.kind == "cloth":
            np.testing.assert_allclose(change, stiffness[:, k], atol=1e-3 * stiffness.max())


@pytest.mark.parametrize(
    "effect", [GraspCompliance(compliance=0.05, turn_compliance=50.0), GraspSlip(slipperiness=50.0)]
)
def test_an_object_without_load_stays_in_its_grasp(effect):
    scene = Scene(SHEET, CLOTH, np.zeros(3), (np.array([0, 5]),), np.zeros(36))
    shift = effect.bind_grasp(scene, SHEET.vertex_measures * CLOTH.density)
    target = SHEET.vertices[[0, 5]]
    for k in range(5):
        got = shift(0.005 * k, State(SHEET.vertices, 0 * SHEET.vertices), target)
        np.testing.assert_allclose(got, target, atol=1e-15)


def test_a_soft_grasp_brings_a_little_damping():
    """That fades out with it, and is never more than 2 ms."""
    for value, most in ((1e-9, 1e-7), (0.05, 0.002)):
        added = GraspCompliance(compliance=value).on_material(LINE).damping_time
        assert 0 < added < most


@pytest.mark.parametrize("angle", [0.0, 1e-4, 0.7, 3.0])
def test_a_grasp_is_displaced_as_a_rigid_body(angle: float) -> None:
    rng = np.random.default_rng(0)
    points, shift, axis = rng.normal(size=(5, 3)), rng.normal(size=3), rng.normal(size=3)
    axis /= np.linalg.norm(axis)
    centre = points.mean(axis=0)
    turn = np.array([np.cos(angle / 2), *(np.sin(angle / 2) * axis)])
    expected = centre + rotate(turn, points - centre) + shift
    np.testing.assert_allclose(_moved(points, np.concatenate([shift, angle * axis])), expected, atol=1e-12)
