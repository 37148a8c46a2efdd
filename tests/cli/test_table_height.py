"""The table is where a cloth lies on it, and the cloth is where its markers are, however the gripper is turned."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from typer.testing import CliRunner

from muslin.cli.main import app
from muslin.cli.table_height import seen_table
from muslin.core.measurement import Measurement, Recording
from muslin.core.measurement_store import save_measurement
from muslin.core.motion import Motion
from muslin.core.obstacles import Table
from muslin.core.scenarios import preset
from muslin.core.series import PointSeries
from muslin.core.study import Study

TIME = np.arange(0.0, 1.0, 0.05)
#: Every other vertex of the scenario's own cloth, which a gripper holds in the middle of an edge.
SHEET = preset("wiping").scenario().start_vertices().reshape(9, 9, 3)[::2, ::2].reshape(-1, 3)


def wiped(height: float, yaw: float = 0.0, name: str = "one", tilt: float = 0.0, noise: float = 0.001) -> Recording:
    """Markers that lie still at first, and are then carried along."""
    rng = np.random.default_rng(1)
    turn = Rotation.from_euler("zx", [yaw, tilt])
    moved = np.clip(TIME - 0.4, 0.0, None)[:, None] * [0.2, 0.1, 0.05]
    points = turn.apply(SHEET) + [0.7, -0.3, height] + moved[:, None]
    hand = np.array([0.7, -0.3, height]) + moved[:, None]
    return Recording(
        name, PointSeries(TIME, points + rng.normal(0, noise, points.shape)), Motion.from_positions(TIME, hand)
    )


def test_a_table_is_where_all_takes_lie_flat() -> None:
    base = preset("wiping")
    assert seen_table(base, [wiped(0.42), wiped(0.421, 1.0)]) == Table(0.421, 1.0)
    assert seen_table(base, [wiped(0.0)]) is None  # the built-in one
    assert seen_table(base, [wiped(0.42), wiped(0.45)]) is None  # not one table
    assert seen_table(base, [wiped(0.42), wiped(0.42, tilt=0.3)]) is None  # not level
    assert seen_table(preset("swing"), [wiped(0.42)]) is None and seen_table(preset("winding"), [wiped(0.42)]) is None


def test_a_cloud_tells_it_too() -> None:
    take = wiped(0.42)
    series = PointSeries(take.series.time, take.series.points, correspondence=False)
    assert seen_table(preset("fold"), [Recording("one", series, take.gripper)]) == Table(0.421, 1.0)


@pytest.mark.parametrize("yaw", [0.0, 0.6, 3.0])
def test_a_new_study_puts_cloth_and_table_where_they_are(tmp_path: Path, yaw: float) -> None:
    """The gripper is never turned, the cloth is."""
    pytest.importorskip("mujoco")
    save_measurement(Measurement((wiped(0.42, yaw),)), tmp_path / "m.zarr")
    given = ["new", str(tmp_path / "s.toml"), "--measurement", str(tmp_path / "m.zarr"), "--scenario", "wiping"]
    done = CliRunner().invoke(app, given)
    said = " ".join(done.output.split())
    assert done.exit_code == 0, said
    assert "it starts flat at 0.421 m: the table is there" in said and "warning" not in said
    scenario = Study.load(tmp_path / "s.toml").problem.scenarios["one"]
    assert scenario.obstacles == (Table(0.421, 1.0),)
    wanted = Rotation.from_euler("z", yaw).apply(SHEET) + np.array([0.7, -0.3, 0.42])
    start = scenario.start_vertices()
    np.testing.assert_allclose(scenario.markers @ start, wanted, atol=3e-3)
    np.testing.assert_allclose(start[scenario.grasps[0]].mean(axis=0)[:2], [0.7, -0.3], atol=5e-3)
