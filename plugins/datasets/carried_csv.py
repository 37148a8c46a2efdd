"""A carried cloth as it lies in a clone of its source: what ROS recorded, exported to CSV."""

import re
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ...core.arrays import FloatArray
from ...core.errors import InputError
from ...core.importing.gripper import QUATERNION_TOLERANCE
from ...core.importing.table import Table, read_table
from ...core.motion import rotate

#: Of a file of the tracked grid, of the hand, and of the camera's pose.
_MESH, _TCP, _CAMERA = "_mesh", "_tcp", "_calibration_campose"
#: Where CSV lies in the folder of a session, the better place last: some was exported and not renamed.
_FOLDERS, _ENDINGS = ("Converted TXT", "Converted CSV"), (".txt", ".csv")
_SESSION = re.compile(r"Session_(\d{4}_\d{2}_\d{2})")
_STAMP = "field.header.stamp"
#: Columns of poses: where, and the quaternion x y z w.
_POSE = (*(f"position.{a}" for a in "xyz"), *(f"orientation.{a}" for a in "xyzw"))


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
    table = read_table(path, (_STAMP, "field.size"), None)
    stamps, nodes = _numbers(table, [_STAMP])[:, 0], _nodes(table)
    position, turn = _camera(path, nodes.shape[1])
    out: dict[str, npt.NDArray[Any]] = {
        "mesh": rotate(turn, _upward(nodes)) + position,
        "t": (stamps - stamps[0]) / 1e9,
    }
    hand = path.with_stem(path.stem.removesuffix(_MESH) + _TCP)
    if hand.is_file():
        names = [f"field.pose.{part}" for part in _POSE]
        poses = read_table(hand, (_STAMP, *names), None)
        out["tcp_t"] = (_numbers(poses, [_STAMP])[:, 0] - stamps[0]) / 1e9
        out["tcp"] = _numbers(poses, names)
    return out


def _numbers(table: Table, names: list[str], *, gap: bool = False) -> FloatArray:
    """Of some columns ``(T, N)``; with ``gap``, some may be missing."""
    return np.array([[table.number(row, name, gap=gap) for name in names] for row in table.rows])


def _nodes(table: Table) -> FloatArray:
    """The grid as it is told ``(T, n, n, 3)`` [m], NaN where a node was not seen."""
    size = table.number(table.rows[0], "field.size")
    count = sum(name.startswith("field.x") for name in table.columns)
    axes = [[f"field.{axis}{k}" for k in range(count)] for axis in "xyz"]
    if size < 2 or size * size != count or not {name for axis in axes for name in axis} <= set(table.columns):
        raise InputError(
            f"{table.path}: with field.size = {size:g} there must be columns field.x0 to field.x{size * size - 1:g}, "
            f"and y and z alike, but it has {count} of x; export it again"
        )
    nodes = np.stack([_numbers(table, names, gap=True) for names in axes], axis=-1)
    return nodes.reshape(len(nodes), int(size), int(size), 3)


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
    names = [f"field.{part}" for part in _POSE]
    pose = _numbers(read_table(found, names, None), names)[-1]
    length = float(np.linalg.norm(pose[3:]))
    if abs(length - 1.0) > QUATERNION_TOLERANCE:
        raise InputError(f"{found}: the orientation of its last line has the length {length:.3g}, not 1")
    return pose[:3], pose[[6, 3, 4, 5]] / length


def _upward(nodes: FloatArray) -> FloatArray:
    """Grids ``(T, n, n, 3)`` in the camera's frame, x to the right and y down: first index along x, second up."""
    with warnings.catch_warnings():  # a node that is never seen has no middle
        warnings.simplefilter("ignore", RuntimeWarning)
        middle = np.nanmedian(nodes, axis=0)
        across, along = (float(np.nanmean(np.diff(middle[..., 0], axis=axis))) for axis in (0, 1))
        if abs(across) < abs(along):
            nodes, middle, across = nodes.swapaxes(1, 2), middle.swapaxes(0, 1), along
        down = float(np.nanmean(np.diff(middle[..., 1], axis=1)))
    return nodes[:, :: -1 if across < 0 else 1, :: -1 if down > 0 else 1]
