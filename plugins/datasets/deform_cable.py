"""Cables swung in free air by two robots, with motion capture: the DEFORM data."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ...core.arrays import BoolArray, FloatArray, IntArray
from ...core.dataset import arrays, chosen, note, shaped
from ...core.errors import InputError, MissingFileError
from ...core.measurement import Recording
from ...core.motion import Motion
from ...core.series import PointSeries
from .carried_turns import carried_turns
from .marker_faults import lost_frames, wrong_markers

#: Along this axis of its gripper the cable leaves it.
_ALONG = np.array([1.0, 0.0, 0.0])


def read_deform_cable(path: Path, takes: Sequence[str]) -> list[Recording]:
    """Takes of one cable, from an NPZ file with ``markers (take, T, P, 3)`` [m], ``clamped (4,)``, ``fps``, ``names``.

    ``clamped`` are the outer and inner marker of the first end, then the inner and outer of the last. A gripper is
    where the outer one is, and turns as the pair turns, about no axis but that of the shortest rotation from frame to
    frame (what a marker pair does not show is the turn about itself); the x axis of the first points along the cable,
    that of the second against it. Frames that the motion capture lost are put back on the clock, not in the data;
    markers that cannot be where they seem to be are NaN.

    References:
        Chen, Zhang, Brei, Vasudevan and others, *Differentiable discrete elastic rods for real-time modeling of
        deformable linear objects* (DEFORM), CoRL 2024; github.com/roahmlab/DEFORM.
    """
    if not path.is_file():
        raise MissingFileError(f"there is no file {path}; name the .npz file of one cable")
    data = arrays(path, ("markers", "clamped", "fps", "names"))
    markers = shaped(data["markers"], (None, None, None, 3), "markers", path)
    clamped = np.asarray(shaped(data["clamped"], (4,), "clamped", path), np.int64) % markers.shape[2]
    if len(set(clamped.tolist())) < 4 or markers.shape[1] < 2:
        raise InputError(f"{path}: it needs at least 2 frames and 4 different clamped markers, but has {clamped}")
    names = [str(n).rsplit(".", 1)[0] for n in data["names"]]
    step = 1.0 / float(data["fps"])
    return [_recording(markers[names.index(n)], clamped, step, n) for n in chosen(takes, names, path)]


def _recording(markers: FloatArray, clamped: IntArray, step: float, name: str) -> Recording:
    missing = lost_frames(markers)
    wrong = wrong_markers(markers)
    time: FloatArray = step * (np.arange(len(markers)) + np.cumsum(missing)).astype(np.float64)
    if missing.any():
        note(f"{name}: {int(missing.sum())} lost frames put back on the clock, at {_times(time[missing > 0])}")
    if wrong.any():
        told = _times(time[wrong.any(axis=1)])
        note(f"{name}: {int(wrong.sum())} markers left out in {int(wrong.any(axis=1).sum())} frames, at {told}")
    points = np.where(wrong[..., None], np.nan, markers)
    return Recording(name, PointSeries(time, points), _grippers(time, markers, wrong, clamped))


def _grippers(time: FloatArray, markers: FloatArray, wrong: BoolArray, clamped: IntArray) -> Motion:
    """Poses of both ends where all four clamped markers are right."""
    good = ~wrong[:, clamped].any(axis=1)
    first, second, third, last = (markers[good, c] for c in clamped)
    ends = []
    for outer, inner in ((first, second), (last, third)):
        ends.append(np.concatenate([outer, carried_turns(inner - outer, _ALONG)], axis=1))
    return Motion(time[good], np.stack(ends, axis=1))


def _times(times: FloatArray) -> str:
    told = ", ".join(f"{t:.2f}" for t in times[:4])
    return f"{told}{', ...' if len(times) > 4 else ''} s"
