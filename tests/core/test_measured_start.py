"""Ropes that start as they were measured."""

import pickle
from dataclasses import replace

import numpy as np
import pytest

from muslin.core.errors import InputError
from muslin.core.measurement import Recording
from muslin.core.motion import Motion
from muslin.core.refinement import refined
from muslin.core.scenario import Scenario
from muslin.core.scenarios import preset
from muslin.core.scenarios.measured import measured_start, motion_at, with_earlier
from muslin.core.series import PointSeries

TURN = np.array([np.cos(0.3), 0.0, np.sin(0.3), 0.0])


def recorded(points: np.ndarray) -> tuple[Scenario, Recording]:
    time = np.array([0.0, 1.0])
    poses = np.stack([np.concatenate([points[k], TURN]) for k in (0, -1)])
    motion = Motion(time, np.stack([poses, poses + 0.0]))
    recording = Recording("take", PointSeries(time, np.stack([points, points])), motion)
    return preset("cable").scenario((1.2,), (31,)).for_recording(recording), recording


def arc(places: np.ndarray) -> np.ndarray:
    """On a circle of radius 0.4 m."""
    return np.asarray(np.stack([0.4 * np.sin(places), 0.1 + 0.0 * places, 1.0 - 0.4 * np.cos(places)], axis=1))


def test_it_goes_through_the_markers_and_is_as_long_as_the_curve() -> None:
    angles = np.array([-1.2, -1.1, -0.8, -0.4, -0.1, 0.25, 0.6, 0.9, 1.1, 1.2])
    made = measured_start(*recorded(arc(angles)))
    start = made.start_vertices()
    np.testing.assert_allclose(made.markers @ start, arc(angles), atol=6e-4)  # between vertices it is straight
    np.testing.assert_allclose(np.linalg.norm(start - [0.0, 0.1, 1.0], axis=1), 0.4, atol=5e-4)
    links = np.linalg.norm(np.diff(start, axis=0), axis=1)
    np.testing.assert_allclose(links, made.body.measures, rtol=1e-3)  # neither stretched nor slack
    assert made.body.measures.sum() == pytest.approx(0.4 * 2.4, rel=2e-3)
    np.testing.assert_allclose(made.markers.sum(axis=1), 1.0)


def test_it_is_there_at_the_first_frame_and_not_settled_before() -> None:
    scenario, recording = recorded(arc(np.linspace(-1.0, 1.0, 9)))
    assert scenario.settle > 0  # of the built-in cable
    assert measured_start(scenario, recording).settle == 0.0


def test_it_is_for_points_in_space() -> None:
    scenario, recording = recorded(arc(np.linspace(-1.0, 1.0, 9)))
    series = recording.series
    pixels = replace(recording, series=PointSeries(series.time, series.points[..., :2], "px"))
    with pytest.raises(InputError, match=r"recording 'take' is in pixels, .* only points in metres"):
        measured_start(scenario, pixels)
    flat = replace(recording, series=PointSeries(series.time, series.points[..., :2]))
    with pytest.raises(InputError, match=r"recording 'take' has points \(x, y\) in metres"):
        measured_start(scenario, flat)


def test_it_survives_refinement_and_pickling() -> None:
    made = measured_start(*recorded(arc(np.linspace(-1.0, 1.0, 9))))
    fine = refined(made)
    assert fine is not None
    start = pickle.loads(pickle.dumps(fine)).start_vertices()
    assert len(start) == 61
    np.testing.assert_allclose(start[::2], made.start_vertices(), atol=1e-9)


def test_what_cannot_be_is_said() -> None:
    points = arc(np.linspace(-1.0, 1.0, 9))
    hidden = points.copy()
    hidden[4, 1] = np.nan
    with pytest.raises(InputError, match=r"'take': every marker must be seen"):
        measured_start(*recorded(hidden))
    points[3] = points[4]
    with pytest.raises(InputError, match="markers 3 and the next are at one place"):
        measured_start(*recorded(points))


@pytest.mark.parametrize(("noise", "slack"), [(0.0, 1e-6), (2e-5, 0.02), (1e-3, 0.06)])
def test_it_starts_as_fast_as_its_markers(noise: float, slack: float) -> None:
    """Markers on parabolas: the more noise, the longer the stretch from which their velocity is told."""
    places = np.linspace(-1.0, 1.0, 9)
    time = np.arange(0.0, 1.0, 0.01)
    velocity = np.array([0.2, -0.5, 0.3]) * (1 + places[:, None])
    path = arc(places) + time[:, None, None] * velocity + 0.5 * time[:, None, None] ** 2 * np.array([0.0, 0.0, -2.0])
    path += np.random.default_rng(0).normal(0, noise, path.shape)
    motion = motion_at(PointSeries(time, path), 0.0, places - places[0])
    assert motion is not None
    speeds, changes = motion.along(9)
    assert np.abs(speeds - velocity).max() < slack
    assert np.sqrt(np.mean((changes - [0.0, 0.0, -2.0]) ** 2)) < 20 * slack


def test_a_marker_that_is_lost_at_first_moves_with_its_neighbours() -> None:
    places, time = np.linspace(-1.0, 1.0, 9), np.arange(0.0, 0.5, 0.01)
    path = arc(places) + time[:, None, None] * np.array([0.4, 0.0, 0.0])
    path[1:40, 3] = np.nan
    motion = motion_at(PointSeries(time, path), 0.0, places - places[0])
    assert motion is not None
    np.testing.assert_allclose(motion.velocities, np.tile([0.4, 0.0, 0.0], (len(motion.velocities), 1)), atol=1e-9)


def test_two_frames_tell_no_velocity() -> None:
    assert measured_start(*recorded(arc(np.linspace(-1.0, 1.0, 9)))).start_motion is None


def swung(rate: float = 3.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Frames of a rope that swings to and fro so often a second, its markers' velocities and accelerations in them."""
    places, time = np.linspace(-1.0, 1.0, 9), np.arange(0.0, 2.0, 0.01)
    turn = 2.0 * np.pi * rate
    phase = turn * time[:, None, None] + places[:, None]
    across = np.array([0.0, 0.04, 0.02]) * (1.0 - places[:, None] ** 2)
    path = arc(places) + across * np.sin(phase)
    path += np.random.default_rng(1).normal(0, 3e-5, path.shape)
    return path, turn * across * np.cos(phase), -(turn**2) * across * np.sin(phase)


def test_frames_before_and_after_tell_motion_better_than_those_after() -> None:
    path, speeds, changes = swung()
    time, along = np.arange(len(path)) * 0.01, np.linspace(0.0, 2.0, 9)
    errors = []
    for frame in range(20, 180, 7):
        for first in (0, frame):
            told = motion_at(PointSeries(time[first:], path[first:]), time[frame], along)
            assert told is not None
            speed, change = told.along(9)
            errors.append([np.abs(speed - speeds[frame]).max(), np.abs(change - changes[frame]).max()])
    both, after = np.reshape(errors, (-1, 2, 2)).max(axis=0)
    assert (both < [0.02, 1.5]).all(), both  # of 0.75 m/s and 14 m/s2
    assert (3.0 * both < after).all(), (both, after)


def test_a_piece_starts_as_fast_as_the_whole_recording_tells() -> None:
    path, speeds, _ = swung()
    scenario, recording = recorded(path[0])
    time = np.arange(len(path)) * 0.01
    poses = np.stack([np.concatenate([path[:, k], np.tile(TURN, (len(path), 1))], axis=1) for k in (0, -1)], axis=1)
    whole = replace(recording, series=PointSeries(time, path), motion=Motion(time, poses))
    piece = replace(whole, series=PointSeries(time[87:], path[87:]))
    alone = measured_start(scenario.for_recording(piece), piece)
    made = with_earlier(alone, whole)
    assert made.earlier is not None
    assert made.start_motion is not None
    assert alone.start_motion is not None
    far = [np.abs(s.along(9)[0] - speeds[87]).max() for s in (made.start_motion, alone.start_motion)]
    assert 2.0 * far[0] < far[1]
    assert with_earlier(measured_start(scenario.for_recording(whole), whole), whole).earlier is None


@pytest.mark.parametrize("lost", [3, 20])
@pytest.mark.parametrize(("rate", "slack"), [(3.0, 0.06), (8.0, 0.6)])  # of 0.75 and 2 m/s
def test_after_a_gap_the_frames_after_it_tell_how_fast(rate: float, slack: float, lost: int) -> None:
    path, speeds, _ = swung(rate)
    path[90 - lost : 90] = np.nan
    told = motion_at(PointSeries(np.arange(len(path)) * 0.01, path), 0.9, np.linspace(0.0, 2.0, 9))
    assert told is not None
    assert np.abs(told.along(9)[0] - speeds[90]).max() < slack
