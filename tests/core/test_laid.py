"""Objects that start where their markers are seen."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from muslin.core.errors import InputError
from muslin.core.measurement import Recording
from muslin.core.motion import Motion
from muslin.core.refinement import refined
from muslin.core.scenarios import preset
from muslin.core.scenarios.laid import before_it_moves, laid_under
from muslin.core.series import PointSeries
from muslin.core.study import parse_config
from muslin.core.study.objects import build_scenario

PLACES = [[-0.2, 0.0, -0.01], [0.13, 0.0, -0.05], [0.07, 0.0, -0.21], [-0.11, 0.0, -0.3]]


def table(**scenario: object) -> dict[str, object]:
    given = {"name": "fling", "size": [0.4, 0.3], "vertices": [9, 7], "frame": "markers", "marker_points": PLACES}
    return {"study": {"measurement": "m"}, "scenario": {**given, **scenario}, "simulator": {"name": "mujoco"}}


def scenario_of(recording: Recording, **changes: object):
    return build_scenario(parse_config(table(**changes), "s.toml").scenario, recording, Path())


def seen(turn: Rotation, shift: np.ndarray, pose: np.ndarray | None = None, **changes: object) -> Recording:
    points = turn.apply(np.array(PLACES)) + shift
    poses = np.concatenate([turn.apply([[-0.2, 0, 0], [0.2, 0, 0]]) + shift, np.tile([1.0, 0, 0, 0], (2, 1))], axis=1)
    motion = Motion(np.zeros(1), poses[None] if pose is None else pose[None])
    return replace(Recording("one", PointSeries(0.1 * np.arange(3), np.tile(points, (3, 1, 1))), motion), **changes)


unit = st.floats(-1.0, 1.0)


@given(st.tuples(unit, unit, unit), st.tuples(unit, unit, unit), st.tuples(unit, unit, unit, unit))
def test_it_starts_where_its_markers_are_wherever_the_grippers_say_they_are(turn, shift, pose) -> None:
    """Whatever point of a gripper its pose is that of, and however it is turned."""
    turned, moved = Rotation.from_rotvec(3.0 * np.array(turn)), np.array(shift)
    quaternion = np.add(pose, [1.5, 0.0, 0.0, 0.0])
    hand = np.tile([*moved[::-1], *quaternion / np.linalg.norm(quaternion)], (2, 1))
    recording = seen(turned, moved, hand)
    scenario = laid_under(scenario_of(recording, grasps=[[0], [8]]), recording)
    np.testing.assert_allclose(scenario.markers @ scenario.start_vertices(), recording.series.points[0], atol=1e-9)
    corners = turned.apply([[-0.2, 0, 0], [0.2, 0, 0]]) + moved
    np.testing.assert_allclose(scenario.start_vertices()[[0, 8]], corners, atol=1e-9)
    held = scenario.held_positions(np.zeros(1), scenario.start_vertices())[0]
    np.testing.assert_allclose(held, corners, atol=1e-9)


@given(st.tuples(unit, unit, unit), st.tuples(unit, unit, unit), st.floats(0.3, 2.0))
def test_a_sheet_whose_markers_are_not_in_a_plane_starts_bent(turn, shift, curvature) -> None:
    """Through all of them, wherever it is; on a finer mesh it is the same sheet, and it is no larger than it was."""
    turned, moved = Rotation.from_rotvec(3.0 * np.array(turn)), np.array(shift)
    places = np.array([[x, 0.0, z] for x in np.linspace(-0.2, 0.2, 5) for z in np.linspace(0.0, -0.3, 4)])
    angle = curvature * 4.0 * places[:, 0]
    bent = np.stack([np.sin(angle), 1.0 - np.cos(angle), 4.0 * curvature * places[:, 2]], axis=1) / (4.0 * curvature)
    recording = seen(turned, moved)
    points = np.tile(turned.apply(bent) + moved, (3, 1, 1))
    recording = replace(recording, series=replace(recording.series, points=points))
    starts = []
    for vertices in ([9, 7], [17, 13]):
        scenario = scenario_of(recording, marker_points=places.tolist(), vertices=vertices)
        laid = laid_under(scenario, recording)
        start = laid.start_vertices()
        np.testing.assert_allclose(laid.markers @ start, points[0], atol=1e-3 if vertices[0] == 17 else 4e-3)
        edges = np.linalg.norm(np.diff(start.reshape(vertices[1], vertices[0], 3), axis=1), axis=2)
        np.testing.assert_allclose(edges, 0.4 / (vertices[0] - 1), rtol=0.08)
        starts.append(start.reshape(vertices[1], vertices[0], 3))
    np.testing.assert_allclose(starts[1][::2, ::2], starts[0], atol=1e-9)
    # carried along with the first gripper, and as much larger as the sheet is
    shape = np.linalg.norm(start[:, None] - start[None], axis=2)
    poses = laid.motion.poses + np.array([0.3, -0.2, 0.1, 0.0, 0.0, 0.0, 0.0])
    poses[..., 3:] = [0.8, 0.0, 0.6, 0.0]
    elsewhere = replace(laid, motion=Motion(laid.motion.times, poses)).start_vertices()
    np.testing.assert_allclose(np.linalg.norm(elsewhere[:, None] - elsewhere[None], axis=2), shape, atol=1e-9)
    larger = laid.start_vertices(scale=1.2)
    np.testing.assert_allclose(np.linalg.norm(larger[:, None] - larger[None], axis=2), 1.2 * shape, atol=1e-9)
    finer = refined(laid)
    assert finer is not None
    np.testing.assert_allclose(finer.start_vertices()[: len(start)], start, atol=1e-9)


def test_what_is_lost_at_first_is_told_by_the_frames_before_a_gripper_moves() -> None:
    times = np.arange(6) / 10.0
    moving = np.concatenate([np.zeros(4), [0.1, 0.2]])[:, None] * [1.0, 0.0, 0.0]
    points = np.array(PLACES) + moving[:, None]
    points[0, 1], points[1:4, 2], points[:4, 3, 0] = np.nan, np.nan, np.nan
    recording = Recording("one", PointSeries(times, points), Motion.from_positions(times, moving[:, None]))
    first, frames = before_it_moves(recording)
    assert frames == 4
    np.testing.assert_allclose(first[:3], PLACES[:3])
    assert np.isnan(first[3, 0])
    scenario = laid_under(scenario_of(recording), recording)
    np.testing.assert_allclose((scenario.markers @ scenario.start_vertices())[:3], PLACES[:3], atol=1e-9)


def test_what_does_not_tell_it_is_refused() -> None:
    recording = seen(Rotation.identity(), np.zeros(3))
    scenario = scenario_of(recording)
    points = recording.series.points.copy()
    points[:, 1:3] = np.nan
    lost = replace(recording, series=replace(recording.series, points=points))
    with pytest.raises(InputError, match="2 of 4 markers are seen before a gripper moves"):
        laid_under(scenario, lost)
    line = np.linspace(0, 1, 4)[:, None] * [0.1, 0.2, 0.3] + np.zeros((3, 1, 1))
    with pytest.raises(InputError, match="not on one line"):
        laid_under(scenario, replace(recording, series=replace(recording.series, points=line)))
    with pytest.raises(InputError, match="not followed"):
        laid_under(scenario, replace(recording, series=replace(recording.series, correspondence=False)))
    with pytest.raises(InputError, match="sit nowhere on the object"):
        laid_under(replace(scenario, markers=np.eye(63)), recording)
    rope = preset("cable").scenario()
    with pytest.raises(InputError, match="does not start in its rest shape"):
        laid_under(rope, recording)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"markers": [0, 1, 2, 3]}, "markers and marker_points both say"),
        ({"markers": "bound", "marker_points": None}, "frame = 'markers' lays the object under markers that sit"),
        (
            {"marker_points": [[0.5, 0.0, -0.1], *PLACES[1:]]},
            r"marker 0 at \[0.5, 0.0, -0.1\] m is not on the sheet",
        ),
        ({"marker_points": []}, "names 0 points, but recording 'one' has 4 points"),
        ({"marker_points": PLACES[:3]}, "names 3 points, but recording 'one' has 4 points"),
        ({"name": "cable", "size": [1.0], "vertices": [41]}, "for a cloth that is flat at rest, but this is a rope"),
        ({"start": "measured", "name": "cable", "size": None, "vertices": [41]}, "leave marker_points, frame out"),
    ],
)
def test_what_does_not_go_together_is_said(changes: dict[str, object], said: str) -> None:
    with pytest.raises(InputError, match=said):
        scenario_of(seen(Rotation.identity(), np.zeros(3)), **changes)
