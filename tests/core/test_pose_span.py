"""Poses that begin after the points or end before them: said where the gripper moves there."""

from dataclasses import replace

import numpy as np
import pytest

from muslin.core.measurement import Recording
from muslin.core.motion import IDENTITY_POSE, Motion
from muslin.core.pose_span import uncovered
from muslin.core.series import PointSeries

POINTS = PointSeries(np.linspace(0.0, 1.8, 181), np.ones((181, 2, 3)))


def along(times: np.ndarray, way: np.ndarray) -> Recording:
    """A gripper that is ``way`` [m] along x at ``times`` [s]."""
    positions = np.zeros((len(times), 1, 3))
    positions[:, 0, 0] = way
    return Recording("a", POINTS, Motion.from_positions(times, positions))


def test_a_gripper_that_is_last_seen_in_motion() -> None:
    said = [
        "the gripper poses end at 0.63 s, the points go on to 1.8 s; the gripper is taken to stand still from there; "
        "if it did not, import up to --stop 0.63"
    ]
    times = np.linspace(0.0, 0.63, 64)
    assert uncovered(along(times, 0.1 * times)) == said
    assert uncovered(along(times[[0, -1]], np.array([0.0, 0.1]))) == said
    turning = np.tile(IDENTITY_POSE, (64, 1, 1))
    turning[:, 0, 3:5] = np.stack([np.cos(times), np.sin(times)], axis=1)
    assert uncovered(Recording("a", POINTS, Motion(times, turning))) == said


def test_a_gripper_that_is_first_seen_in_motion() -> None:
    [said] = uncovered(along(np.linspace(0.4, 1.8, 141), np.linspace(0.0, 0.1, 141)))
    assert said.startswith("the gripper poses begin at 0.4 s, the points at 0 s;") and said.endswith("--start 0.4")


def test_a_clock_that_counts_from_1970_is_told_so_that_it_can_be_given_back() -> None:
    epoch = 1.7e9
    series = PointSeries(POINTS.time + epoch, POINTS.points)
    take = along(np.linspace(0.4, 1.8, 141) + epoch, np.linspace(0.0, 0.1, 141))
    [said] = uncovered(replace(take, series=series))
    assert said.startswith("the gripper poses begin at 1700000000.4 s") and said.endswith("--start 1700000000.4")


@pytest.mark.parametrize(
    "recording",
    [
        Recording("a", POINTS),
        Recording("a", POINTS, Motion.still()),
        along(np.linspace(0.0, 1.78, 179), np.linspace(0.0, 0.3, 179)),  # two frames earlier
        along(np.linspace(0.0, 1.6, 9), np.linspace(0.0, 0.3, 9)),  # one of its own poses earlier
        along(np.linspace(-1.0, 3.0, 50), np.linspace(0.0, 0.3, 50)),
        along(np.linspace(0.3, 1.3, 101), np.clip(np.linspace(-0.1, 0.2, 101), 0.0, 0.1)),  # rests before and after
    ],
)
def test_nothing_is_said_where_nothing_is_lost(recording: Recording) -> None:
    assert uncovered(recording) == []
