"""Readers of published sets: what they promise, on small files made here."""

import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from carried_sheet import carried
from published import ROOT

from muslin.core.dataset import DatasetNote, cropped
from muslin.core.errors import InputError, MissingFileError
from muslin.core.measurement import Recording
from muslin.core.motion import rotate
from muslin.core.registry import REGISTRY
from muslin.core.testing import check_dataset

DROPS = ROOT / "examples/balls/drops.csv"


def read(name: str, path: Path, *takes: str) -> tuple[list[Recording], list[str]]:
    """Recordings, and what the reader said about them."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", DatasetNote)
        recordings = REGISTRY.get("dataset", name)(path, list(takes))
    return recordings, [str(w.message) for w in caught]


def swinging_cable(frames: int = 60, markers: int = 8) -> np.ndarray[Any, Any]:
    """A cable hanging between two ends, 0.1 m from marker to marker, both ends moving along y."""
    along = np.linspace(-0.35, 0.35, markers)
    rest = np.stack([along, 0.0 * along, 0.5 * along**2], axis=1)
    t = 0.01 * np.arange(frames)
    sway = np.stack([0.0 * t, 0.1 * np.sin(6.0 * t), 0.0 * t], axis=1)
    return np.asarray(rest + sway[:, None])


def save_cable(path: Path, markers: np.ndarray[Any, Any], names: Sequence[str] = ("7.pkl",), **other: Any) -> Path:
    markers = markers if markers.ndim == 4 else markers[None]
    arrays = {"markers": markers, "clamped": np.array([0, 1, -2, -1]), "fps": 100.0, "names": np.array(names)}
    np.savez(path, **{**arrays, **other})
    return path


@pytest.mark.parametrize("name", REGISTRY.names("dataset"))
def test_every_installed_reader_conforms(name: str, tmp_path: Path) -> None:
    check_dataset(REGISTRY.get("dataset", name))
    if name == "balls":
        check_dataset(REGISTRY.get("dataset", name), DROPS)
    if name == "deform-cable":
        path = save_cable(tmp_path / "cable.npz", np.stack([swinging_cable()] * 2), ("a.pkl", "b.pkl"))
        check_dataset(REGISTRY.get("dataset", name), path)
    if name == "carried-cloth":
        for k in range(2):
            np.savez(tmp_path / f"take{k}.npz", **carried(0.1 * k, (0.0, 0.0, 0.0)))
        check_dataset(REGISTRY.get("dataset", name), tmp_path)


def test_heights_alone_are_heights_and_fall() -> None:
    (drop, again), notes = read("balls", DROPS, "golf-ball-1", "golf-ball-2")
    assert drop.series.points.shape[1:] == (1, 3) and drop.series.unit == "m" and drop.gripper is None
    assert np.isnan(drop.series.points[..., :2]).all() and np.isfinite(drop.series.points[..., 2]).all()
    assert drop.motion == again.motion == "golf-ball"  # repeats
    late = drop.series.time > drop.series.time[0] + 1.0
    g = -2 * np.polyfit(drop.series.time[late], drop.series.points[late, 0, 2], 2)[0]
    assert 8.5 < g < 10.5  # metres, seconds, z up; a golf ball hardly feels the air
    assert notes == ["golf-ball-2: left out 1 of 44 frames, in which the ball is still held"]


def test_a_drop_starts_less_than_a_frame_before_the_release(tmp_path: Path) -> None:
    time = np.arange(60) / 15
    for released in (0.0, 0.43, 0.97):
        height = 40.0 - 0.5 * 9.80665 * np.maximum(time - released, 0.0) ** 2
        rows = [f"Lead Ball,1,{t:.6f},{h:.6f}" for t, h in zip(time, height, strict=True)]
        path = tmp_path / "drops.csv"
        path.write_text("ball,drop,time_s,height_m\n" + "\n".join(rows))
        (drop,), _ = read("balls", path)
        assert drop.name == "lead-ball-1"
        assert -0.02 <= released - drop.series.time[0] < 1 / 15 + 0.02


def test_grippers_carry_the_clamped_markers(tmp_path: Path) -> None:
    markers = swinging_cable()
    (take,), notes = read("deform-cable", save_cable(tmp_path / "cable.npz", markers))
    assert not notes and take.name == "7" and take.gripper is not None
    np.testing.assert_allclose(take.series.points, markers)
    np.testing.assert_allclose(take.series.time, 0.01 * np.arange(len(markers)))
    poses = take.gripper.poses
    for g, (outer, inner) in enumerate(((0, 1), (7, 6))):
        pair = markers[:, inner] - markers[:, outer]
        length = np.linalg.norm(pair, axis=1)
        np.testing.assert_allclose(poses[:, g, :3], markers[:, outer], atol=1e-12)
        x = np.stack([length, 0 * length, 0 * length], axis=1)
        np.testing.assert_allclose(rotate(poses[:, g, 3:], x), pair, atol=1e-12)


def test_a_gripper_does_not_turn_about_the_cable(tmp_path: Path) -> None:
    """A pair of markers tilted to and fro comes back to the orientation that it had."""
    markers = swinging_cable()
    tilt = 0.4 * np.sin(np.linspace(0, 2 * np.pi, len(markers)))
    markers[:, 1] = markers[:, 0] + 0.1 * np.stack([np.cos(tilt), 0 * tilt, np.sin(tilt)], axis=1)
    (take,), _ = read("deform-cable", save_cable(tmp_path / "cable.npz", markers))
    assert take.gripper is not None
    q = take.gripper.poses[:, 0, 3:]
    assert abs(np.sum(q[0] * q[-1])) > 1 - 1e-9
    across = rotate(q, np.broadcast_to([0.0, 1.0, 0.0], (len(q), 3)))
    np.testing.assert_allclose(across, np.broadcast_to(across[0], across.shape), atol=1e-9)  # the axis of the tilt


@pytest.mark.parametrize("frames", [slice(20, 26), slice(30, None), slice(None)])
@pytest.mark.parametrize("a, b", [(0, 1), (6, 7)])
def test_markers_of_a_gripper_that_changed_places_are_put_back(tmp_path: Path, a: int, b: int, frames: slice) -> None:
    """Also for a whole take, whose own distances then tell nothing."""
    markers = swinging_cable()
    (right,), _ = read("deform-cable", save_cable(tmp_path / "right.npz", markers))
    markers[frames, [[a], [b]]] = markers[frames, [[b], [a]]]
    (take,), notes = read("deform-cable", save_cable(tmp_path / "cable.npz", markers))
    np.testing.assert_array_equal(take.series.points, right.series.points)
    assert take.gripper is not None
    assert right.gripper is not None
    np.testing.assert_array_equal(take.gripper.poses, right.gripper.poses)
    assert any("two clamped markers put back" in n for n in notes)


@pytest.mark.parametrize("a, b", [(3, 4), (2, 5)])
def test_swapped_markers_are_masked_where_they_are_swapped(tmp_path: Path, a: int, b: int) -> None:
    markers = swinging_cable()
    swapped = slice(20, 26)
    markers[swapped, [[a], [b]]] = markers[swapped, [[b], [a]]]
    (take,), notes = read("deform-cable", save_cable(tmp_path / "cable.npz", markers))
    wrong = ~take.series.valid
    assert wrong[swapped][:, [a, b]].all() and wrong.sum() == 12
    assert any("left out in 6 frames" in n for n in notes)
    assert not any("lost frames" in n for n in notes)
    assert take.gripper is not None and np.isfinite(take.gripper.poses).all()


@pytest.mark.parametrize("count", [1, 4])
def test_lost_frames_go_back_on_the_clock(tmp_path: Path, count: int) -> None:
    whole = swinging_cable(60 + count)
    # lost in motion, not at a turning point, where nothing moves and nothing is lost either
    markers = np.concatenate([whole[:48], whole[48 + count :]])
    (take,), notes = read("deform-cable", save_cable(tmp_path / "cable.npz", markers))
    assert f"{count} lost frames" in notes[0]
    there = np.concatenate([np.arange(48), np.arange(48 + count, 60 + count)])
    np.testing.assert_allclose(take.series.time, 0.01 * there)


def test_takes_are_read_in_the_order_asked_for(tmp_path: Path) -> None:
    cable = swinging_cable()
    path = save_cable(tmp_path / "cable.npz", np.stack([cable, cable + 1.0, cable + 2.0]), ("a.pkl", "b.pkl", "c.pkl"))
    takes, _ = read("deform-cable", path, "c", "a")
    assert [t.name for t in takes] == ["c", "a"]
    assert takes[0].series.points[0, 0, 0] > takes[1].series.points[0, 0, 0] + 1.5
    assert len(read("deform-cable", path)[0]) == 3


def test_clouds_are_thinned_lose_what_stands_alone_and_skip_the_arm(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    time = 0.1 * np.arange(12)
    clouds = rng.uniform(0.0, 0.3, (12, 8000, 3)) * (1.0, 1.0, 0.02)
    clouds[:, :3] = [[0.1, 0.1, 0.4], [9.0, 0.0, 0.0], [0.5, 0.1, 0.0]]
    np.savez(tmp_path / "fold_x2.npz", points=clouds, gripper_cmd=np.ones((12, 3)), t=time)
    (take,), said = read("cloth-cloud", tmp_path)
    assert not take.series.correspondence and take.motion == "fold_x"
    np.testing.assert_allclose(take.series.time, time[5:])
    assert take.gripper is not None and take.gripper.times[0] == 0.0
    points = take.series.points
    assert points.shape == (7, 600, 3) and np.isfinite(points).all()
    assert points.min() >= 0.0 and points.max() <= 0.3 and points[..., 2].max() <= 0.006
    counts = np.histogram2d(*points[0, :, :2].T, bins=3, range=[[0, 0.3]] * 2)[0]
    assert counts.min() > 0.7 * 600 / 9  # every part of the sheet keeps its share
    assert "21 points that stand alone; kept 600 of 8000 points a frame" in said[0]
    for unit in (10.0, 100.0):
        np.savez(tmp_path / "fold_x2.npz", points=unit * clouds, gripper_cmd=np.ones((12, 3)), t=time)
        with pytest.raises(InputError, match="frame 5 shows no sheet: no 12 of its points lie together"):
            read("cloth-cloud", tmp_path)


def test_what_is_wrong_is_said(tmp_path: Path) -> None:
    many = save_cable(tmp_path / "many.npz", np.stack([swinging_cable()] * 11), [f"{k}.pkl" for k in range(11)])
    with pytest.raises(InputError, match=r"no take '99'; it has 0, 1, 2, .*and 3 more"):
        read("deform-cable", many, "99")
    with pytest.raises(InputError, match="take 3 is asked for twice"):
        read("deform-cable", many, "3", "3")
    with pytest.raises(InputError, match="no take 'cricket-1'"):
        read("balls", DROPS, "cricket-1")
    for name in ("balls", "deform-cable", "carried-cloth", "cloth-cloud"):
        with pytest.raises(MissingFileError, match=r"no file.*nowhere"):
            read(name, tmp_path / "nowhere.npz")
    (tmp_path / "empty").mkdir()
    with pytest.raises(InputError, match=r"holds no \.npz file"):
        read("cloth-cloud", tmp_path / "empty")
    with pytest.raises(InputError, match=r"no array 'mesh'; it needs mesh, t, and has markers"):
        read("carried-cloth", many)
    (tmp_path / "text.npz").write_text("no archive")
    with pytest.raises(InputError, match="not an NPZ archive"):
        read("deform-cable", tmp_path / "text.npz")
    flat = save_cable(tmp_path / "flat.npz", swinging_cable()[..., :2])
    with pytest.raises(InputError, match=r"markers must have shape \(any, any, any, 3\)"):
        read("deform-cable", flat)


def test_a_crop_keeps_the_clock() -> None:
    (drop,), _ = read("balls", DROPS, "bowling-ball-1")
    part = cropped(drop, 1.0, 2.0)
    assert part.series.time[0] >= 1.0 and part.series.time[-1] <= 2.0
    assert cropped(drop, None, None) is drop
    with pytest.raises(InputError, match="fewer than 2 frames"):
        cropped(drop, 100.0, None)
