"""Points from a NumPy archive."""

import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ..arrays import FloatArray
from ..dataset import note
from ..errors import InputError, MuslinError
from .raw import RawGripper, RawTake

_KEYS = "time (T,) [s], points (T, P, 2 or 3)"
_KNOWN = (
    "time",
    "points",
    "unit",
    "correspondence",
    "recording",
    "motion",
    "load",
    "gripper_pose",
    "gripper_time",
)


def read_npz(path: Path) -> list[RawTake]:
    """One take. Arrays of Python objects are refused: reading them could run code from the file.

    Arrays of other names are not read, which is said with a warning, as a name may be misspelt.

    Raises:
        InputError: not such a file, or an array with another shape or type; says which.
    """
    if not zipfile.is_zipfile(path):
        raise InputError(f"{path} is not an NPZ archive; write one with numpy.savez(path, time=..., points=...)")
    try:
        with np.load(path, allow_pickle=False) as archive:
            arrays = {name: _array(archive, name, path) for name in _KNOWN if name in archive.files}
            found = archive.files
    except MuslinError:
        raise
    except Exception as error:  # a damaged archive fails in many ways, none of them the caller's to know
        raise InputError(f"{path} is damaged: {_first_line(error)}; write it again") from error
    for name in ("time", "points"):
        if name not in arrays:
            raise InputError(f"{path} has no array {name!r}; it needs {_KEYS}, and has {', '.join(found) or 'nothing'}")
    if others := [name for name in found if name not in _KNOWN]:
        note(f"{path}: not read: {', '.join(others)}; what is read are {', '.join(_KNOWN)}")
    time, points = _numbers(arrays["time"], "time", path), _numbers(arrays["points"], "points", path)
    if time.ndim != 1 or points.ndim != 3 or points.shape[2] not in (2, 3) or len(time) != len(points):
        raise InputError(f"{path} needs {_KEYS}, but has time {time.shape} and points {points.shape}")
    return [
        RawTake(
            time,
            points,
            unit=_text(arrays, "unit", path),
            correspondence=_flag(arrays, path),
            name=_text(arrays, "recording", path),
            motion=_text(arrays, "motion", path),
            load=_load(arrays, path),
            gripper=_gripper(arrays, time, path),
        )
    ]


def _first_line(error: BaseException) -> str:
    lines = str(error).splitlines()
    return f"{lines[0]:.160}" if lines else type(error).__name__


def _array(archive: Any, name: str, path: Path) -> npt.NDArray[Any]:
    try:
        return np.asarray(archive[name])
    except ValueError as error:
        if "allow_pickle" in str(error) or "Object arrays" in str(error):
            raise InputError(
                f"{path}: array {name!r} holds Python objects; save it as plain numbers, "
                "for example with numpy.asarray(values, dtype=float)"
            ) from error
        raise


def _numbers(array: npt.NDArray[Any], name: str, path: Path) -> FloatArray:
    if array.dtype.kind not in "fiu":
        raise InputError(f"{path}: {name} must hold real numbers, but holds {array.dtype}")
    values = np.asarray(array, np.float64)
    if np.isinf(values).any():
        raise InputError(f"{path}: {name} holds an infinite value; a point that was not seen is NaN")
    return values


def _scalar(arrays: dict[str, npt.NDArray[Any]], name: str, kinds: str, wanted: str, path: Path) -> Any:
    if name not in arrays:
        return None
    array = arrays[name]
    if array.size != 1 or array.dtype.kind not in kinds:
        raise InputError(f"{path}: {name} must be {wanted}, but is an array {array.shape} of {array.dtype}")
    return array.item()


def _text(arrays: dict[str, npt.NDArray[Any]], name: str, path: Path) -> str | None:
    value = _scalar(arrays, name, "U", "one text", path)
    return None if value is None else str(value)


def _flag(arrays: dict[str, npt.NDArray[Any]], path: Path) -> bool | None:
    value = _scalar(arrays, "correspondence", "biu", "true or false", path)
    return None if value is None else bool(value)


def _load(arrays: dict[str, npt.NDArray[Any]], path: Path) -> float | None:
    value = _scalar(arrays, "load", "fiu", "one number [kg]", path)
    return None if value is None else float(value)


def _gripper(arrays: dict[str, npt.NDArray[Any]], time: FloatArray, path: Path) -> RawGripper | None:
    if "gripper_pose" not in arrays:
        if "gripper_time" in arrays:
            raise InputError(f"{path} has gripper_time but no gripper_pose (T, G, 3 or 7)")
        return None
    own = arrays.get("gripper_time")
    times = time if own is None else _numbers(own, "gripper_time", path)
    return RawGripper(times, _numbers(arrays["gripper_pose"], "gripper_pose", path))
