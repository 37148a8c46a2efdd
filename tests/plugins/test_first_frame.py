"""Pieces of a recording that start as they were seen, under effects on what is told and seen."""

from dataclasses import replace

import numpy as np
import pytest
from effect_objects import engine

from muslin.core.beside import Beside
from muslin.core.body import rope_line
from muslin.core.material import RopeMaterial
from muslin.core.measurement import Recording
from muslin.core.motion import Motion
from muslin.core.obstacles import Table
from muslin.core.rollout import rollout
from muslin.core.scenario import Scenario, StartMotion
from muslin.core.scenarios import preset
from muslin.core.scenarios.measured import measured_start
from muslin.core.series import PointSeries
from muslin.plugins.effects.command import ActuatorLag
from muslin.plugins.effects.observation import CameraLatency, CameraOffset, CameraRotation
from muslin.plugins.effects.table import TableTilt

TIMES = np.arange(0.0, 1.8, 0.01)
MATERIAL = RopeMaterial(bending_rigidity=1e-3, damping_time=0.02)


def moving_rope():
    return engine("mujoco", time_step=0.0025)


def swung():
    scenario = preset("cable").scenario()
    return replace(scenario, times=TIMES, markers=np.eye(len(scenario.body.vertices))[::4])


def piece_of(series, motion):
    """From 0.8 s on, in the middle of the swing, as a recording and what is simulated of it."""
    kept = series.time > 0.795
    part = PointSeries(series.time[kept], series.points[kept])
    return measured_start(replace(swung(), times=part.time), Recording("take", part, motion)), part


def off(scenario, part, effects):
    made = rollout(moving_rope(), scenario, MATERIAL, effects).series.points
    return float(np.sqrt(np.mean((made - part.points) ** 2)))


@pytest.mark.parametrize(
    "effect",
    [
        ActuatorLag(time_constant=0.05),
        CameraLatency(latency=0.05),
        CameraOffset(x=0.01, z=-0.005),
        CameraRotation(about_y=0.02, about_x=-0.01),
    ],
    ids=lambda effect: effect.name,
)
def test_the_true_effect_explains_a_piece_as_well_as_one_without_an_effect(effect):
    whole = swung()
    plain, true = (rollout(moving_rope(), whole, MATERIAL, e).series for e in ([], [effect]))
    floor = off(*piece_of(plain, whole.motion), [])
    piece, part = piece_of(true, whole.motion)
    assert floor < 0.003
    assert off(piece, part, [effect]) < 1.2 * floor
    made = rollout(moving_rope(), piece, MATERIAL, [effect]).series.points
    np.testing.assert_allclose(made[0], part.points[0], atol=1e-3)  # it starts where it was seen


def test_a_late_picture_shows_markers_beside_a_rope_as_it_was_turned_then():
    whole = swung()
    roll = 0.75 * np.sin(2 * np.pi * 0.8 * whole.motion.times)
    poses = whole.motion.poses.copy()
    poses[:, :, 3:] = np.stack([np.cos(roll), np.sin(roll), 0 * roll, 0 * roll], axis=1)[:, None]
    beside = Beside(np.tile([0.0, 0.01], (len(whole.markers), 1)), 0.0)
    rolling = replace(whole, times=TIMES[:60:5], motion=Motion(whole.motion.times, poses), beside=beside)
    plain, late = (
        rollout(moving_rope(), rolling, MATERIAL, e).series.points for e in ([], [CameraLatency(latency=0.05)])
    )
    np.testing.assert_allclose(late[1:], plain[:-1], atol=1e-9)


def test_several_are_undone_in_turn():
    effects = [CameraRotation(about_y=0.02), CameraOffset(x=0.01), CameraLatency(latency=0.03)]
    whole = swung()
    piece, part = piece_of(rollout(moving_rope(), whole, MATERIAL, effects).series, whole.motion)
    made = rollout(moving_rope(), piece, MATERIAL, effects).series.points
    np.testing.assert_allclose(made[0], part.points[0], atol=1e-3)


def test_a_table_off_level_does_not_turn_what_flies_above_it():
    """It starts as fast as it was, whichever way the table leans."""
    body = rope_line(np.array([[0.0, 0.0, 0.0], [0.5, 0.0, 0.0]]), 11)
    still = Motion.from_positions(np.zeros(1), np.array([[[0.0, 0.0, 10.0]]]))
    speed = StartMotion(np.tile([2.0, 1.0, 0.0], (2, 1)), np.zeros((2, 3)))
    thrown = Scenario(
        "thrown",
        body,
        (),
        still,
        TIMES[:40],
        np.eye(11),
        np.zeros(0, np.int64),
        obstacles=(Table(0.0),),
        start_motion=speed,
    )
    plain, tilted = (rollout(moving_rope(), thrown, MATERIAL, e).vertices for e in ([], [TableTilt(about_x=0.035)]))
    assert np.abs(plain[-1] - plain[0]).max() > 0.5
    np.testing.assert_allclose(tilted, plain, atol=1e-6)
