"""Readers of published sets on clones of their sources, as far as their form is known."""

import pickle
import re
import warnings
from pathlib import Path

import numpy as np
import pytest
from carried_sheet import carried
from test_datasets import read, save_cable, swinging_cable

from muslin.core.errors import InputError
from muslin.core.motion import inverse, rotate
from muslin.plugins.datasets.pickled import pickled_array


def clone(folder: Path, protocol: int = 4) -> np.ndarray:
    """Takes 9, 10 and 11 of a cable, two to learn from and one to be judged on; the frames are a list of arrays."""
    takes = np.stack([swinging_cable() + 0.01 * k for k in range(3)]).astype(np.float32)
    for name, take in zip(("train/9", "eval/10", "train/11"), takes, strict=True):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        frames = [frame.T.copy() for frame in take]
        (folder / f"{name}.pkl").write_bytes(pickle.dumps(frames, protocol=protocol))
    return takes


@pytest.mark.parametrize("protocol", range(6))
def test_a_cable_of_a_clone_is_that_of_an_archive(tmp_path: Path, protocol: int) -> None:
    markers = clone(tmp_path / "DLO1", protocol)
    archive = save_cable(tmp_path / "cable.npz", markers, ("9.pkl", "10.pkl", "11.pkl"))
    cloned, _ = read("deform-cable", tmp_path / "DLO1")
    for ours, theirs in zip(cloned, read("deform-cable", archive)[0], strict=True):
        assert ours.name == theirs.name and ours.gripper is not None and theirs.gripper is not None
        np.testing.assert_array_equal(ours.series.time, theirs.series.time)
        np.testing.assert_array_equal(ours.series.points, theirs.series.points)
        np.testing.assert_array_equal(ours.gripper.poses, theirs.gripper.poses)


def test_parts_of_a_clone(tmp_path: Path) -> None:
    markers = clone(tmp_path / "DLO1")
    assert [r.name for r in read("deform-cable", tmp_path / "DLO1/train")[0]] == ["9", "11"]
    assert [r.name for r in read("deform-cable", tmp_path / "DLO1", "11", "10")[0]] == ["11", "10"]
    whole = tmp_path / "DLO1/train/9.pkl"
    whole.write_bytes(pickle.dumps(markers[0].transpose(0, 2, 1)))  # one array
    ((take,), _) = read("deform-cable", whole)
    np.testing.assert_array_equal(take.series.points, markers[0])


def test_what_is_wrong_with_a_clone_is_said(tmp_path: Path) -> None:
    clone(tmp_path / "DLO1")
    train = tmp_path / "DLO1/train"
    for made, said in (
        (pickle.dumps([np.zeros((3, 8)), np.zeros((3, 7))]), "not a pickle of arrays of one shape"),
        (pickle.dumps(np.zeros((60, 8, 3))), r"its frames must have shape \(any, 3, any\), but has shape \(60, 8, 3\)"),
        (pickle.dumps(np.zeros((60, 3, 3))), "clamped must name 4 different markers of 3"),
        (pickle.dumps([[["0"] * 8] * 3] * 60), "its frames must hold real numbers, but holds <U1"),
        (pickle.dumps({"a": 1.0}), "its frames must hold real numbers, but holds object"),
        (b"no pickle", "or damaged"),
        (b"", "or damaged"),
    ):
        (train / "11.pkl").write_bytes(made)
        with pytest.raises(InputError, match=rf"11\.pkl.*{said}"):
            read("deform-cable", train, "11")
    (tmp_path / "DLO1/eval/9.pkl").write_bytes((train / "9.pkl").read_bytes())
    with pytest.raises(InputError, match="has two takes '9'"):
        read("deform-cable", tmp_path / "DLO1")
    with pytest.raises(InputError, match=r"holds no \.pkl file; name the folder of one cable"):
        read("deform-cable", tmp_path)


class Eager:
    """Writes a file where it is read as pickles mostly are."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __reduce__(self) -> tuple[object, tuple[object, ...]]:
        return Path.touch, (self.path,)


def test_a_pickle_runs_nothing(tmp_path: Path) -> None:
    for held in (Eager(tmp_path / "run"), [np.zeros(3), Eager(tmp_path / "run")]):
        (tmp_path / "1.pkl").write_bytes(pickle.dumps(held))
        with pytest.raises(InputError, match=r"1\.pkl holds .*, which is not read because it may run code"):
            pickled_array(tmp_path / "1.pkl")
    assert not (tmp_path / "run").exists()


#: Where the camera of the source stood in one session: 1.5 m before the robot, x to the right and y down.
CAMERA = np.array([-0.0149, -1.5417, 0.0924]), np.array([0.6983, -0.7163, 0.0076, 0.0174])


def export(session: Path, name: str, made: dict[str, np.ndarray], turned: bool = False, flip: int = 0) -> Path:
    """A take as ROS exports it; the camera tells the grid row by row or column by column, from any corner."""
    folder, n = session / "Converted CSV", made["mesh"].shape[1]
    folder.mkdir(parents=True, exist_ok=True)
    position, turn = CAMERA[0], CAMERA[1] / np.linalg.norm(CAMERA[1])
    nodes = rotate(inverse(turn), made["mesh"] - position)
    nodes = nodes[:, :: -1 if flip & 1 else 1, :: -1 if flip & 2 else 1]
    nodes = nodes.swapaxes(1, 2) if turned else nodes
    flat = np.moveaxis(nodes, -1, 1).reshape(len(nodes), -1)
    head = "%time,field.header.seq,field.header.stamp,field.header.frame_id"
    zero = 1_625_480_930_915_335_893

    def lines(times: np.ndarray, values: np.ndarray, more: str = "") -> str:
        stamps = [zero + round(1e9 * float(t - made["t"][0])) for t in times]
        rows = zip(stamps, values, strict=True)
        return "".join(f"{s},1,{s},frame,{more}{','.join(f'{v:.12g}' for v in row)}\n" for s, row in rows)

    axes = ",".join(f"field.{axis}{k}" for axis in "xyz" for k in range(n * n))
    grid = folder / f"{name}_mesh.csv"
    grid.write_text(f"{head},field.size,{axes}\n{lines(made['t'], flat, f'{n},')}")
    pose = [*(f"position.{a}" for a in "xyz"), *(f"orientation.{a}" for a in "xyzw")]
    names = ",".join(f"field.pose.{p}" for p in pose)
    (folder / f"{name}_tcp.csv").write_text(f"{head},{names}\n{lines(made['tcp_t'], made['tcp'])}")
    names, told = ",".join(f"field.{p}" for p in pose), [*position, *CAMERA[1][[1, 2, 3, 0]]]
    rows = f"1,9,9,9,0,0,0,1\n2,{','.join(map(str, told))}\n"  # the last line counts
    (folder / f"n{n}_calibration_campose.csv").write_text(f"%time,{names}\n{rows}")
    return grid


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("flip", range(4))
def test_a_carried_cloth_of_a_clone_is_that_of_an_archive(tmp_path: Path, turned: bool, flip: int) -> None:
    made = carried(0.31, (-0.029, -0.005, 0.0))
    made["mesh"][7, 2, 3, :] = made["mesh"][:, 2, 2, :] = np.nan
    session = tmp_path / "Session_2021_07_05"
    grid = export(session, "range30_rep1", made, turned, flip)
    (session / "Converted CSV/n5_calibration_mesh.csv").write_text("no take")
    np.savez(tmp_path / "a.npz", **{**made, "t": made["t"] - made["t"][0], "tcp_t": made["tcp_t"] - made["t"][0]})
    (theirs,), said = read("carried-cloth", tmp_path / "a.npz")
    for path in (session, grid.parent, grid):
        (ours,), notes = read("carried-cloth", path)
        assert ours.name == "2021_07_05_range30_rep1" and [n.split(": ")[1] for n in notes] == [
            n.split(": ")[1] for n in said
        ]
        np.testing.assert_allclose(ours.series.time, theirs.series.time, atol=1e-6)
        np.testing.assert_allclose(ours.series.points, theirs.series.points, atol=1e-8)
        assert ours.gripper is not None and theirs.gripper is not None
        np.testing.assert_allclose(ours.gripper.poses, theirs.gripper.poses, atol=1e-6)


def test_a_carried_cloth_without_its_hand(tmp_path: Path) -> None:
    made = carried(0.0, (0.0, 0.0, 0.0))
    grid = export(tmp_path / "cloths", "n5_traj9_1", made)
    (grid.parent / "n5_traj9_1_tcp.csv").unlink()
    camera = grid.parent / "n5_calibration_campose.csv"
    (tmp_path / "cloths/Converted TXT").mkdir()
    camera.rename(tmp_path / "cloths/Converted TXT/n5_calibration_campose.txt")
    (take,), notes = read("carried-cloth", grid)
    assert take.name == "n5_traj9_1" and "no poses of the robot" in notes[0]
    text = grid.rename(tmp_path / "cloths/Converted TXT/n5_traj9_1_mesh.txt")  # exported, but not renamed
    for path in (tmp_path / "cloths", text):
        ((again,), _) = read("carried-cloth", path)
        np.testing.assert_array_equal(again.series.points, take.series.points)


def test_what_is_wrong_with_a_session_is_said(tmp_path: Path) -> None:
    grid = export(tmp_path, "a", carried(0.3, (0.0, 0.0, 0.0)))
    whole = grid.read_text()
    for text, said in (
        (
            whole.replace("field.x7,", "field.q7,"),
            "columns field.x0 to field.x24, and y and z alike, but it has 24 of x",
        ),
        (whole.replace("field.z7,", "field.q7,"), "columns field.x0 to field.x24"),
        (whole.replace(",frame,5,", ",frame,1e9,"), r"with field.size = 1e\+09 there must be columns"),
        (whole.replace(",frame,5,", ",frame,x,"), "line 2: field.size must be a finite number, but is 'x'"),
        (whole.replace("stamp", "time"), "column 'field.header.stamp' is missing"),
        (whole[:-40], "line 51: .* cells, but the header names 80 columns"),
        (whole.splitlines()[0], "has no rows below its header"),
        ("", "is empty"),
    ):
        grid.write_text(text)
        with pytest.raises(InputError, match=rf"a_mesh\.csv.*{said}"):
            read("carried-cloth", grid)
    grid.write_text(whole)
    camera = grid.parent / "n5_calibration_campose.csv"
    told = camera.read_text()
    for text, said in (
        (told + "3,0,0,0,0,0,0,0\n", "the orientation of its last line has the length 0, not 1"),
        (told + "3,0,0,nan,0,0,0,1\n", "line 4: field.position.z must be a finite number, but is 'nan'"),
    ):
        camera.write_text(text)
        with pytest.raises(InputError, match=rf"campose\.csv.*{said}"):
            read("carried-cloth", grid)
    camera.write_text(told)
    grid.write_text(re.sub(r"(?<=,5,)[-\d.e,]+", ",".join(["nan"] * 75), whole))
    with pytest.raises(InputError, match="every point is NaN in every frame"), warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        read("carried-cloth", grid)
    grid.write_text(whole)
    camera.unlink()
    with pytest.raises(InputError, match=r"there is no n5_calibration_campose\.csv beside it .* copy the whole folder"):
        read("carried-cloth", tmp_path)
