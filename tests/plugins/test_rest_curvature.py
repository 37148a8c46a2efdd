"""The bend that a rope keeps, told by how it starts."""

from dataclasses import replace

import numpy as np
import pytest

from muslin.backends.mujoco import MujocoSimulator
from muslin.core.arrays import FloatArray
from muslin.core.body import rope_line
from muslin.core.material import RopeMaterial
from muslin.core.measurement import Recording
from muslin.core.motion import Motion
from muslin.core.powerless import why_powerless
from muslin.core.rollout import rollout
from muslin.core.scenario import Scenario
from muslin.core.scenarios import preset
from muslin.core.scenarios.measured import measured_start
from muslin.core.scene import Scene
from muslin.plugins.effects.hinges import RopeBending
from muslin.plugins.effects.rest_curvature import RestCurvature, natural_curvature

MATERIAL = RopeMaterial(linear_density=0.05, stretch_stiffness=2000.0, bending_rigidity=2e-3, twist_rigidity=2e-3)
TIME = np.arange(0.0, 1.2, 0.01)


def reality(moved: float) -> Recording:
    """A rope that is bent at rest as a half hoop of 0.3 m, held at both ends; one of them swings by ``moved`` [m]."""
    angle = np.linspace(0.0, 2.4, 25)
    bent = 0.3 * np.stack([np.sin(angle), 0.35 * (1 - np.cos(2 * angle)), np.cos(angle) - 1], axis=1)
    body = rope_line(bent, 25)
    swing = moved * np.sin(2 * np.pi * 1.2 * TIME)
    ends = body.vertices[[0, -1]]
    poses = np.zeros((len(TIME), 2, 7))
    poses[..., 3] = 1.0
    poses[:, :, :3] = ends
    poses[:, 1, 1] += swing
    local = replace(body, vertices=body.vertices - ends[0])
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
    made = rollout(MujocoSimulator(), scenario, replace(MATERIAL, damping_time=0.01))
    return Recording("take", made.series, scenario.motion)


def model(recording: Recording) -> Scenario:
    plain = replace(preset("cable").scenario((1.0,), (25,)), grasps=(np.array([0, 1]), np.array([23, 24])))
    return measured_start(plain.for_recording(recording), recording)


# moving it does worse: the bend that is in balance with the start is known but for what the grippers give
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


def test_an_arc_without_weight_is_all_natural_curvature_or_none() -> None:
    body = rope_line(np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]), 21)
    # segments that are held at both ends are straight, so the arc turns there by what half a segment turns
    turn = np.concatenate([[0.0, 0.5], np.ones(17), [0.5]])
    angle = 0.05 * np.cumsum(turn)
    steps = 0.05 * np.stack([np.cos(angle), 0 * angle, np.sin(angle)], axis=1)
    arc = np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])
    free = Scene(body, MATERIAL, np.zeros(3), (np.array([0, 1]),), np.zeros(21), (), arc)
    held = replace(free, grasps=(np.array([0, 1]), np.array([19, 20])))
    masses = 0.05 * body.vertex_measures

    def bend_of(scene: Scene) -> FloatArray:
        bending = RopeBending(body, scene.held)
        bending.follow(arc)
        return natural_curvature(bending, scene, masses, MATERIAL)

    # clamped at one end alone nothing but its own bend can hold it in this shape; clamped at both the ends can
    np.testing.assert_allclose(np.linalg.norm(bend_of(free), axis=1)[:-1], 1.0, rtol=1e-6)
    assert np.abs(bend_of(held)).max() < 1e-6


def test_what_moves_freely_needs_no_bend() -> None:
    """In free fall the acceleration is the weight's, so a straight rope is in balance however light it is."""
    body = rope_line(np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]), 21)
    gravity = np.array([0.0, 0.0, -9.81])
    held = (np.array([0, 1]),)
    falling = Scene(body, MATERIAL, gravity, held, np.zeros(21), start_accelerations=np.tile(gravity, (21, 1)))
    bending = RopeBending(body, falling.held)
    masses = 0.05 * body.vertex_measures
    assert np.abs(natural_curvature(bending, falling, masses, MATERIAL)).max() < 1e-9
    still = replace(falling, start_accelerations=None)
    # at rest, sticking out from the clamp, its bend carries the weight of all that is beyond: m = w (l - x)^2 / 2
    moment = 2e-3 * np.linalg.norm(natural_curvature(bending, still, masses, MATERIAL), axis=1)
    np.testing.assert_allclose(moment, 0.05 * 9.81 * 0.5 * (1.0 - np.arange(1, 20) / 20) ** 2, rtol=1e-6)


def test_what_damping_gives_is_no_bend() -> None:
    """A straight rope without weight that starts to bend, with the acceleration that its damping then gives it."""
    body = rope_line(np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]), 21)
    masses, beta = 0.05 * body.vertex_measures, 0.02
    held = (np.array([0, 1]),)
    bending = RopeBending(body, held[0])
    x = body.vertices[:, 0]
    velocities = np.stack([0 * x, 0 * x, np.maximum(x - 0.1, 0.0) ** 2 * (1.0 - x)], axis=1)
    forces = bending.forces(2e-3 * beta * bending.rates(velocities))
    bent = Scene(
        body,
        replace(MATERIAL, damping_time=beta),
        np.zeros(3),
        held,
        np.zeros(21),
        start_velocities=velocities,
        start_accelerations=forces / masses[:, None],
    )
    assert np.abs(natural_curvature(bending, bent, masses, replace(MATERIAL, damping_time=beta))).max() < 1e-9
    undamped = natural_curvature(bending, bent, masses, MATERIAL)
    assert np.abs(undamped).max() > 0.5 * beta * np.abs(bending.rates(velocities)).max()


def test_it_is_offered_only_where_the_start_was_measured() -> None:
    scenario = model(reality(0.0))
    assert why_powerless(RestCurvature, MujocoSimulator(), scenario) is None
    told = why_powerless(RestCurvature, MujocoSimulator(), replace(scenario, start_motion=None))
    assert told is not None and "start = 'measured'" in told
