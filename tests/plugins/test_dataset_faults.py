"""Readers of published sets on what is damaged, foreign or cannot be: said plainly, or left out with a note."""

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from carried_sheet import carried
from test_datasets import read, save_cable, swinging_cable

from muslin.core.errors import InputError


def complaint(name: str, path: Path, *takes: str) -> str:
    with warnings.catch_warnings(), pytest.raises(InputError) as caught:
        warnings.simplefilter("error", RuntimeWarning)
        read(name, path, *takes)
    assert str(path) in str(caught.value) and "\n" not in str(caught.value)
    return str(caught.value)


def test_a_jump_at_rest_is_no_lost_frames(tmp_path: Path) -> None:
    still = np.repeat(swinging_cable()[:1], 60, axis=0)
    still[30:] += np.array([0.0, 0.004, 0.0])
    (take,), notes = read("deform-cable", save_cable(tmp_path / "cable.npz", still))
    np.testing.assert_allclose(take.series.time, 0.01 * np.arange(60))
    np.testing.assert_allclose(take.series.points, still)
    assert notes == ["7: the whole cable jumps at 0.30 s, which no lost frames explain; left as it is"]


def test_a_jump_in_motion_is_no_lost_frames(tmp_path: Path) -> None:
    markers = swinging_cable()
    markers[30:] += np.array([0.0, 0.3, 0.0])  # some 50 times as far as from frame to frame
    (take,), notes = read("deform-cable", save_cable(tmp_path / "cable.npz", markers))
    np.testing.assert_allclose(take.series.time, 0.01 * np.arange(60))
    assert any("the whole cable jumps at 0.30 s" in n for n in notes)


def test_markers_that_were_not_seen_leave_the_rest_alone(tmp_path: Path) -> None:
    whole = swinging_cable(61)
    markers = np.concatenate([whole[:48], whole[49:]])  # one frame was lost
    markers[10, 0] = markers[12, 4] = markers[20] = np.nan
    markers[14, 1, 2] = np.inf
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        (take,), notes = read("deform-cable", save_cable(tmp_path / "cable.npz", markers))
    assert notes == ["7: 1 lost frames put back on the clock, at 0.49 s"]
    hidden = np.zeros((60, 8), bool)
    hidden[10, 0] = hidden[12, 4] = hidden[20] = hidden[14, 1] = True
    np.testing.assert_array_equal(take.series.valid, ~hidden)
    assert take.gripper is not None and np.isfinite(take.gripper.poses).all()
    assert len(take.gripper.times) == 57  # not where a clamped marker is missing


def test_a_cable_needs_its_clamped_markers(tmp_path: Path) -> None:
    markers = swinging_cable()
    markers[:, 1] = np.nan
    said = complaint("deform-cable", save_cable(tmp_path / "cable.npz", markers))
    assert "take '7': in no frame are all four clamped markers (0, 1, 6, 7) where they can be" in said


@pytest.mark.parametrize(
    ("array", "value", "said"),
    [
        ("fps", 0.0, "fps must be above zero, but is 0"),
        ("fps", np.nan, "fps must be above zero, but is nan"),
        ("fps", [100.0, 100.0], "fps must be one number, but has shape (2,)"),
        ("fps", "fast", "fps must hold real numbers, but holds <U4"),
        ("names", ["a", "b"], "names must be one text for each of the 1 takes of markers, but is of shape (2,)"),
        ("names", "a", "names must be one text for each of the 1 takes of markers, but is of shape ()"),
        ("names", [7.0], "names must be one text for each of the 1 takes"),
        ("clamped", [0, 1, 6, 8], "clamped must name 4 different markers of 8 (from 0, or from -1 at the end)"),
        ("clamped", [0, 1, 6, -9], "but is 0, 1, 6, -9"),
        ("clamped", [0, 1, 7, -1], "4 different markers"),
        ("clamped", [0.0, 1.5, 6.0, 7.0], "but is 0, 1.5, 6, 7"),
    ],
)
def test_a_cable_file_says_what_it_should_hold(tmp_path: Path, array: str, value: Any, said: str) -> None:
    assert said in complaint("deform-cable", save_cable(tmp_path / "c.npz", swinging_cable(), **{array: value}))


def test_millimetres_are_not_taken_for_metres(tmp_path: Path) -> None:
    cable = save_cable(tmp_path / "cable.npz", 1000 * swinging_cable())
    assert "markers reach over 700 m, while this set is in metres" in complaint("deform-cable", cable)
    made = carried(0.31, (0.0, 0.0, 0.0))
    cloth = save_cloth(tmp_path / "cloth.npz", mesh=1000 * made["mesh"])
    assert "the nodes of mesh reach over" in complaint("carried-cloth", cloth)
    far = made["tcp"] * np.array([1000.0] * 3 + [1.0] * 4)
    assert "the positions of tcp reach over" in complaint("carried-cloth", save_cloth(cloth, tcp=far))
    sheet = np.random.default_rng(0).uniform(0.0, 300.0, (12, 3000, 3))
    np.savez(tmp_path / "fold.npz", points=sheet, gripper_cmd=np.ones((12, 3)), t=0.1 * np.arange(12))
    assert "points reach over" in complaint("cloth-cloud", tmp_path / "fold.npz")


def test_two_takes_of_one_name_are_told(tmp_path: Path) -> None:
    path = save_cable(tmp_path / "c.npz", np.stack([swinging_cable()] * 2), ("1.pkl", "1.c3d"))
    assert "names must differ, but 1 is there more than once" in complaint("deform-cable", path)


def test_a_take_that_cannot_be_is_named(tmp_path: Path) -> None:
    blind = np.full((60, 8, 3), np.nan)
    path = save_cable(tmp_path / "c.npz", np.stack([swinging_cable(), blind]), ("1.pkl", "2.pkl"))
    assert "c.npz, take '2': every point is NaN" in complaint("deform-cable", path)
    assert len(read("deform-cable", path, "1")[0]) == 1
    none = save_cable(tmp_path / "none.npz", np.zeros((0, 60, 8, 3)), names=np.zeros(0, "U1"))
    assert "none.npz holds no takes" in complaint("deform-cable", none)


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        (["Ball,1,0,9", "Ball,1,1,4", "Ball,1,0,9", "Ball,1,1,4"], "take 'ball-1': time must rise"),
        (["Ball,1,0,9"], "take 'ball-1': a series needs at least 2 frames"),
        (["A/B,1,0,9", "A/B,1,1,4"], "take 'a/b-1': a recording needs a name without slashes"),
        (["Ball,1,0,9", "Ball,1,1,"], "balls.csv, line 3: height_m must be a finite number"),
    ],
)
def test_a_drop_that_cannot_be_is_named(tmp_path: Path, rows: list[str], said: str) -> None:
    path = tmp_path / "balls.csv"
    path.write_text("\n".join(["ball,drop,time_s,height_m", *rows]))
    assert said in complaint("balls", path)


def test_a_number_after_a_point_is_no_suffix(tmp_path: Path) -> None:
    path = save_cable(tmp_path / "c.npz", np.stack([swinging_cable()] * 3), ("0.25 m", "0.50 m", "slow.c3d"))
    assert [r.name for r in read("deform-cable", path)[0]] == ["0.25 m", "0.50 m", "slow"]


def test_names_may_be_bytes(tmp_path: Path) -> None:
    path = save_cable(tmp_path / "c.npz", swinging_cable(), names=np.array([b"12.pkl"]))
    assert read("deform-cable", path)[0][0].name == "12"


def save_cloth(path: Path, **other: Any) -> Path:
    arrays = {**carried(0.31, (0.0, 0.0, 0.0)), **other}
    np.savez(path, **{k: v for k, v in arrays.items() if v is not None})
    return path


@pytest.mark.parametrize(
    ("other", "said"),
    [
        ({"tcp_t": None}, "has tcp but no tcp_t (K,), the times of its poses [s]"),
        ({"t": np.float64(3.0)}, "t must have shape (50), but has shape ()"),
        ({"t": np.arange(49.0)}, "t must have shape (50), but has shape (49,)"),
        ({"tcp": np.full((120, 7), np.nan)}, "tcp holds 0 whole poses; at least 2 are needed"),
        ({"tcp": np.tile([0.0, 0, 0, 0, 0, 0, 1], (120, 1))}, "the cloth does not move as the robot's hand does"),
        ({"mesh": np.zeros((50, 5, 4, 3))}, "mesh must be (T, n, n, 3)"),
        ({"mesh": np.zeros((0, 5, 5, 3)), "t": np.zeros(0)}, "a series needs at least 2 frames, but has 0"),
        ({"t": 100.0 * np.arange(50)}, "time must be in seconds, is it in milliseconds?"),
        ({"t": np.append(np.arange(49.0), np.nan)}, "time[49] is not a number"),
        ({"t": -np.arange(50.0)}, "time must rise"),
    ],
)
def test_a_cloth_file_says_what_it_should_hold(tmp_path: Path, other: dict[str, Any], said: str) -> None:
    assert said in complaint("carried-cloth", save_cloth(tmp_path / "a.npz", **other))


def test_a_cloth_with_the_hand_of_another_take_is_refused(tmp_path: Path) -> None:
    late = carried(0.9, (0.0, 0.0, 0.0))  # a lag that is not tried
    said = complaint("carried-cloth", save_cloth(tmp_path / "late.npz", **late))
    assert "at a lag of 0.60 s of -0.6 to 0.6 s" in said and "leave them out" in said
    clock = np.arange(0, 6, 0.05)
    other = np.tile([0.0, 0, 0, 0.5**0.5, 0.5**0.5, 0, 0], (120, 1))
    other[:, 0] = 0.1 * np.sin(9.0 * clock)
    assert "correlation 0." in complaint("carried-cloth", save_cloth(tmp_path / "other.npz", tcp=other))


def test_where_the_hand_rests_there_is_no_lag(tmp_path: Path) -> None:
    made = carried(0.0, (0.0, 0.0, 0.0))
    noise = np.random.default_rng(0).normal(0.0, 0.001, made["mesh"].shape)
    still = {"mesh": made["mesh"][:1] + noise, "tcp": np.repeat(made["tcp"][:1], 120, axis=0)}
    (take,), notes = read("carried-cloth", save_cloth(tmp_path / "a.npz", **still))
    np.testing.assert_array_equal(take.series.time, made["t"])
    assert notes == ["a: the hand rests, so how much the camera lags does not show; it is taken for 0 s"]


def test_nodes_at_zero_were_not_seen(tmp_path: Path) -> None:
    made = carried(0.31, (0.0, 0.0, 0.0))
    made["mesh"][20:24, 1, 1] = 0.0
    (take,), notes = read("carried-cloth", save_cloth(tmp_path / "a.npz", **made))
    assert notes[0] == "a: 4 nodes that jump to exactly 0, 0, 0 are taken as not seen"
    assert (~take.series.valid).sum() == 4 and (~take.series.valid[20:24]).sum() == 4


def test_messages_of_the_robot_without_a_pose_are_left_out(tmp_path: Path) -> None:
    made = carried(0.31, (0.0, 0.0, 0.0))
    made["tcp"][40] = np.nan
    made["tcp"][50, 3:] = 0.0
    (take,), notes = read("carried-cloth", save_cloth(tmp_path / "a.npz", **made))
    assert take.gripper is not None and len(take.gripper.times) == 118
    assert "lags the robot by 0.31 s" in notes[0]


def test_only_what_is_needed_is_read(tmp_path: Path) -> None:
    """An array of Python objects beside those that are needed does no harm, as one of them it is named."""
    pickled = np.array([{"made": "by hand"}], dtype=object)
    path = save_cable(tmp_path / "c.npz", swinging_cable(), notes=pickled)
    assert len(read("deform-cable", path)[0]) == 1
    save_cable(path, swinging_cable(), clamped=pickled)
    assert "array 'clamped' holds Python objects" in complaint("deform-cable", path)


def test_other_files_of_a_folder_are_left_out(tmp_path: Path) -> None:
    save_cloth(tmp_path / "b.npz")
    save_cable(tmp_path / "cable.npz", swinging_cable())
    (take,), notes = read("carried-cloth", tmp_path)
    assert take.name == "b"
    assert notes[0] == "left out cable.npz: without one of the arrays mesh, t, so not of this set"
    assert "has no array 'mesh'" in complaint("carried-cloth", tmp_path / "cable.npz")
    (tmp_path / "torn.npz").write_bytes((tmp_path / "b.npz").read_bytes()[:2000])
    with pytest.raises(InputError, match=r"torn\.npz is not an NPZ archive, or damaged .*copy it again"):
        read("carried-cloth", tmp_path)


def test_clouds_are_filled_up_with_zeros_and_may_miss_a_frame(tmp_path: Path) -> None:
    clouds = np.random.default_rng(0).uniform(0.3, 0.6, (12, 4000, 3)) * (1.0, 1.0, 0.02)
    arrays = {"gripper_cmd": np.ones((12, 3)), "t": 0.1 * np.arange(12)}
    np.savez(tmp_path / "fold.npz", points=clouds, **arrays)
    (whole,), _ = read("cloth-cloud", tmp_path / "fold.npz")
    filled = np.concatenate([clouds, np.zeros((12, 100, 3))], axis=1)
    filled[8] = 0.0
    np.savez(tmp_path / "fold.npz", points=filled, **arrays)
    (take,), notes = read("cloth-cloud", tmp_path / "fold.npz")
    there = np.arange(7) != 3
    np.testing.assert_array_equal(take.series.points, whole.series.points[there])
    np.testing.assert_array_equal(take.series.time, whole.series.time[there])
    assert notes[0] == "fold: 5200 points at exactly 0, 0, 0 are taken as not seen"
    assert notes[1] == "fold: left out 1 of 7 frames that show no sheet"


def test_a_clock_that_goes_back_is_told_with_its_file(tmp_path: Path) -> None:
    time = 0.1 * np.arange(12)
    time[7] = 0.2
    np.savez(tmp_path / "fold.npz", points=np.ones((12, 30, 3)), gripper_cmd=np.ones((12, 3)), t=time)
    assert "time must rise" in complaint("cloth-cloud", tmp_path / "fold.npz")
