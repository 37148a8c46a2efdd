"""Of what a scenario's one gripper holds, ``muslin new`` keeps what stays in the hand."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from typer.testing import CliRunner

from muslin.cli.holding import moving_in_the_hand
from muslin.cli.main import app
from muslin.core.measurement import Measurement, Recording
from muslin.core.measurement_store import save_measurement
from muslin.core.motion import Motion
from muslin.core.series import PointSeries
from muslin.core.study import Study, read_config

TIME = np.arange(0.0, 2.0, 0.02)
#: Markers on a cloth of 0.3 x 0.3 m that hangs from its top edge, by row: x to the right, z up.
SHEET = np.array([[x, 0.0, z] for z in np.linspace(0.0, -0.3, 5) for x in np.linspace(-0.15, 0.15, 5)])
TOP_LEFT, TOP_MIDDLE, TOP_RIGHT = 0, 2, 4
START = np.array([0.5, 0.2, 1.0])


def swung(pivot: np.ndarray, axis: tuple[float, float, float], late: float = 0.0, seed: int = 0) -> Recording:
    """The sheet turns as a whole about what of it is held by a hand that moves, seen with 1 mm of noise."""
    rng = np.random.default_rng(seed)

    def hand(time: np.ndarray) -> np.ndarray:
        moved = 0.1 * np.clip(time - 0.3, 0.0, None) * np.sin(5.0 * (time - 0.3))
        return pivot + START + moved[:, None] * [1.0, 0.3, 0.0]

    angle = 0.4 * np.clip(TIME - 0.3, 0.0, 0.5) * np.sin(4.0 * (TIME - 0.3))
    turns = Rotation.from_rotvec(angle[:, None] * np.array(axis))
    points = np.stack([turn.apply(SHEET - pivot) for turn in turns]) + hand(TIME)[:, None]
    points = points + rng.normal(0.0, 0.001, points.shape)
    points[rng.random(points.shape[:2]) < 0.03] = np.nan
    points[0] = SHEET + START
    motion = Motion.from_positions(TIME, hand(TIME + late)[:, None])
    return Recording(f"take{seed}", PointSeries(TIME, points), motion)


@pytest.mark.parametrize("late", [0.0, 0.05])
def test_what_is_held_stays_in_the_hand_though_its_clock_is_late(late: float) -> None:
    moves = moving_in_the_hand([swung(SHEET[TOP_LEFT], (0.0, 1.0, 0.0), late, k) for k in (0, 1)])
    assert moves is not None
    assert moves[TOP_LEFT] < 0.3 * np.median(moves) and moves[[TOP_RIGHT, 20, 24]].min() > 0.8 * np.median(moves)


def test_a_marker_that_is_never_seen_is_told_nothing_of() -> None:
    take = swung(SHEET[TOP_LEFT], (0.0, 1.0, 0.0))
    take.series.points[:, 7] = np.nan
    moves = moving_in_the_hand([take])
    assert moves is not None
    assert np.flatnonzero(np.isnan(moves)).tolist() == [7]


def test_what_only_noise_moves_tells_nothing() -> None:
    assert moving_in_the_hand([swung(SHEET[TOP_LEFT], (0.0, 0.0, 0.0))]) is None


@pytest.mark.parametrize("pivot", [TOP_LEFT, TOP_RIGHT, TOP_MIDDLE])
@pytest.mark.parametrize("whole_edge", [False, True])
def test_a_new_study_holds_what_the_gripper_does(tmp_path: Path, pivot: int, whole_edge: bool) -> None:
    """If all of the edge stays it is both corners, as the scenario says."""
    pytest.importorskip("mujoco")
    axis = (1.0, 0.0, 0.0) if whole_edge else (0.0, 1.0, 0.0)
    takes = tuple(swung(SHEET[pivot], axis, seed=k) for k in range(2))
    save_measurement(Measurement(takes), tmp_path / "m.zarr")
    given = ["new", str(tmp_path / "s.toml"), "--measurement", str(tmp_path / "m.zarr"), "--scenario", "swing"]
    done = CliRunner().invoke(app, given)
    assert done.exit_code == 0, done.output
    assert ("does not stay where it is in the hand" in " ".join(done.output.split())) != whole_edge
    scenario = Study.load(tmp_path / "s.toml").problem.scenarios["take0"]
    held = scenario.start_vertices()[scenario.grasps[0]]
    wanted = SHEET[[TOP_LEFT, TOP_RIGHT]] if whole_edge else SHEET[[pivot]]
    assert len(held) == len(wanted)
    np.testing.assert_allclose(held, wanted + START, atol=5e-3)


def test_what_a_person_says_is_held_is(tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    save_measurement(Measurement((swung(SHEET[TOP_LEFT], (0.0, 1.0, 0.0)),)), tmp_path / "m.zarr")
    given = ["new", str(tmp_path / "s.toml"), "--measurement", str(tmp_path / "m.zarr"), "--scenario", "swing"]
    done = CliRunner().invoke(app, [*given, "--grasp-points", "0,0,0"])
    assert done.exit_code == 0, done.output
    config = read_config(tmp_path / "s.toml").scenario
    assert config.grasps is None and config.grasp_points == [(0.0, 0.0, 0.0)]
