"""Sheets lifted or folded by a robot, seen as point clouds."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ...core.arrays import BoolArray, FloatArray
from ...core.dataset import about, archives, arrays, chosen, note, shaped
from ...core.errors import InputError
from ...core.importing.zeros import unseen_zeros
from ...core.measurement import Recording
from ...core.motion import Motion
from ...core.series import PointSeries
from ...core.subsets import stacked, thinned
from .metres import check_metres

#: A point counts as one of the sheet if so many share its neighbourhood of three cells a side [m].
CROWD, CELL = 12, 0.01
#: Points farther than this from nearly all others are not looked at [m].
REACH = 0.5
#: Points that are kept of a frame, one in every voxel of this side [m].
KEPT, VOXEL = 600, 0.005
#: Frames at the start in which the clouds hold arm and gripper rather than cloth.
SKIPPED = 5


def read_cloth_cloud(path: Path, takes: Sequence[str]) -> list[Recording]:
    """Takes from a folder of NPZ files, or one: ``points (T, P, 3)``, ``gripper_cmd (T, 3)`` [m], ``t (T,)`` [s].

    Clouds have no correspondence; they are cut off near the table. Points that stand nearly alone are left out, those
    that share 0, 0, 0, with which files are filled up, and frames that show no sheet; of
    the others at most 600 a frame are kept, evenly. The gripper is the command, which
    the cloth's apex trails by 2 to 3 cm; its poses go from the first frame, the points from the sixth. Takes whose
    names differ in a trailing 2 alone are repeats.

    References:
        Sundaresan, Antonova and Bohg, *DiffCloud: real-to-sim from point clouds with differentiable simulation and
        rendering of deformable objects*, IROS 2022; github.com/priyasundaresan/diffcloud_real2sim.
    """
    files = archives(path, ("points", "gripper_cmd", "t"))
    made = []
    for name in chosen(takes, list(files), path):
        with about(files[name]):
            made.append(_recording(files[name], name))
    return made


def among_many(points: FloatArray) -> BoolArray:
    """Which of ``points (N, 3)`` [m] have :data:`CROWD` points, themselves included, in their cell and those around."""
    out = np.zeros(len(points), bool)
    if not len(points):
        return out
    low, high = np.quantile(points, (0.01, 0.99), axis=0)
    near = np.flatnonzero(((points > low - REACH) & (points < high + REACH)).all(axis=1))
    cells = np.floor(points[near] / CELL).astype(np.int64)
    cells -= cells.min(axis=0) - 1
    sides = cells.max(axis=0) + 2
    numbers, own, counts = np.unique(
        np.ravel_multi_index(tuple(cells.T), sides), return_inverse=True, return_counts=True
    )
    around = np.zeros(len(numbers), np.int64)
    for step in np.array(list(np.ndindex(3, 3, 3))) - 1:
        beside = numbers + step @ np.array([sides[1] * sides[2], sides[2], 1])
        at = np.minimum(np.searchsorted(numbers, beside), len(numbers) - 1)
        around += np.where(numbers[at] == beside, counts[at], 0)
    out[near] = around[own] >= CROWD
    return out


def _recording(path: Path, name: str) -> Recording:
    data = arrays(path, ("points", "gripper_cmd", "t"))
    points = shaped(data["points"], (None, None, 3), "points", path)
    command = shaped(data["gripper_cmd"], (len(points), 3), "gripper_cmd", path)
    time = shaped(data["t"], (len(points),), "t", path)
    check_metres(points, "points", path)
    if (zeros := unseen_zeros(points, correspondence=False)).any():
        note(f"{name}: {int(zeros.sum())} points at exactly 0, 0, 0 are taken as not seen")
        points[zeros] = np.nan
    if len(points) < SKIPPED + 2:
        raise InputError(f"{path}: {len(points)} frames are too few; the first {SKIPPED} are left out")
    frames = [frame[np.isfinite(frame).all(axis=1)] for frame in points[SKIPPED:]]
    crowded = [frame[among_many(frame)] for frame in frames]
    shown = np.array([len(frame) > 0 for frame in crowded])
    if shown.sum() < 2:
        raise InputError(
            f"{path}: frame {SKIPPED + int(np.argmin(shown))} shows no sheet: no {CROWD} of its points lie together, "
            "as in nearly all frames; are they in metres?"
        )
    if not shown.all():
        note(f"{name}: left out {int((~shown).sum())} of {len(shown)} frames that show no sheet")
    crowded = [frame for frame in crowded if len(frame)]
    alone = sum(map(len, frames)) - sum(map(len, crowded))
    kept = stacked([thinned(frame, VOXEL, KEPT) for frame in crowded], KEPT)
    note(
        f"{name}: left out the first {SKIPPED} frames, which show arm and gripper, and {alone} points that stand "
        f"alone; kept {np.isfinite(kept[..., 0]).sum(axis=1).mean():.0f} of {points.shape[1]} points a frame, evenly"
    )
    series = PointSeries(time[SKIPPED:][shown], kept, correspondence=False)
    return Recording(name, series, Motion.from_positions(time, command[:, None]), name.removesuffix("2"))
