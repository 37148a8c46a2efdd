"""The reader of a cloth that a robot carries, on sheets whose motion is known."""

from pathlib import Path

import numpy as np
import pytest
from carried_sheet import carried
from test_datasets import read

from muslin.core.motion import rotate


def test_the_gripper_of_a_carried_cloth_is_its_top_edge(tmp_path: Path) -> None:
    lag = 0.31
    made = carried(lag, (-0.029, -0.005, 0.0))
    np.savez(tmp_path / "s_rep1.npz", **made)
    (take,), notes = read("carried-cloth", tmp_path)
    assert take.name == take.motion == "s_rep1" and "lags the robot by 0.31 s; points" in notes[0]
    assert take.gripper is not None
    np.testing.assert_allclose(take.series.time, made["t"] - lag, atol=0.01)
    top = take.series.points[:, :5]
    assert (top[..., 2].mean(axis=1) > take.series.points[:, -5:, 2].mean(axis=1) + 0.2).all()  # row 0 is held
    assert (np.diff(top[..., 0], axis=1) > 0).all()
    pose = take.gripper.at(take.series.time)[:, 0]
    np.testing.assert_allclose(pose[:, :3], top.mean(axis=1), atol=0.004)
    down = rotate(pose[:, 3:], np.broadcast_to([0.0, 0.0, -0.3], (len(pose), 3)))
    sheet = take.series.points[:, -5:].mean(axis=1) - top.mean(axis=1)
    np.testing.assert_allclose(down, sheet, atol=0.005)  # it hangs where the hand points


def test_a_camera_that_hardly_lags_is_read(tmp_path: Path) -> None:
    """Stamps of the frames before would be too early for any lag that is tried: that is no fault of the recording."""
    made = carried(-0.55, (0.0, 0.0, 0.0))
    np.savez(tmp_path / "a.npz", **made)
    (take,), notes = read("carried-cloth", tmp_path)
    assert "lags the robot by -0.5" in notes[0] and "pause" not in notes[0]
    np.testing.assert_allclose(take.series.time, made["t"] + 0.55, atol=0.02)


@pytest.mark.parametrize("seed", range(3))
def test_frames_that_are_stamped_once_they_are_done_get_their_times_back(tmp_path: Path, seed: int) -> None:
    work = np.random.default_rng(seed).choice([0.06, 0.1, 0.14, 0.3], 36)
    np.savez(tmp_path / "a.npz", **carried(0.2, (0.0, 0.0, 0.0), work=work))
    (take,), notes = read("carried-cloth", tmp_path)
    (said,) = notes
    assert "more after a pause" in said
    assert float(said.split(" by ")[1].split(" s,")[0]) == pytest.approx(0.2 + np.median(work), abs=0.03)
    taken = 0.5 + np.concatenate([[0.0], np.cumsum(work)[:-1]]) - 0.2
    np.testing.assert_allclose(take.series.time[1:], taken[1:], atol=0.03)  # nothing is known of what was before
    np.testing.assert_allclose(np.diff(take.series.time[1:]), work[1:-1], atol=1e-9)
    np.testing.assert_allclose(take.series.time[0], taken[0] + work[0] - np.median(work), atol=0.03)


@pytest.mark.parametrize("lean", [-0.06, 0.006, 0.05])
def test_a_carried_edge_may_lean_in_the_hand(tmp_path: Path, lean: float) -> None:
    np.savez(tmp_path / "a.npz", **carried(0.31, (0.02, 0.0, 0.01), lean=lean))
    (take,), notes = read("carried-cloth", tmp_path)
    (said,) = [note for note in notes if "leans" in note] or [""]
    assert f"leans by {np.degrees(abs(lean)):.1f} degrees in the hand" in said if abs(lean) > 0.02 else not said
    assert take.gripper is not None
    pose, top = take.gripper.at(take.series.time)[:, 0], take.series.points[:, :5]
    along = rotate(pose[:, 3:], np.broadcast_to([0.3, 0.0, 0.0], (len(pose), 3)))
    np.testing.assert_allclose(along, top[:, -1] - top[:, 0], atol=0.002)


@pytest.mark.parametrize("axis", [1, 2])
def test_frames_in_which_the_tracker_lost_a_cloth_are_left_out(tmp_path: Path, axis: int) -> None:
    made = carried(0.31, (0.0, 0.0, 0.0))
    mesh = made["mesh"]
    squeezed = [7, 8, 30]
    middle = mesh[squeezed].mean(axis=axis, keepdims=True)
    mesh[squeezed] = middle + 0.85 * (mesh[squeezed] - middle)
    mesh[12, 2, 2] = np.nan  # what is not seen is not short
    # rolled to a tube of radius 1.5 spacings, a cloth is as long as ever
    angle = np.linspace(-1.0, 1.0, 5) * 2 / 1.5
    mesh[20, ..., 1] += np.broadcast_to(1.5 * 0.075 * np.cos(angle), (5, 5))
    mesh[20, ..., 2] = mesh[20, ..., 2].mean() + 1.5 * 0.075 * np.sin(angle)
    np.savez(tmp_path / "a.npz", **made)
    (take,), notes = read("carried-cloth", tmp_path)
    kept = np.setdiff1d(np.arange(50), squeezed)
    assert "3 of 50 frames left out, in which the grid is too short to be the cloth" in notes[0]
    np.testing.assert_allclose(take.series.time, made["t"][kept] - 0.31, atol=0.01)
    assert take.series.points.shape == (47, 25, 3) and np.isnan(take.series.points).any(axis=2).sum() == 1


def test_without_a_hand_the_tracked_edge_carries(tmp_path: Path) -> None:
    made = carried(0.0, (0.0, 0.0, 0.0))
    made["mesh"][7, 0, -1] = np.nan
    np.savez(tmp_path / "a.npz", mesh=made["mesh"], t=made["t"])
    (take,), notes = read("carried-cloth", tmp_path / "a.npz", "a")
    assert "top edge is taken for the gripper" in notes[0] and take.gripper is not None
    assert len(take.gripper.times) == len(take.series.time) - 1
    np.testing.assert_allclose(take.gripper.poses[0, 0, :3], take.series.points[0, :5].mean(axis=0), atol=1e-9)
