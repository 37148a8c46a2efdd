"""A carried cloth as it lies in a clone of its source: what ROS recorded, exported to CSV."""

import csv
import re
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ...core.arrays import FloatArray, IntArray
from ...core.errors import InputError
from ...core.motion import rotate

#: Of a file of the tracked grid, of the hand, and of the camera's pose.
_MESH, _TCP, _CAMERA = "_mesh", "_tcp", "_calibration_campose"
#: Where CSV lies in the folder of a session, the better place last: some was exported and not renamed.
_FOLDERS, _ENDINGS = ("Converted TXT", "Converted CSV"), (".txt", ".csv")
_SESSION = re.compile(r"Session_(\d{4}_\d{2}_\d{2})")
_STAMP = "field.header.stamp"


def exported_takes(path: Path) -> dict[str, Path]:
    """Files of the tracked grid by take: ``path`` itself, or those in the folder of a session; none in other folders.

    A take is named as its file, after the date of its session.
    """
    folders = [path, *(path / name for name in _FOLDERS)] if path.is_dir() else []
    files = [f for folder in folders for ending in _ENDINGS for f in sorted(folder.glob(f"*{_MESH}{ending}"))]
    if path.is_file() and is_exported(path):
        files = [path]
    date = _SESSION.search(str(path.absolute()))
    before = f"{date.group(1)}_" if date else ""
    return {before + f.stem.removesuffix(_MESH): f for f in files if "calibration" not in f.stem}


def is_exported(path: Path) -> bool:
    """Whether a file is named as that of a tracked grid."""
    return path.suffix in _ENDINGS and path.stem.endswith(_MESH)


def exported(path: Path) -> dict[str, npt.NDArray[Any]]:
    """What the NPZ file of a take holds, from the CSV file of its grid and those beside it.

    The grid is told in the frame of the camera, of which the calibration of the session says where it stood; its last
    line counts, as in the source. Nodes come column by column or row by row, from either side; here the first index
    is along x of the robot, the second up. Stamps are told from the first frame.

    Raises:
        InputError: a file is missing, or is not such a file.
    """
    columns = _Columns(path)
    stamps = columns.stamps()
    size = int(columns.numbers(["field.size"])[0, 0])
    if size < 2:
        raise InputError(f"{path}: field.size must be 2 or more, the nodes along a side, but is {size}")
    nodes = np.stack(
        [columns.numbers([f"field.{axis}{k}" for k in range(size * size)]) for axis in "xyz"], axis=-1
    ).reshape(len(stamps), size, size, 3)
    position, turn = _camera(path, size)
    out: dict[str, npt.NDArray[Any]] = {
        "mesh": rotate(turn, _upward(nodes)) + position,
        "t": (stamps - stamps[0]) / 1e9,
    }
    hand = path.with_stem(path.stem.removesuffix(_MESH) + _TCP)
    if hand.is_file():
        poses = _Columns(hand)
        out["tcp_t"] = (poses.stamps() - stamps[0]) / 1e9
        out["tcp"] = poses.numbers(
            [*(f"field.pose.position.{a}" for a in "xyz"), *(f"field.pose.orientation.{a}" for a in "xyzw")]
        )
    return out


class _Columns:
    """The columns of a CSV file that ROS exported.

    Raises:
        InputError: it has no lines below its head, or a line is short.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        with path.open(newline="", encoding="utf-8", errors="replace") as file:
            head, *self._rows = [row for row in csv.reader(file) if row] or [[]]
        self._places = {name: k for k, name in enumerate(head)}
        if not self._rows:
            raise InputError(f"{path} has no lines below its head; export it again")
        for number, row in enumerate(self._rows, start=2):
            if len(row) != len(head):
                raise InputError(f"{path}, line {number}: {len(row)} values for {len(head)} columns; export it again")

    def numbers(self, names: list[str]) -> FloatArray:
        """Of some columns ``(T, N)``."""
        return np.array(self._read(float, names))

    def stamps(self) -> IntArray:
        """When each message was made ``(T,)`` [ns], as whole numbers: seconds since 1970 leave a float no room."""
        return np.array(self._read(int, [_STAMP]), np.int64)[:, 0]

    def _read(self, kind: type[float] | type[int], names: list[str]) -> list[list[float]]:
        for name in names:
            if name not in self._places:
                raise InputError(f"{self._path} has no column {name!r}, so it is not of this set")
        places, out = [self._places[name] for name in names], []
        for number, row in enumerate(self._rows, start=2):
            try:
                out.append([kind(row[k]) for k in places])
            except ValueError as error:
                raise InputError(f"{self._path}, line {number}: {error}; export it again") from error
        return out


def _camera(path: Path, size: int) -> tuple[FloatArray, FloatArray]:
    """Position ``(3,)`` [m] and quaternion w x y z ``(4,)`` of the camera in the frame of the robot."""
    name = f"n{size}{_CAMERA}"
    places = [path.parent, *(path.parent.parent / folder for folder in reversed(_FOLDERS))]
    found = next((f for p in places for end in reversed(_ENDINGS) if (f := p / f"{name}{end}").is_file()), None)
    if found is None:
        raise InputError(
            f"{path} is told by a camera, but there is no {name}.csv beside it that says where that stood; copy the "
            "whole folder of the session"
        )
    pose = _Columns(found).numbers(
        [*(f"field.position.{a}" for a in "xyz"), *(f"field.orientation.{a}" for a in "wxyz")]
    )[-1]
    return pose[:3], pose[3:] / np.linalg.norm(pose[3:])


def _upward(nodes: FloatArray) -> FloatArray:
    """Grids ``(T, n, n, 3)`` in the camera's frame, x to the right and y down: first index along x, second up."""
    with warnings.catch_warnings():  # a node that is never seen has no middle
        warnings.simplefilter("ignore", RuntimeWarning)
        middle = np.nanmedian(nodes, axis=0)
    across, along = (abs(float(np.nanmean(np.diff(middle[..., 0], axis=axis)))) for axis in (0, 1))
    if across < along:
        nodes, middle = nodes.swapaxes(1, 2), middle.swapaxes(0, 1)
    if np.nanmean(np.diff(middle[..., 0], axis=0)) < 0:
        nodes = nodes[:, ::-1]
    if np.nanmean(np.diff(middle[..., 1], axis=1)) > 0:
        nodes = nodes[:, :, ::-1]
    return nodes
