"""``muslin new`` where the first frame and the model do not go together, and where they do."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from muslin.cli.main import run
from muslin.cli.rope_start import hanging_length
from muslin.core.measurement import Measurement, Recording
from muslin.core.measurement_store import save_measurement
from muslin.core.motion import Motion, rotate
from muslin.core.scenarios import preset
from muslin.core.series import PointSeries
from muslin.core.study import read_config

AWAY, LINE = "away from where the model puts the object", "all points of one start on one line"
#: A gripper that is turned by 60 degrees about x as it begins.
TURN = np.array([np.cos(np.pi / 6), np.sin(np.pi / 6), 0.0, 0.0])


def told(folder: Path, capsys: pytest.CaptureFixture[str], points: np.ndarray, turn: np.ndarray, *options: str) -> str:
    poses = np.tile(np.concatenate([[0.0, 0.0, 1.0], turn]), (5, 1, 1))
    times = np.linspace(0.0, 0.2, 5)
    recording = Recording("one", PointSeries(times, np.tile(points, (5, 1, 1))), Motion(times, poses))
    save_measurement(Measurement((recording,)), folder / "m.zarr", overwrite=True)
    with pytest.raises(SystemExit) as caught:
        run(["new", str(folder / "s.toml"), "--measurement", str(folder / "m.zarr"), *options])
    printed = capsys.readouterr()
    return printed.out if not caught.value.code else printed.err


def sheet(turn: np.ndarray) -> np.ndarray:
    """The 25 vertices of a cloth as a turned gripper holds it."""
    body = preset("fling").body((0.3, 0.3), (5, 5))
    return np.asarray(rotate(turn, body.vertices) + np.array([0.0, 0.0, 1.0]))


def test_a_quaternion_in_another_order_is_seen_in_where_the_markers_are(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    options = ("--scenario", "fling", "--size", "0.3,0.3", "--vertices", "5,5")
    assert AWAY not in told(tmp_path, capsys, sheet(TURN), TURN, *options)
    other = tmp_path / "other"
    other.mkdir()
    assert f"{AWAY}; check --up, the unit, the gripper poses (x y z, then the quaternion w x y z)" in told(
        other, capsys, sheet(TURN), TURN[[1, 2, 3, 0]], *options
    )


@pytest.mark.parametrize("kept", ["20,21,22,23,24", "24"])
def test_markers_on_a_part_of_the_object_are_where_they_should_be(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], kept: str
) -> None:
    text = told(tmp_path, capsys, sheet(TURN), TURN, "--scenario", "fling", "--points", kept)
    assert AWAY not in text


def test_a_size_in_millimetres_puts_all_markers_on_one_vertex(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    upright = np.array([1.0, 0.0, 0.0, 0.0])
    hanging = np.linspace([0.0, 0.0, 1.0], [0.0, 0.0, 0.0], 11)
    refused = told(tmp_path, capsys, hanging, upright, "--scenario", "swing", "--size", "1000")
    assert "all 11 points are nearest to one vertex of the object, which is 1e+03 m large" in refused
    assert "within 1 m; give the size of the object in metres with --size" in refused
    assert not (tmp_path / "s.toml").exists()
    assert LINE not in told(tmp_path, capsys, hanging, upright, "--scenario", "swing", "--size", "1")


@pytest.mark.parametrize(("aside", "rope"), [(0.0, True), (0.2, False)])
def test_points_on_a_line_are_those_of_a_rope_if_it_begins_in_the_gripper(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], aside: float, rope: bool
) -> None:
    upright = np.array([1.0, 0.0, 0.0, 0.0])
    hanging = np.linspace([aside, 0.0, 0.9], [aside, 0.0, 0.2], 8)
    text = told(tmp_path, capsys, hanging, upright, "--scenario", "swing")
    assert (f"{LINE}; if they are those of a rope, give its length" in text) != rope
    assert ("as those of a rope do, 0.8 m from there to the last of them" in " ".join(text.split())) == rope
    assert read_config(tmp_path / "s.toml").scenario.size == ([0.8] if rope else [0.3, 0.3])


@given(st.floats(0.3, 3.0), st.integers(4, 20), st.floats(-3, 3), st.floats(-1.2, 1.2), st.integers(0, 9))
def test_a_rope_is_as_long_as_it_reaches_from_its_gripper(
    length: float, count: int, yaw: float, tilt: float, seed: int
) -> None:
    """Whatever way it lies and however its markers are numbered; not where the gripper is in its middle."""
    rng = np.random.default_rng(seed)
    way = np.array([np.cos(yaw) * np.cos(tilt), np.sin(yaw) * np.cos(tilt), np.sin(tilt)])
    along = rng.permutation(np.linspace(0.0, length, count + 1)[1:])
    points = np.tile([0.3, -0.2, 1.0] + along[:, None] * way, (5, 1, 1))
    times = np.linspace(0.0, 0.2, 5)

    def take(at: float) -> Recording:
        hand = np.array([0.3, -0.2, 1.0]) + at * way
        return Recording("one", PointSeries(times, points), Motion.from_positions(times, np.tile(hand, (5, 1, 1))))

    assert hanging_length([take(0.0), take(0.0)]) == pytest.approx(length, abs=1e-3)
    assert hanging_length([take(0.0), take(0.5 * length)]) is None


def test_a_marker_that_is_not_on_a_solid_is_remarked_on(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """It would go along with the object, so that nothing looks wrong."""
    corners = preset("beam").scenario().start_vertices()[[0, 5, -1]] + np.array([0.0, 0.0, 1.0])
    far = np.concatenate([corners, corners[:1] + 0.4])
    still = np.array([1.0, 0.0, 0.0, 0.0])
    said = told(tmp_path, capsys, far, still, "--scenario", "beam")
    assert "warning: one: point 3 is 0.6" in said and "leave it out with --points if it is not on the object" in said
    (tmp_path / "s.toml").unlink()
    assert "from the object" not in told(tmp_path, capsys, far, still, "--scenario", "beam", "--points", "0,1,2")
    assert "recording 'one': marker 0" in told(tmp_path, capsys, corners * 40.0, still, "--scenario", "beam", "--force")


def test_a_point_that_lacks_a_coordinate_throughout_is_not_said_to_come_later(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """As the height of a ball, of which a later start shows no more."""
    height = np.array([[np.nan, np.nan, 1.0]])
    still = np.array([1.0, 0.0, 0.0, 0.0])
    said = told(tmp_path, capsys, height, still, "--scenario", "drop")
    assert "point 0 is in no frame of any recording seen with all its coordinates" in said and "--start" not in said
    assert "wrote" in told(tmp_path, capsys, height, still, "--scenario", "drop", "--markers", "0")
