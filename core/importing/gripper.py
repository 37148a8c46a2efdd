"""Gripper poses of an imported file."""

from pathlib import Path

import numpy as np

from ..arrays import FloatArray
from ..errors import InputError
from ..motion import IDENTITY_POSE, Motion
from .axes import turned_poses
from .raw import RawGripper
from .table import read_table
from .units import METRES

#: So many poses that are farther apart than this [s] are on a clock of milliseconds.
_SEVERAL, _LONG = 10, 5.0
#: How far the norm of a quaternion may be from one before it is taken for something else.
QUATERNION_TOLERANCE = 0.05


def read_gripper_csv(path: Path, recording: str) -> RawGripper:
    """Poses from a long-form CSV: ``time,gripper,x,y,z[,qw,qx,qy,qz]``.

    Args:
        path: of the file.
        recording: if the file has a column ``recording``, only its rows of this name are read.

    Raises:
        InputError: see :func:`~.table.read_table`; also a gripper without a pose at one of the times.
    """
    turn = ("qw", "qx", "qy", "qz")
    table = read_table(path, ("time", "gripper", "x", "y", "z"), (*turn, "recording"))
    given = [c for c in turn if c in table.columns]
    if given and len(given) < 4:
        raise InputError(f"{path}: a quaternion needs the columns qw, qx, qy and qz, but there are {', '.join(given)}")
    rows = [r for r in table.rows if r.cells.get("recording", recording).strip() == recording]
    if not rows:
        raise InputError(f"{path} has no rows of recording {recording!r}")
    poses: dict[tuple[float, str], list[float]] = {}
    names: dict[str, float] = {}
    for row in rows:
        time, name = table.number(row, "time"), row.cells["gripper"].strip()
        if time <= names.get(name, -np.inf):
            raise InputError(
                f"{path}, line {row.line}: time of gripper {name!r} must rise, but {time:g} s follows "
                f"{names[name]:g} s; sort the rows"
            )
        names[name] = time
        poses[time, name] = [table.number(row, c) for c in ("x", "y", "z", *given)]
    times = sorted({time for time, _ in poses})
    for time in times:
        for name in names:
            if (time, name) not in poses:
                raise InputError(f"{path}: gripper {name!r} has no pose at {time:g} s; each needs one at every time")
    grippers = sorted(names, key=int) if all(n.isdecimal() for n in names) else list(names)
    return RawGripper(np.array(times), np.array([[poses[t, n] for n in grippers] for t in times]))


def to_motion(raw: RawGripper, unit: str, up: str, where: str) -> Motion:
    """A motion in metres with unit quaternions, z up.

    Args:
        raw: as read.
        unit: of the points; positions share it, but are in metres beside pixels.
        up: axis of the file that points up.
        where: the file, for messages.

    Raises:
        InputError: wrong shapes, a value that is not a number, a quaternion far from unit length, or
            time that does not rise.
    """
    poses = raw.poses
    if poses.ndim != 3 or poses.shape[2] not in (3, 7) or poses.shape[1] == 0 or poses.shape[0] == 0:
        raise InputError(f"{where}: gripper_pose must have shape (T, G, 3) or (T, G, 7), but has {poses.shape}")
    if raw.times.shape != poses.shape[:1]:
        raise InputError(
            f"{where}: gripper_pose has {len(poses)} times, but its time has shape {raw.times.shape}; "
            "give gripper_time (T,) [s] where the grippers have a clock of their own"
        )
    if not (np.isfinite(poses).all() and np.isfinite(raw.times).all()):
        broken = ~(np.isfinite(poses).all(axis=(1, 2)) & np.isfinite(raw.times))
        raise InputError(f"{where}: gripper pose {int(np.argmax(broken))} holds a value that is not a finite number")
    if len(poses) >= _SEVERAL and (step := float(np.median(np.diff(raw.times)))) > _LONG:
        raise InputError(
            f"{where}: gripper poses are {step:g} s apart in the middle; their time must be in seconds, is it in "
            "milliseconds?"
        )
    positions = poses[..., :3] * METRES.get(unit, 1.0)
    full = np.concatenate([positions, _quaternions(poses, where)], axis=2)
    try:
        return Motion(raw.times, turned_poses(full, up, where))
    except InputError as error:
        raise InputError(f"{where}: gripper {error}") from error


def _quaternions(poses: FloatArray, where: str) -> FloatArray:
    if poses.shape[2] == 3:
        return np.broadcast_to(IDENTITY_POSE[3:], (*poses.shape[:2], 4)).copy()
    turn = poses[..., 3:]
    norm = np.linalg.norm(turn, axis=2, keepdims=True)
    off = np.abs(norm[..., 0] - 1.0) > QUATERNION_TOLERANCE
    if off.any():
        k, g = (int(i) for i in np.argwhere(off)[0])
        raise InputError(
            f"{where}: the quaternion (w x y z) of gripper {g} at index {k} has length {norm[k, g, 0]:.3g}, not 1"
        )
    return np.asarray(turn / norm)
