"""First-order lag against closed forms."""

import numpy as np
import pytest
from effect_objects import cases, engine
from hypothesis import given
from hypothesis import strategies as st

from muslin.core.body import cloth_grid
from muslin.core.material import ClothMaterial
from muslin.core.motion import Motion
from muslin.core.rollout import COMMAND_STEP, rollout
from muslin.core.scenario import Scenario
from muslin.plugins.effects.command import ActuatorLag

STEP = 0.005


def along_x(times, places):
    return Motion.from_positions(np.asarray(times, float), np.asarray(places, float)[:, None, None] * [1.0, 0.0, 0.0])


def lagged(motion, tau, times, step=STEP):
    return ActuatorLag(time_constant=tau).on_command(motion, step).at(np.asarray(times, float))


def turning(times, angles):
    """About x by ``angles`` [rad]."""
    half = 0.5 * np.asarray(angles, float)
    poses = np.zeros((len(half), 1, 7))
    poses[:, 0, 3], poses[:, 0, 4] = np.cos(half), np.sin(half)
    return Motion(np.asarray(times, float), poses)


@pytest.mark.parametrize("tau", [0.002, 0.02, 0.1])
def test_ramp_comes_tau_late(tau):
    """u = r t gives y = r (t - tau (1 - exp(-t / tau))): exact, since the command is linear."""
    times = np.arange(200) * STEP
    got = lagged(along_x([0.0, 2.0], [0.0, 1.0]), tau, times)[:, 0, 0]
    np.testing.assert_allclose(got, 0.5 * (times - tau * (1 - np.exp(-times / tau))), atol=1e-13)
    late = times[-1] - 2 * got[-1]
    assert late == pytest.approx(tau, rel=1e-3)


@pytest.mark.parametrize("tau", [0.002, 0.02, 0.1])
def test_step_response(tau):
    """1 - exp(-t / tau) after a command that jumps within a time step, to how long the jump takes."""
    times = np.arange(1, 100) * STEP
    got = lagged(along_x([0.0, STEP, 1.0], [0.0, 1.0, 1.0]), tau, times)[:, 0, 0]
    jump = tau / STEP * (np.exp(STEP / tau) - 1)  # the same response, smeared over the jump
    np.testing.assert_allclose(got, 1 - jump * np.exp(-times / tau), atol=1e-13)
    assert (got <= 1).all()
    assert (1 - np.exp(-times / tau) >= got).all()
    assert (got >= 1 - np.exp(-(times - STEP) / tau) - 1e-15).all()


@cases
@given(st.floats(1e-4, 0.1), st.lists(st.floats(-1.0, 1.0), min_size=2, max_size=12))
def test_never_leaves_the_range_of_the_command_and_arrives(tau, places):
    """A first-order lag does not overshoot; ten tau after the last command it is there to exp(-10)."""
    motion = along_x(0.02 * np.arange(len(places)), places)
    made = ActuatorLag(time_constant=tau).on_command(motion, STEP)
    x = made.poses[:, 0, 0]
    assert min(places) - 1e-12 <= x.min() <= x.max() <= max(places) + 1e-12
    assert made.poses[0, 0, 0] == places[0]
    assert x[-1] == pytest.approx(places[-1], abs=1e-4 * (1 + np.ptp(places)))


def test_the_time_step_does_not_matter():
    """For a command whose corners lie on steps of both."""
    motion = along_x(np.arange(11) * 0.02, np.sin(np.arange(11.0)))
    times = np.arange(0.0, 0.3, 0.01)
    np.testing.assert_allclose(lagged(motion, 0.03, times, 0.01), lagged(motion, 0.03, times, 0.001), atol=1e-12)


def test_is_resampled_at_the_time_step_from_the_first_command_on():
    made = ActuatorLag(time_constant=0.03).on_command(along_x([0.5, 1.0], [0.0, 1.0]), STEP)
    np.testing.assert_allclose(np.diff(made.times), STEP)
    assert made.times[0] == 0.5
    assert made.times[-1] >= 1.0 + 10 * 0.03


@pytest.mark.parametrize("tau", [1e-9, 1e-5])
def test_no_time_to_speak_of_is_no_lag(tau):
    times = np.arange(0.0, 1.0, STEP)
    motion = along_x(np.linspace(0, 1, 21), np.sin(np.linspace(0, 6, 21)))
    np.testing.assert_allclose(lagged(motion, tau, times), motion.at(times), atol=10 * tau)


def test_a_long_time_hardly_moves():
    got = lagged(along_x([0.0, STEP, 0.1], [0.0, 1.0, 1.0]), 10.0, [0.1])[0, 0, 0]
    assert got == pytest.approx(0.0975 / 10.0, rel=0.01)


def test_a_single_pose_stays():
    still = Motion.still(2)
    assert ActuatorLag(time_constant=0.05).on_command(still, STEP) is still


def test_a_gripper_at_rest_stays_at_rest():
    motion = along_x([0.0, 1.0], [0.3, 0.3])
    np.testing.assert_allclose(lagged(motion, 0.05, [0.0, 0.4, 2.0])[:, 0, 0], 0.3, rtol=1e-13)


def test_grippers_lag_each_for_itself():
    places = np.zeros((3, 2, 3))
    places[1:, 1, 2] = 1.0
    made = ActuatorLag(time_constant=0.03).on_command(Motion.from_positions(np.array([0.0, 0.1, 0.2]), places), STEP)
    np.testing.assert_array_equal(made.poses[:, 0, :3], 0.0)
    alone = lagged(along_x([0.0, 0.1, 0.2], [0.0, 1.0, 1.0]), 0.03, made.times)
    np.testing.assert_allclose(made.poses[:, 1, 2], alone[:, 0, 0], atol=1e-12)


@pytest.mark.parametrize("tau", [0.005, 0.05])
def test_quaternions_stay_of_length_one_and_turning_lags_as_moving_does(tau):
    """A slow turn comes tau late too; the quaternions are chords, so by a few thousandths of a radian."""
    motion = turning(np.linspace(0, 1, 101), np.linspace(0, 1.5, 101))
    made = ActuatorLag(time_constant=tau).on_command(motion, STEP)
    np.testing.assert_allclose(np.linalg.norm(made.poses[..., 3:], axis=-1), 1.0, rtol=1e-12)
    got = 2 * np.arctan2(made.poses[:200, 0, 4], made.poses[:200, 0, 3])
    t = made.times[:200]
    np.testing.assert_allclose(got, 1.5 * (t - tau * (1 - np.exp(-t / tau))), atol=3e-3)


def test_the_sign_of_a_quaternion_does_not_matter():
    motion = turning(np.linspace(0, 1, 21), np.linspace(0, 3, 21))
    signs = np.where(np.arange(21) % 3 == 1, -1.0, 1.0)[:, None, None]
    other = Motion(motion.times, np.concatenate([motion.poses[..., :3], signs * motion.poses[..., 3:]], axis=-1))
    times = np.linspace(0, 1.2, 50)
    one, two = lagged(motion, 0.05, times)[..., 3:], lagged(other, 0.05, times)[..., 3:]
    np.testing.assert_allclose(np.abs(np.sum(one * two, axis=-1)), 1.0, rtol=1e-9)
    assert 2 * np.arccos(np.abs(one[-1, 0, 0])) == pytest.approx(3.0, abs=0.02)


def test_the_object_follows_the_lagging_gripper():
    """What a rollout holds, and the poses it reports, are the lagging ones."""
    times = np.arange(41) * STEP
    body = cloth_grid(0.1, 0.1, 3, 3)
    task = Scenario(
        name="carry",
        body=body,
        grasps=(np.array([0, 2]),),
        motion=along_x([0.0, 0.1, 0.2], [0.0, 0.05, 0.05]),
        times=times,
        markers=np.eye(9),
        load_vertices=np.zeros(0, np.int64),
    )
    done = rollout(engine(), task, ClothMaterial(stretch_stiffness=60.0), [ActuatorLag(time_constant=0.03)])
    expected = ActuatorLag(time_constant=0.03).on_command(task.motion, COMMAND_STEP).at(times)
    np.testing.assert_allclose(done.poses, expected, atol=1e-12)
    moved = done.vertices[:, [0, 2]] - done.vertices[0, [0, 2]]
    np.testing.assert_allclose(moved, np.repeat(expected[:, :, :3], 2, axis=1), atol=1e-12)
