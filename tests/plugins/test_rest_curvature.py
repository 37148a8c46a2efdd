"""The bend that a rope keeps, told by the states that it was seen in."""

from dataclasses import replace

import numpy as np
import pytest

from muslin.backends.mujoco import MujocoSimulator
from muslin.core.arrays import FloatArray
from muslin.core.bending import RopeBending, rope_rigidities
from muslin.core.beside import Beside, closing_angles
from muslin.core.body import Body, rope_line
from muslin.core.effect import Effect
from muslin.core.material import RopeMaterial
from muslin.core.measurement import Recording
from muslin.core.motion import Motion
from muslin.core.powerless import why_powerless
from muslin.core.rollout import rollout
from muslin.core.scenario import Scenario
from muslin.core.scenarios import preset
from muslin.core.scenarios.kept import told_bend
from muslin.core.scenarios.measured import measured_start
from muslin.core.series import PointSeries
from muslin.plugins.effects.rest_curvature import RestCurvature
from muslin.plugins.effects.strands import RopeHysteresis

MATERIAL = RopeMaterial(linear_density=0.05, stretch_stiffness=2000.0, bending_rigidity=2e-3, twist_rigidity=2e-3)
TIME = np.arange(0.0, 1.2, 0.01)
GRAVITY = np.array([0.0, 0.0, -9.80665])


def reality(moved: float) -> Recording:
    """A rope that is bent at rest as a half hoop of 0.3 m, held at both ends; one of them swings by ``moved`` [m]."""
    angle = np.linspace(0.0, 2.4, 25)
    bent = 0.3 * np.stack([np.sin(angle), 0.35 * (1 - np.cos(2 * angle)), np.cos(angle) - 1], axis=1)
    poses = held_still(rope_line(bent, 25))
    poses[:, 1, 1] += moved * np.sin(2 * np.pi * 1.2 * TIME)
    return take(bent, poses)


def held_still(body: Body) -> FloatArray:
    """Poses ``(T, 2, 7)`` of grippers at both ends of it."""
    poses = np.zeros((len(TIME), 2, 7))
    poses[..., 3] = 1.0
    poses[:, :, :3] = body.vertices[[0, -1]]
    return poses


def take(bent: FloatArray, poses: FloatArray, engine: MujocoSimulator | None = None) -> Recording:
    """A rope of this shape at rest, that hung still before the first of the poses."""
    body = rope_line(bent, 25)
    local = replace(body, vertices=body.vertices - body.vertices[0])
    scenario = Scenario(
        "bent",
        local,
        (np.array([0, 1]), np.array([23, 24])),
        Motion(TIME, poses),
        TIME,
        np.eye(25)[::2],
        np.zeros(0, np.int64),
        settle=1.5,
    )
    made = rollout(engine or MujocoSimulator(), scenario, replace(MATERIAL, damping_time=0.01))
    return Recording("take", made.series, scenario.motion)


def model(recording: Recording) -> Scenario:
    plain = replace(preset("cable").scenario((1.0,), (25,)), grasps=(np.array([0, 1]), np.array([23, 24])))
    scenario = measured_start(plain.for_recording(recording), recording)
    return replace(scenario, kept=told_bend([scenario], [recording]))


# moving it does worse: the bend that is in balance is known but for what the grippers give
@pytest.mark.parametrize(("moved", "part"), [(0.0, 0.2), (0.1, 0.35)])
def test_a_straight_rope_with_it_moves_as_the_bent_one(moved: float, part: float) -> None:
    recording = reality(moved)
    measured, scenario = recording.series.points, model(recording)
    material = replace(MATERIAL, damping_time=0.01)

    def off(share: float) -> float:
        effects = [RestCurvature(share=share)]
        return float(np.abs(rollout(MujocoSimulator(), scenario, material, effects).series.points - measured).max())

    assert off(0.0) > 0.02
    assert off(1.0) < part * off(0.0)


@pytest.mark.parametrize("turned", [2.5, -2.5])
def test_what_twist_bends_is_no_bend_that_a_rope_keeps(turned: float) -> None:
    """A straight rope that a gripper has twisted until it coils out of its plane, at rest."""
    times = np.arange(0.0, 6.0, 0.02)
    half = 0.5 * turned * np.minimum(times / 2.0, 1.0)
    poses = np.tile([[0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0], [0.7, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0]], (len(times), 1, 1))
    poses[:, 1, 3], poses[:, 1, 4] = np.cos(half), np.sin(half)
    scenario = replace(preset("cable").scenario((1.0,), (41,)), motion=Motion(times, poses), times=times)
    material = replace(MATERIAL, bending_rigidity=4e-3, twist_rigidity=3e-3, damping_time=0.05)
    vertices = rollout(MujocoSimulator(), scenario, material).vertices
    still = Recording("still", PointSeries(times[:20], vertices[-20:]), Motion(times[:1], poses[-1:]))
    beside = Beside(np.zeros((41, 2)), float(closing_angles(vertices[:1], poses[:1])[0]))
    start = measured_start(scenario.for_recording(still), still, beside)
    told = told_bend([start], [still])
    assert told is not None
    untold = replace(told, torsion=0.0 * told.torsion)
    kept, without = (float(np.std(t.curvature(material, GRAVITY))) for t in (told, untold))
    assert kept < 0.4 * without


def test_a_straight_rope_that_swings_keeps_next_to_no_bend() -> None:
    """By frames after each state alone its accelerations would be late, and a bend would be told of that."""
    poses = np.tile([[0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0], [0.7, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0]], (len(TIME), 1, 1))
    poses[:, 1, 1] += 0.06 * np.sin(2 * np.pi * TIME) ** 2
    poses[:, 0, 2] += 0.04 * (1 - np.cos(2 * np.pi * TIME))
    scenario = replace(preset("cable").scenario((1.0,), (41,)), motion=Motion(TIME, poses), times=TIME)
    scenario = replace(scenario, markers=np.eye(41)[::2])
    material = replace(MATERIAL, damping_time=0.02)
    points = rollout(MujocoSimulator(time_step=0.00125), scenario, material).series.points
    noise = np.random.default_rng(0).normal(0, 3e-5, points.shape)
    swung = Recording("swung", PointSeries(TIME, points + noise), scenario.motion)
    told = told_bend([measured_start(scenario.for_recording(swung), swung)], [swung])
    assert told is not None
    assert np.sqrt(np.mean(told.curvature(material, GRAVITY) ** 2)) < 0.14


@pytest.mark.parametrize("turned", [1.0, 2.0])
def test_an_even_bend_shows_as_clamps_turn_a_rope_though_no_state_tells_it(turned: float) -> None:
    """Of an arc between two clamps: how much it turns in all is given by them, so its energy does not depend on it."""
    angle = np.linspace(0.0, 1.8, 25)
    arc = 0.5 * np.stack([np.sin(angle), 0.0 * angle, np.cos(angle) - 1], axis=1)  # bent by 2 1/m
    poses = held_still(rope_line(arc, 25))
    axis = poses[0, 1, :3] - poses[0, 0, :3]
    half = 0.25 * turned * (1 - np.cos(2 * np.pi * 0.8 * TIME))[:, None, None]
    poses[..., 3:4], poses[..., 4:] = np.cos(half), np.sin(half) * axis / np.linalg.norm(axis)
    engine = MujocoSimulator(time_step=0.0025)
    still, moving = take(arc, held_still(rope_line(arc, 25)), engine), take(arc, poses, engine)
    material = replace(MATERIAL, damping_time=0.01)

    def off(recording: Recording, about_side: float) -> float:
        effects = [RestCurvature(even_about_side=about_side)]
        made = rollout(engine, model(recording), material, effects)
        return float(np.abs(made.series.points - recording.series.points).mean())

    told = model(still).kept
    assert told is not None
    assert np.abs(told.curvature(material, GRAVITY).mean(axis=0)).max() < 0.05
    assert abs(off(still, -2.0) - off(still, 0.0)) < 2e-4
    assert off(moving, -2.0) < 0.6 * min(off(moving, 0.0), off(moving, 2.0))


def test_it_is_offered_only_where_a_held_rope_was_seen_to_be_bent() -> None:
    scenario = model(reality(0.0))
    assert why_powerless(RestCurvature, MujocoSimulator(), scenario) is None
    told = why_powerless(RestCurvature, MujocoSimulator(), replace(scenario, kept=None))
    assert told is not None and "start = 'measured'" in told


@pytest.mark.parametrize("ratio", [1.0, 0.2])
def test_the_part_that_no_state_tells_is_an_even_moment(ratio: float) -> None:
    scenario = model(reality(0.0))
    material = replace(MATERIAL, end_bending_ratio=ratio, far_bending_ratio=ratio)
    body = RestCurvature(even_about_z=0.2).on_body(scenario, material, GRAVITY)
    bending = RopeBending(body, np.concatenate(scenario.grasps))
    moment = rope_rigidities(body, material) * np.linalg.norm(bending.rest, axis=1)
    np.testing.assert_allclose(moment, 0.2 * material.bending_rigidity, rtol=1e-3)


def test_strands_that_slide_go_with_it_in_any_order_and_it_is_told_by_what_they_leave() -> None:
    """Strands that slide at once leave half of twice the rigidity: the same rope as without them."""
    scenario, material = model(reality(0.1)), replace(MATERIAL, damping_time=0.01)
    stiffer = replace(material, bending_rigidity=2 * material.bending_rigidity)
    kept, strands = RestCurvature(share=1.0), RopeHysteresis(sliding_share=0.5)

    def path(material: RopeMaterial, *effects: Effect) -> FloatArray:
        return rollout(MujocoSimulator(time_step=0.0025), scenario, material, effects).vertices

    one, other = path(stiffer, kept, strands), path(stiffer, strands, kept)
    np.testing.assert_allclose(one, other, atol=1e-9)
    softer, stuck = path(material, kept), path(stiffer, kept)
    assert np.abs(one - softer).max() < 0.3 * np.abs(stuck - softer).max()
