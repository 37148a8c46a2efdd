import warnings
from pathlib import Path

import numpy as np
import pytest

from muslin.core.dataset import DatasetNote
from muslin.core.errors import InputError, MissingFileError, MuslinError
from muslin.core.importing import ImportOptions, import_file
from muslin.core.motion import rotate

TIME = np.linspace(0.0, 1.0, 11)


def points(axes: int = 3) -> np.ndarray:
    return np.random.default_rng(0).uniform(-0.2, 0.2, (11, 4, axes))


def npz(path: Path, **changes: object) -> Path:
    arrays: dict[str, object] = {"time": TIME, "points": points(), **changes}
    np.savez(path / "take.npz", **{k: v for k, v in arrays.items() if v is not None})  # type: ignore[arg-type]
    return path / "take.npz"


def csv(path: Path, text: str, name: str = "track.csv") -> Path:
    (path / name).write_text(text)
    return path / name


def complaint(path: Path, **options: object) -> str:
    with pytest.raises(MuslinError) as caught:
        import_file(path, ImportOptions(**options))  # type: ignore[arg-type]
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_npz_as_it_is(tmp_path: Path) -> None:
    seen = points()
    seen[3, 2] = np.nan
    turn = np.array([0.0, 0, 0, 2 * 0.51, 0, 0, 0])
    file = npz(
        tmp_path,
        points=seen,
        recording="fling 1",
        motion="fling",
        load=0.05,
        correspondence=False,
        gripper_time=np.array([0.0, 0.5]),
        gripper_pose=np.tile(turn, (2, 1, 1)),
    )
    [r] = import_file(file)
    assert np.array_equal(r.series.points, seen, equal_nan=True)
    assert (r.name, r.motion, r.load, r.series.correspondence, r.series.unit) == ("fling 1", "fling", 0.05, False, "m")
    assert r.gripper is not None
    assert r.gripper.poses[0, 0].tolist() == [0, 0, 0, 1, 0, 0, 0]


def test_arrays_that_are_not_read_are_told(tmp_path: Path) -> None:
    with pytest.warns(DatasetNote, match=r"take\.npz: not read: gripper_poses; what is read are time, .*gripper_pose,"):
        import_file(npz(tmp_path, gripper_poses=np.zeros((11, 1, 3))))


def test_what_a_person_says_wins(tmp_path: Path) -> None:
    file = npz(tmp_path, recording="a", motion="b", load=1.0, correspondence=True, unit="m")
    options = ImportOptions(unit="mm", name="c", motion="d", load=0.5, correspondence=False, start=0.15, stop=0.55)
    [r] = import_file(file, options)
    assert (r.name, r.motion, r.load, r.series.correspondence) == ("c", "d", 0.5, False)
    np.testing.assert_allclose(r.series.points, points()[2:6] / 1000)
    np.testing.assert_allclose(r.series.time, TIME[2:6])


@pytest.mark.parametrize(("unit", "factor"), [("mm", 1e-3), ("cm", 1e-2), ("m", 1.0), ("Meters", 1.0)])
def test_units_of_the_file(tmp_path: Path, unit: str, factor: float) -> None:
    still = np.tile(np.array([1.0, 2, 3]), (11, 1, 1))
    [r] = import_file(npz(tmp_path, unit=unit, gripper_pose=still))
    np.testing.assert_allclose(r.series.points, points() * factor)
    assert r.gripper is not None
    assert r.gripper.poses[0, 0, :3].tolist() == pytest.approx([factor, 2 * factor, 3 * factor])


def test_pixels_with_grippers_in_metres(tmp_path: Path) -> None:
    still = np.tile(np.array([1.0, 2, 3]), (11, 1, 1))
    [r] = import_file(npz(tmp_path, points=points(2) * 1e4, unit="px", gripper_pose=still))
    assert r.series.unit == "px"
    assert r.gripper is not None and r.gripper.poses[0, 0, 2] == 3.0
    assert "2 coordinates" in complaint(npz(tmp_path, unit="px"))


@pytest.mark.parametrize(("up", "order"), [("x", [1, 2, 0]), ("y", [2, 0, 1]), ("z", [0, 1, 2])])
def test_up_turns_points_and_grippers_alike(tmp_path: Path, up: str, order: list[int]) -> None:
    half = np.pi / 6
    pose = np.array([1.0, 2, 3, np.cos(half), *(np.sin(half) * np.array([0.6, 0.0, 0.8]))])
    [r] = import_file(npz(tmp_path, gripper_pose=np.tile(pose, (11, 1, 1))), ImportOptions(up=up))
    assert np.array_equal(r.series.points, points()[..., order])
    assert r.gripper is not None
    got = r.gripper.poses[0, 0]
    np.testing.assert_allclose(got, [*pose[:3][order], pose[3], *pose[4:][order]])
    axis = {"x": 0, "y": 1, "z": 2}[up]
    assert got[2] == pose[axis]


def test_npz_that_cannot_be(tmp_path: Path) -> None:
    assert "needs time (T,)" in complaint(npz(tmp_path, points=points()[:5]))
    assert "points (11, 4)" in complaint(npz(tmp_path, points=points()[..., 0]))
    assert "no array 'points'" in complaint(npz(tmp_path, points=None))
    assert "Python objects" in complaint(npz(tmp_path, points=np.array([{"a": 1}], dtype=object)))
    assert "real numbers" in complaint(npz(tmp_path, time=np.array(["a"] * 11)))
    assert "infinite" in complaint(npz(tmp_path, time=np.where(TIME > 0.9, np.inf, TIME)))
    assert "every point is NaN" in complaint(npz(tmp_path, points=np.full((11, 4, 3), np.nan)))
    assert "load must be one number" in complaint(npz(tmp_path, load=np.array([1.0, 2.0])))
    assert "units are m, cm, mm, px" in complaint(npz(tmp_path, unit="inch"))
    assert "say --unit mm" in complaint(npz(tmp_path, points=points() * 1000))
    backwards = TIME.copy()
    backwards[7] = 0.1
    assert "time[7] = 0.1 s follows time[6] = 0.6 s" in complaint(npz(tmp_path, time=backwards))


def test_grippers_that_cannot_be(tmp_path: Path) -> None:
    still = np.tile(np.array([0.0, 0, 0, 1, 0, 0, 0]), (11, 1, 1))
    assert "length 3" in complaint(npz(tmp_path, gripper_pose=still * 3))
    assert "(T, G, 3) or (T, G, 7)" in complaint(npz(tmp_path, gripper_pose=still[..., :5]))
    assert "gripper_time" in complaint(npz(tmp_path, gripper_pose=still[:5]))
    assert "not a finite number" in complaint(npz(tmp_path, gripper_pose=np.where(still == 1, np.nan, still)))
    assert "no gripper_pose" in complaint(npz(tmp_path, gripper_time=TIME))
    falling = complaint(npz(tmp_path, gripper_pose=still, gripper_time=TIME[::-1]))
    assert "gripper time must rise" in falling


@pytest.mark.parametrize("order, doubted", [([0, 1, 2, 3], False), ([1, 2, 3, 0], True)])
def test_quaternions_in_another_order_are_doubted(tmp_path: Path, order: list[int], doubted: bool) -> None:
    """A marker at the gripper goes along with it, if its turns are read as they were meant."""
    half = np.linspace(0.1, 0.6, 11)
    turns = np.stack([np.cos(half), 0.6 * np.sin(half), np.zeros(11), 0.8 * np.sin(half)], axis=1)
    places = np.stack([TIME, np.zeros(11), 1.0 - TIME], axis=1)
    held = places + rotate(turns, np.array([0.02, 0.05, -0.03]))
    pose = np.concatenate([places, turns[:, order]], axis=1)[:, None]
    file = npz(tmp_path, points=np.stack([places - [0.0, 0.0, 0.4], held], axis=1), gripper_pose=pose)
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        import_file(file)
    expected = ["are read as w x y z, but look like x y z w: read so, point 1, the nearest to it"] if doubted else []
    assert [e in str(w.message) for e, w in zip(expected, told, strict=True)] == [True] * len(expected)


def test_csv_with_gaps_and_several_takes(tmp_path: Path) -> None:
    text = "time,point,x,y,z,recording\n0,10,1,2,3,a\n0,9,4,5,6,a\n0.1,10,,,,a\n0.1,9,7,8,9,a\n\n"
    text += "0,9,1,1,1,b\n1,9,2,2,2,b\n"
    a, b = import_file(csv(tmp_path, text))
    assert (a.name, b.name) == ("a", "b")
    assert a.series.points[:, 0].tolist() == [[4, 5, 6], [7, 8, 9]]
    assert a.series.points[0, 1].tolist() == [1, 2, 3]
    assert np.isnan(a.series.points[1, 1]).all()
    assert b.series.points[:, 0].tolist() == [[1, 1, 1], [2, 2, 2]]
    assert "leave --name out" in complaint(tmp_path / "track.csv", name="x")


def test_a_point_of_a_csv_is_the_same_in_every_take(tmp_path: Path) -> None:
    """Whichever of them a take shows first, or does not show at all."""
    text = "time,point,x,y,z,recording\n0,base,1,1,1,a\n0,tip,2,2,2,a\n1,base,1,1,1,a\n1,tip,2,2,2,a\n"
    text += "0,tip,2,2,2,b\n1,base,1,1,1,b\n1,tip,2,2,2,b\n0,tip,2,2,2,c\n1,tip,2,2,2,c\n"
    a, b, c = import_file(csv(tmp_path, text))
    assert a.series.points[1].tolist() == b.series.points[1].tolist() == [[1, 1, 1], [2, 2, 2]]
    assert np.isnan(b.series.points[0, 0]).all()
    assert np.isnan(c.series.points[:, 0]).all() and c.series.points[1, 1].tolist() == [2, 2, 2]


def test_csv_grouped_by_point_and_with_semicolons(tmp_path: Path) -> None:
    text = "\ufeffTime; Point; X; Y\n0;tip;1;2\n0.1;tip;3;4\n0;base;5;6\n"
    [r] = import_file(csv(tmp_path, text), ImportOptions(unit="px"))
    assert r.series.points[:, 0].tolist() == [[1, 2], [3, 4]]
    assert np.isnan(r.series.points[1, 1]).all()
    assert r.name == "track"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "is empty"),
        ("time,point,x\n0,0,1\n", "column 'y' is missing"),
        ("time,point,x,y,w\n0,0,1,1,1\n", "column 'w' is not known"),
        ("time,point,x,y,x\n0,0,1,1,1\n", "'x' is there twice"),
        ("time,point,x,y\n", "no rows"),
        ("time,point,x,y\n0,0,1,1\n0.1,0,1,oops\n", "line 3: y must be a finite number"),
        ("time,point,x,y\n0,0,1,inf\n", "line 2: y must be"),
        ("time,point,x,y\n,0,1,1\n", "line 2: time must be"),
        ("time,point,x,y\n0,,1,1\n", "line 2: point is empty"),
        ("time,point,x,y\n0,0,1\n", "line 2: 3 cells"),
        ("time,point,x,y\n0.2,0,1,1\n0.1,0,1,1\n", "line 3: time of point '0' must rise, but 0.1 s follows 0.2 s"),
        ("time,point,x,y\n0,0,1,1\n0,0,1,1\n", "line 3: time of point '0' must rise"),
        ("time,point,x,y\n0,0,nan,1\n1,0,,1\n", "every point is NaN"),
        ("time,point,x,y,recording\n0,0,1,1,\n", "recording is empty"),
    ],
)
def test_csv_that_cannot_be(tmp_path: Path, text: str, words: str) -> None:
    assert words in complaint(csv(tmp_path, text))


def test_csv_with_columns_mixed_up(tmp_path: Path) -> None:
    rows = "".join(f"{k},{k * 7919 % 3001},0,0\n" for k in range(3000))
    assert "mixed up" in complaint(csv(tmp_path, "time,point,x,y\n" + rows))


def test_gripper_poses_beside_a_csv(tmp_path: Path) -> None:
    track = csv(tmp_path, "time,point,x,y,z\n0,0,1,2,3\n1,0,4,5,6\n")
    poses = csv(tmp_path, "time,gripper,x,y,z,qw,qx,qy,qz\n0,0,100,0,0,1,0,0,0\n1,0,200,0,0,1,0,0,0\n", "g.csv")
    [r] = import_file(track, ImportOptions(gripper=poses, unit="mm", up="x"))
    assert r.gripper is not None
    assert r.gripper.poses[:, 0, :3].tolist() == [[0, 0, 0.1], [0, 0, 0.2]]
    partial = csv(tmp_path, "time,gripper,x,y,z,qw\n0,0,100,0,0,1\n", "g.csv")
    assert "quaternion needs" in complaint(track, gripper=partial)
    lost = csv(tmp_path, "time,gripper,x,y,z\n0,a,1,0,0\n0,b,1,0,0\n1,a,1,0,0\n", "g.csv")
    assert "gripper 'b' has no pose at 1 s" in complaint(track, gripper=lost)
    with pytest.raises(MissingFileError):
        import_file(track, ImportOptions(gripper=tmp_path / "nix.csv"))


def test_gripper_poses_in_milliseconds_are_not_taken_for_seconds(tmp_path: Path) -> None:
    """They begin as the points do, so that the gripper would hardly have moved."""
    late = npz(tmp_path, gripper_pose=np.zeros((11, 1, 3)), gripper_time=1000 * TIME)
    assert "gripper poses are 100 s apart in the middle; their time must be in seconds" in complaint(late)
    rare = npz(tmp_path, gripper_pose=np.zeros((2, 1, 3)), gripper_time=np.array([0.0, 60.0]))
    assert import_file(rare)[0].gripper is not None


def test_files_that_are_not_what_they_say(tmp_path: Path) -> None:
    with pytest.raises(MissingFileError, match="no file"):
        import_file(tmp_path / "nix.npz")
    assert "formats are .npz, .c3d, .csv" in complaint(csv(tmp_path, "x", "a.xlsx"))
    (tmp_path / "folder.csv").mkdir()
    assert "is a folder" in complaint(tmp_path / "folder.csv")
    assert "not an NPZ" in complaint(csv(tmp_path, "hello", "a.npz"))
    (tmp_path / "b.csv").write_bytes(bytes(range(256)))
    assert "not a CSV text file" in complaint(tmp_path / "b.csv")
    whole = npz(tmp_path).read_bytes()
    (tmp_path / "c.npz").write_bytes(whole[:200] + b"\x00" * 40 + whole[240:])
    assert "damaged" in complaint(tmp_path / "c.npz")


def test_random_damage_is_told_and_never_crashes(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    sources = [npz(tmp_path), csv(tmp_path, "time,point,x,y\n" + "".join(f"{k},0,{k},{k}\n" for k in range(30)))]
    told = 0
    for source in sources:
        whole = source.read_bytes()
        for _ in range(60):
            damaged = bytearray(whole)
            for _ in range(int(rng.integers(1, 8))):
                damaged[rng.integers(len(damaged))] = rng.integers(256)
            damaged = damaged[: rng.integers(len(whole) // 2, len(whole) + 1)]
            (tmp_path / f"z{source.suffix}").write_bytes(damaged)
            try:
                import_file(tmp_path / f"z{source.suffix}")
            except InputError as error:
                told += 1
                assert "\n" not in str(error)
    assert told > 80


def test_cropping(tmp_path: Path) -> None:
    assert "start must be before stop" in complaint(npz(tmp_path), start=0.5, stop=0.2)
    assert "the file goes from 0 to 1 s" in complaint(npz(tmp_path), start=5.0)
