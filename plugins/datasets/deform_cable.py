"""Cables swung in free air by two robots, with motion capture: the DEFORM data."""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ...core.arrays import FloatArray, IntArray
from ...core.dataset import about, arrays, chosen, note, shaped
from ...core.errors import InputError, MissingFileError
from ...core.measurement import Recording
from ...core.motion import Motion
from ...core.series import PointSeries
from .carried_turns import carried_turns
from .marker_faults import lost_frames, put_back, wrong_markers
from .metres import check_metres
from .pickled import pickled_array

#: Along this axis of its gripper the cable leaves it.
_ALONG = np.array([1.0, 0.0, 0.0])
#: Of all cables of the source: the clamped markers, and frames a second.
_CLAMPED, _FPS = np.array([0.0, 1.0, -2.0, -1.0]), 100.0


def read_deform_cable(path: Path, takes: Sequence[str]) -> list[Recording]:
    """Takes of one cable, as they lie in a clone of the source or from one NPZ file.

    In a clone, ``data_set/DLO1`` holds ``train`` and ``eval`` with a pickle a take: frames of ``(3, P)`` [m], z up.
    The NPZ file has ``markers (take, T, P, 3)`` [m], ``clamped (4,)``, ``fps`` and ``names (take,)``.

    ``clamped`` are the outer and inner marker of the first end, then the inner and outer of the last. A gripper is
    where the outer one is, and turns as the pair turns, about no axis but that of the shortest rotation from frame to
    frame (what a marker pair does not show is the turn about itself); the x axis of the first points along the cable,
    that of the second against it. Clamped markers of one end that were taken for one another are put back. Frames that
    the motion capture lost are put back on the clock, not in the data; markers that cannot be where they seem to be are
    NaN. Where the whole cable jumps farther than lost frames explain, it is said and left.

    References:
        Chen, Zhang, Brei, Vasudevan and others, *Differentiable discrete elastic rods for real-time modeling of
        deformable linear objects* (DEFORM), CoRL 2024; github.com/roahmlab/DEFORM.
    """
    if not path.exists():
        raise MissingFileError(
            f"there is no file or folder {path}; name the folder of one cable (DLO1), or its .npz file"
        )
    if path.is_dir() or path.suffix == ".pkl":
        return _of_clone(path, takes)
    data = arrays(path, ("markers", "clamped", "fps", "names"))
    markers = shaped(data["markers"], (None, None, None, 3), "markers", path)
    check_metres(markers, "markers", path)
    clamped = _clamped(shaped(data["clamped"], (4,), "clamped", path), markers.shape[2], path)
    fps = float(shaped(data["fps"], (), "fps", path))
    if not 0 < fps < np.inf:
        raise InputError(f"{path}: fps must be above zero, but is {fps:g}; it is the number of frames a second")
    names = _names(data["names"], len(markers), path)
    made = []
    for name in chosen(takes, names, path):
        with about(f"{path}, take {name!r}"):
            made.append(_recording(markers[names.index(name)], clamped, 1.0 / fps, name))
    return made


def _of_clone(path: Path, takes: Sequence[str]) -> list[Recording]:
    """Takes of a cable's folder, of one of the two in it, or of one pickle."""
    found = sorted((*path.glob("*.pkl"), *path.glob("*/*.pkl"))) if path.is_dir() else [path]
    files = {file.stem: file for file in sorted(found, key=lambda f: (len(f.stem), f.stem))}
    if not files:
        raise InputError(
            f"{path} holds no .pkl file; name the folder of one cable, as data_set/DLO1 of the source, or an .npz file"
        )
    if twice := next((file for file in found if files[file.stem] != file), None):
        raise InputError(
            f"{path} has two takes {twice.stem!r}: {twice} and {files[twice.stem]}; name one of the folders"
        )
    made = []
    for name in chosen(takes, list(files), path):
        with about(files[name]):
            markers = shaped(pickled_array(files[name]), (None, 3, None), "its frames", files[name])
            markers = markers.transpose(0, 2, 1)
            check_metres(markers, "markers", files[name])
            clamped = _clamped(_CLAMPED, markers.shape[1], files[name])
            made.append(_recording(markers, clamped, 1.0 / _FPS, name))
    return made


def _clamped(given: FloatArray, count: int, path: Path) -> IntArray:
    """Numbers of the clamped markers from 0, of which the file counts some from the end."""
    if not np.isin(given, np.arange(-count, count)).all() or len(set(np.mod(given, count))) < 4:
        told = ", ".join(f"{g:g}" for g in given)
        raise InputError(
            f"{path}: clamped must name 4 different markers of {count} (from 0, or from -1 at the end), but is {told}"
        )
    return np.mod(given, count).astype(np.int64)


def _names(given: npt.NDArray[Any], takes: int, path: Path) -> list[str]:
    """Names of the takes, without a suffix as of ``12.pkl``, which a number after a point is not."""
    if given.shape != (takes,) or given.dtype.kind not in "US":
        raise InputError(
            f"{path}: names must be one text for each of the {takes} takes of markers, but is of shape {given.shape} "
            f"and {given.dtype}"
        )
    names = [re.sub(r"\.[A-Za-z]\w*$", "", str(n)) for n in given.astype(str)]
    twice = sorted({n for n in names if names.count(n) > 1})
    if twice:
        raise InputError(f"{path}: names must differ, but {', '.join(twice)} is there more than once")
    return names


def _recording(markers: FloatArray, clamped: IntArray, step: float, name: str) -> Recording:
    markers, swapped = put_back(np.where(np.isfinite(markers), markers, np.nan), clamped)
    missing, jumped = lost_frames(markers)
    wrong = wrong_markers(markers)
    time: FloatArray = step * (np.arange(len(markers)) + np.cumsum(missing)).astype(np.float64)
    if missing.any():
        note(f"{name}: {int(missing.sum())} lost frames put back on the clock, at {_times(time[missing > 0])}")
    if swapped.any():
        note(f"{name}: two clamped markers put back that were taken for one another, at {_times(time[swapped])}")
    if jumped.any():
        note(f"{name}: the whole cable jumps at {_times(time[jumped])}, which no lost frames explain; left as it is")
    if wrong.any():
        told = _times(time[wrong.any(axis=1)])
        note(f"{name}: {int(wrong.sum())} markers left out in {int(wrong.any(axis=1).sum())} frames, at {told}")
    points = np.where(wrong[..., None], np.nan, markers)
    return Recording(name, PointSeries(time, points), _grippers(time, points, clamped))


def _grippers(time: FloatArray, points: FloatArray, clamped: IntArray) -> Motion:
    """Poses of both ends where all four clamped markers are seen, and those of a pair apart."""
    first, second, third, last = (points[:, c] for c in clamped)
    apart = np.stack([np.linalg.norm(second - first, axis=1), np.linalg.norm(third - last, axis=1)])
    good = (apart > 0).all(axis=0)  # a comparison with NaN is false
    if not good.any():
        raise InputError(
            f"in no frame are all four clamped markers ({', '.join(map(str, clamped))}) where they can be, so there is "
            "no path of the grippers; leave it out: name the others with --take"
        )
    ends = []
    for outer, inner in ((first[good], second[good]), (last[good], third[good])):
        ends.append(np.concatenate([outer, carried_turns(inner - outer, _ALONG)], axis=1))
    return Motion(time[good], np.stack(ends, axis=1))


def _times(times: FloatArray) -> str:
    told = ", ".join(f"{t:.2f}" for t in times[:4])
    return f"{told}{', ...' if len(times) > 4 else ''} s"
