"""Motions of the next experiment: what a robot is asked for keeps its limits, sample by sample of the file."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("scipy")

from muslin.core.arrays import FloatArray
from muslin.core.errors import InputError
from muslin.core.importing.gripper import read_gripper_csv, to_motion
from muslin.core.motion import IDENTITY_POSE, Motion, inverse, multiply
from muslin.core.obstacles import Table
from muslin.core.scenario import Scenario
from muslin.core.scenarios import preset, smooth_path
from muslin.inference.criticism.next.limits import Limits, angles, limits_within
from muslin.inference.criticism.next.playing import play, write_motion
from muslin.inference.criticism.next.shapes import Drawn, Shape, known_shapes

LIMITS = Limits(0.7, 6.0, (-0.1, 0.2, 0.0, 0.15, -0.05, 0.3), 0.5, 2.0, 2.0)
OPEN = replace(LIMITS, workspace=(-0.2, 0.2, -0.2, 0.2, -0.2, 0.3))
TURNED = np.array([0.3, -0.2, 1.0, np.cos(0.2), 0.0, 0.0, np.sin(0.2)])
ONE = TURNED[None]
TWO = np.stack([TURNED, TURNED + np.array([0.25, 0.1, 0.0, 0, 0, 0, 0])])


def hanging(motion: Motion) -> Scenario:
    return replace(preset("swing").scenario(size=[0.4], vertices=[5]), motion=motion, times=motion.times)


def shapes() -> list[Shape]:
    rng = np.random.default_rng(3)
    drawn = [Drawn(rng.random(Drawn.SIZE), LIMITS, 6.0) for _ in range(12)]
    edges = [Drawn(np.full(Drawn.SIZE, v), LIMITS, 6.0) for v in (0.0, 0.5, 1.0)]
    known = known_shapes({"own": hanging(preset("fling").motion())}, LIMITS)
    return [*drawn, *edges, *known, *(s.varied(0.3, rng) for s in (drawn[0], known[1], known[2]))]


def read_back(motion: Motion, folder: Path) -> Motion:
    write_motion(motion, folder / "motion.csv")
    return to_motion(read_gripper_csv(folder / "motion.csv", "any"), "m", "z", "motion.csv")


@pytest.mark.parametrize("start", [ONE, TWO], ids=["one gripper", "two grippers"])
def test_the_written_file_keeps_the_limits(start: FloatArray, tmp_path: Path) -> None:
    for shape in shapes():
        motion = read_back(play(shape, start, LIMITS), tmp_path)
        gap = np.diff(motion.times)[:, None, None]
        np.testing.assert_allclose(gap, 1 / LIMITS.rate, rtol=1e-6)
        position, turn = motion.poses[..., :3], motion.poses[..., 3:]
        velocity = np.diff(position, axis=0) / gap
        acceleration = np.diff(velocity, axis=0) / gap[1:]
        away = position - start[:, :3]
        slack = 1 + 1e-6
        assert np.linalg.norm(velocity, axis=2).max() <= LIMITS.speed * slack, shape.name
        assert np.linalg.norm(acceleration, axis=2).max() <= LIMITS.acceleration * slack, shape.name
        # from rest and to rest
        assert np.linalg.norm(velocity[[0, -1]] / gap[0], axis=2).max() <= LIMITS.acceleration * slack, shape.name
        assert (away >= LIMITS.low - 2e-9).all() and (away <= LIMITS.high + 2e-9).all(), shape.name
        assert angles(multiply(turn, inverse(start[:, 3:]))).max() <= LIMITS.turn * slack
        assert (angles(multiply(turn[1:], inverse(turn[:-1]))) / gap[:, 0]).max() <= LIMITS.turn_speed * slack
        np.testing.assert_allclose(motion.poses[0], start, atol=1e-8)


def test_a_file_holds_the_very_motion(tmp_path: Path) -> None:
    motion = play(Drawn(np.full(Drawn.SIZE, 0.9), LIMITS, 6.0), TWO, LIMITS)
    again = read_back(motion, tmp_path)
    np.testing.assert_allclose(again.times, motion.times, atol=1e-9)
    np.testing.assert_allclose(again.poses, motion.poses, atol=2e-9)


def test_members_of_the_family_move_turn_rest_and_keep_two_grippers_apart() -> None:
    rng = np.random.default_rng(0)
    moved, turned = [], []
    for _ in range(20):
        shape = Drawn(rng.random(Drawn.SIZE), OPEN, 6.0)
        motion = play(shape, TWO, OPEN)
        apart = np.linalg.norm(motion.poses[:, 0, :3] - motion.poses[:, 1, :3], axis=1)
        np.testing.assert_allclose(apart, apart[0], atol=1e-8)
        resting = motion.times > shape.active + 1e-9
        assert resting.sum() > 5
        np.testing.assert_allclose(motion.poses[resting], np.broadcast_to(motion.poses[-1], (resting.sum(), 2, 7)))
        moved.append(np.ptp(motion.poses[..., :3], axis=0).max())
        turned.append(angles(multiply(motion.poses[..., 3:], inverse(TWO[:, 3:]))).max())
    assert np.median(moved) > 0.03 and np.median(turned) > 0.01


def test_a_ready_made_motion_within_the_limits_is_played_as_it_is() -> None:
    wide = Limits(5.0, 100.0, (-1.0, 1.0) * 3, 0.0, 0.0, 3.0)  # type: ignore[arg-type]
    carry = preset("carry").motion()
    shape = next(s for s in known_shapes({}, wide) if "carry" in s.name)
    played = play(shape, IDENTITY_POSE[None], wide)
    meant = carry.at(played.times)[:, :, :3] - carry.poses[0, 0, :3]
    assert np.abs(played.poses[..., :3] - meant).max() < 0.004  # smoothed a little


def test_a_controller_of_a_thousand_hertz_is_sent_as_large_a_motion_from_rest_to_rest() -> None:
    """What is moving already as it begins, or still as it ends, is eased, or it would be made smaller with the step."""
    limits = replace(OPEN, workspace=(-0.2, 0.2, 0.0, 0.2, -0.2, 0.3))
    moving = replace(hanging(preset("fling").motion()), times=np.linspace(0.3, 0.9, 40))
    for shape in known_shapes({"cut": moving}, limits):
        if "hang" in shape.name:
            continue
        motions = [play(shape, ONE, replace(limits, rate=rate)) for rate in (100.0, 1000.0)]
        coarse, fine = (float(np.ptp(m.poses[..., :3], axis=0).max()) for m in motions)
        assert coarse > 0.025 and fine == pytest.approx(coarse, rel=0.05), shape.name
        speed = np.linalg.norm(np.diff(motions[1].poses[:, 0, :3], axis=0), axis=1)
        assert max(speed[0], speed[-1]) < 1e-3 * speed.max(), shape.name


def test_no_turn_is_made_where_none_is_allowed() -> None:
    still = replace(LIMITS, turn=0.0, turn_speed=0.0)
    motion = play(Drawn(np.ones(Drawn.SIZE), still, 6.0), ONE, still)
    np.testing.assert_allclose(motion.poses[..., 3:], np.broadcast_to(ONE[:, 3:], (len(motion.times), 1, 4)), atol=1e-9)


def test_limits_are_what_the_recordings_show() -> None:
    # a minimum-jerk move over d in T peaks at 15 d / 8 T and 10 d / sqrt(3) T^2 (Flash and Hogan 1985)
    d, t = 0.5, 0.8
    found = limits_within([hanging(smooth_path([(0, 0, 0, 1), (t, d, 0, 1)]))])
    assert found.speed == pytest.approx(15 * d / (8 * t), rel=0.03)
    assert found.acceleration == pytest.approx(10 * d / (np.sqrt(3) * t**2), rel=0.1)
    np.testing.assert_allclose(found.low, -0.1)
    np.testing.assert_allclose(found.high, [d, 0.1, 0.1], atol=1e-4)
    assert found.turn == 0.0
    beside = replace(hanging(smooth_path([(0, 0, 0, 1), (t, d, 0, 1)])), obstacles=(Table(0.0),))
    np.testing.assert_allclose(limits_within([beside]).workspace, [0, d, 0, 0, 0, 0.1], atol=1e-4)
    assert limits_within([beside], max_speed=2.0, workspace=(-1, 1, -1, 1, 0, 1)).speed == 2.0


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ({"max_speed": 0.0}, "speed"),
        ({"max_acceleration": float("nan")}, "acceleration"),
        ({"workspace": (0.1, 0.2, 0, 0, 0, 0)}, "x0"),
        ({"workspace": (0.0, 0.2)}, "six numbers"),
        ({"duration": 0.01}, "0.3 to 60"),
        ({"duration": 1.0, "rate": 5.0}, "20 Hz"),
        ({"max_turn": 9.0}, "may turn"),
    ],
)
def test_limits_that_no_motion_can_keep_are_refused(asked: dict[str, object], said: str) -> None:
    with pytest.raises(InputError, match=said):
        limits_within([hanging(preset("fling").motion())], **asked)  # type: ignore[arg-type]
