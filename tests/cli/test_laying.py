"""A sheet laid under its markers, as ``muslin new`` does it where a scenario puts its object elsewhere."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from typer.testing import CliRunner

from muslin.cli.laying import seen_sheet
from muslin.cli.main import app
from muslin.core.measurement import Measurement, Recording
from muslin.core.measurement_store import save_measurement
from muslin.core.motion import Motion
from muslin.core.scenarios import preset
from muslin.core.series import PointSeries
from muslin.core.study import Study, read_config

#: Of a hanging cloth of 0.5 x 0.3 m: width along x, from the middle; height along z, from the top edge.
CORNERS = np.array([[-0.25, 0.0, 0.0], [0.25, 0.0, 0.0]])
MARKERS = np.array(
    [[-0.24, -0.01], [0.1, -0.02], [0.25, -0.09], [-0.25, -0.17], [0.04, -0.13], [0.21, -0.3], [-0.1, -0.29]]
)


def hanging(
    yaw: float = 0.0, shift: tuple[float, ...] = (0.0, 0.0, 0.0), noise: float = 0.0, seed: int = 0
) -> np.ndarray:
    """Markers in six frames, of which four are before anything moves ``(6, 7, 3)``; the corners likewise."""
    places = np.vstack([np.stack([MARKERS[:, 0], 0 * MARKERS[:, 0], MARKERS[:, 1]], axis=1), CORNERS])
    placed = Rotation.from_euler("z", yaw).apply(places) + shift
    moving = np.array([0.0, 0.0, 0.0, 0.0, 0.1, 0.2])[:, None, None] * [0.0, 1.0, 0.5]
    points = placed + moving
    points[:, :-2] += noise * np.random.default_rng(seed).normal(size=points[:, :-2].shape)
    return points


def take(points: np.ndarray, grippers: np.ndarray | None, name: str = "one") -> Recording:
    times = np.arange(len(points)) / 20.0
    motion = None if grippers is None else Motion.from_positions(times, grippers)
    return Recording(name, PointSeries(times, points), motion, motion=name)


@given(st.floats(-3.0, 3.0), st.tuples(*[st.floats(-2.0, 2.0)] * 3), st.booleans())
def test_two_grippers_hold_the_corners_of_a_cloth_wherever_it_hangs(yaw: float, shift: tuple, other_way: bool) -> None:
    points = hanging(yaw, shift)
    markers, hands = points[:, :-2], points[:, [-1, -2] if other_way else [-2, -1]]
    sheet = seen_sheet(preset("fling"), [take(markers, hands), take(markers + 0.3, hands + 0.3, "two")], [])
    assert sheet is not None and sheet.grasps is not None
    np.testing.assert_allclose(sheet.size, [0.5, 0.3], atol=2e-3)
    assert min(sheet.counts) == 9 and not sheet.known
    body = preset("fling").body(sheet.size, sheet.counts)
    np.testing.assert_allclose(
        [np.linalg.norm(body.vertices[sheet.grasps[g][0]] - sheet.markers[0]) for g in range(2)],
        np.linalg.norm(hands[0] - markers[0, 0], axis=1),
        atol=3e-3,
    )
    apart = np.linalg.norm(np.array(sheet.markers)[:, None] - np.array(sheet.markers)[None], axis=2)
    np.testing.assert_allclose(apart, np.linalg.norm(markers[0, :, None] - markers[0, None], axis=2), atol=3e-4)


def test_markers_inside_a_cloth_of_a_size_that_is_told_hang_from_its_grippers() -> None:
    points = hanging()
    inner = points[:, [1, 3, 4, 6]] * [0.5, 1.0, 0.5]
    sheet = seen_sheet(preset("fling"), [take(inner, points[:, -2:])], [0.5, 0.3])
    assert sheet is not None and sheet.known and sheet.size == [0.5, 0.3]
    np.testing.assert_allclose(np.abs(np.array(sheet.markers)[:, [0, 2]]), np.abs(inner[0][:, [0, 2]]), atol=1e-3)
    assert seen_sheet(preset("fling"), [take(inner, points[:, -2:])], [0.2, 0.3]) is None  # they do not fit on it


def test_one_gripper_holds_what_the_scenario_says_and_none_the_upper_edge() -> None:
    points = hanging(0.7, (1.0, 2.0, 3.0))
    for hands in (points[:, -2:].mean(axis=1, keepdims=True), None):
        sheet = seen_sheet(preset("carry"), [take(points[:, :-2], hands)], [])
        assert sheet is not None and sheet.grasps is None
        np.testing.assert_allclose(
            sheet.size, [0.5, 0.3], atol=0.02
        )  # the outermost markers are 10 mm from the corners
        assert np.array(sheet.markers)[[0, 1], 2].min() > -0.03 > np.array(sheet.markers)[[5, 6], 2].max()


def test_noise_is_averaged_over_frames_and_takes() -> None:
    takes = [hanging(0.1 * k, (k, 0.0, 0.0), noise=0.003, seed=k) for k in range(4)]
    sheet = seen_sheet(preset("fling"), [take(p[:, :-2], p[:, -2:], str(k)) for k, p in enumerate(takes)], [])
    assert sheet is not None
    away = np.abs(np.array(sheet.markers)[:, [0, 2]]) - np.abs(MARKERS)
    assert np.sqrt(np.mean(away**2)) < 0.0015  # 0.75 of sixteen frames


def test_what_does_not_lie_flat_is_no_sheet() -> None:
    points = hanging()
    bent = points.copy()
    bent[:, :, 1] += 2.0 * bent[:, :, 0] ** 2
    rope = points * [1.0, 1.0, 0.01]
    far = points[:, -2:] + [0.0, 0.5, 0.4]
    for markers, hands in ((bent[:, :-2], points[:, -2:]), (rope[:, :-2], points[:, -2:]), (points[:, :-2], far)):
        assert seen_sheet(preset("fling"), [take(markers, hands)], []) is None
    lost = points[:, :-2].copy()
    lost[:4, 2] = np.nan
    assert seen_sheet(preset("fling"), [take(lost, points[:, -2:])], []) is None


def new(folder: Path, recording: Recording, *arguments: str) -> str:
    save_measurement(Measurement((recording,)), folder / "m.zarr")
    given = ["new", str(folder / "study.toml"), "--measurement", str(folder / "m.zarr"), "--scenario", "fling"]
    done = CliRunner().invoke(app, [*given, *arguments])
    assert done.exit_code == 0, done.output
    return " ".join(done.output.split())


@pytest.mark.parametrize("grid", [False, True])
def test_two_grippers_are_given_the_corners_that_they_hold(tmp_path: Path, grid: bool) -> None:
    """Whether the points are a grid or not: the scenario alone would hang all of it on the first of them."""
    pytest.importorskip("mujoco")
    points = hanging(0.7, (1.0, 2.0, 3.0))
    markers = points[:, :-2]
    if grid:
        u, v = np.meshgrid(np.linspace(-0.25, 0.25, 5), np.linspace(0.0, -0.3, 4))
        places = Rotation.from_euler("z", 0.7).apply(np.stack([u.ravel(), 0 * u.ravel(), v.ravel()], axis=1))
        markers = places + points[:, -2:].mean(axis=1, keepdims=True)
    recording = take(markers, points[:, -2:])
    said = new(tmp_path, recording)
    assert "flat sheet of 0.5 x 0.3 m" in said and "gripper 1 holds vertex" in said and "warning" not in said
    config = read_config(tmp_path / "study.toml").scenario
    assert config.frame == "markers" and config.grasps is not None and len(config.grasps) == 2
    scenario = Study.load(tmp_path / "study.toml").problem.scenarios["one"]
    assert np.abs(scenario.markers @ scenario.start_vertices() - markers[0]).max() < 2e-3
    hands = scenario.start_vertices()[[v[0] for v in config.grasps]]
    assert np.abs(hands - points[0, -2:]).max() < 2e-3


@pytest.mark.parametrize("inwards", [0.0, 0.05])
def test_grippers_hold_the_corners_of_a_cloth_that_bulges_between_them(tmp_path: Path, inwards: float) -> None:
    """As it does if they are nearer to each other than it is wide; its markers may end before its edges."""
    pytest.importorskip("mujoco")
    u, v = np.meshgrid(np.linspace(-0.25 + inwards, 0.25 - inwards, 7), np.linspace(-inwards, -0.3 + inwards, 5))

    def bulging(u: np.ndarray, v: np.ndarray) -> np.ndarray:
        return np.stack([1.0 + 0.2 * np.sin(u / 0.2), 2.0 + 0.2 * np.cos(u / 0.2), 3.0 + v], axis=1)

    markers, corners = (np.tile(bulging(*x), (3, 1, 1)) for x in ((u.ravel(), v.ravel()), CORNERS[:, ::2].T))
    said = new(tmp_path, take(markers, corners), *(["--size", "0.5,0.3"] if inwards else []))
    assert "bent sheet of 0." in said and "warning" not in said
    config = read_config(tmp_path / "study.toml").scenario
    assert config.size is not None and config.grasps is not None
    np.testing.assert_allclose(config.size, [0.5, 0.3], rtol=0.02)
    scenario = Study.load(tmp_path / "study.toml").problem.scenarios["one"]
    start = scenario.start_vertices()
    np.testing.assert_allclose(scenario.markers @ start, markers[0], atol=4e-3)
    np.testing.assert_allclose(start[[v[0] for v in config.grasps]], corners[0], atol=0.015 + 0.2 * inwards)


def test_what_goes_with_the_scenario_is_left_to_it(tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    scenario = preset("fling").scenario()
    markers = np.tile(scenario.start_vertices()[[0, 8, 40, 76]], (3, 1, 1))
    said = new(tmp_path, take(markers, np.tile(scenario.motion.poses[0, :, :3], (3, 1, 1))))
    assert "placed on the nearest vertices" in said and read_config(tmp_path / "study.toml").scenario.frame == "gripper"
