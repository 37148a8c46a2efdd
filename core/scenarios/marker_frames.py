"""Frames of recordings that show every marker of a rope between two grippers."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..arrays import FloatArray, IntArray
from ..errors import InputError
from ..measurement import Recording, check_spatial
from ..motion import inverse, rolled, rotate

#: Frames are taken so far apart [s]: nearer ones show the same bends.
APART = 0.1


@dataclass(frozen=True, eq=False)
class Frames:
    """Frames of R recordings that show every marker, neighbours apart.

    Args:
        points, poses: ``(N, M, 3)`` and ``(N, 2, 7)``.
        owner: which recording a frame is of ``(N,)``, rising.
        axes: directions of the rope in either gripper, towards its last marker ``(R, 2, 3)``.
    """

    points: FloatArray
    poses: FloatArray
    owner: IntArray
    axes: FloatArray

    @classmethod
    def of(cls, recordings: Sequence[Recording], until: float = np.inf) -> "Frames":
        """Those no later than ``until`` after the first [s]."""
        points, poses, axes, owner = [], [], [], []
        for r, recording in enumerate(recordings):
            check_spatial(recording)
            series, motion = recording.series, recording.gripper
            if not series.correspondence or series.points.shape[1] < 4 or motion is None or motion.grippers != 2:
                raise InputError(
                    f"[scenario.markers] = 'beside' is for ropes with at least 4 markers in order between two "
                    f"grippers, but recording {recording.name!r} is another"
                )
            apart = np.linalg.norm(np.diff(series.points, axis=1), axis=2)
            whole = np.flatnonzero((apart > 0).all(axis=1))  # a comparison with NaN is false
            late = np.floor((series.time[whole] - series.time[0]) / APART)
            kept = whole[np.unique(late, return_index=True)[1]]
            seen, held = series.points[kept], motion.at(series.time[kept])
            ends = np.stack([seen[:, 1] - seen[:, 0], seen[:, -1] - seen[:, -2]], axis=1)
            along = rotate(inverse(held[..., 3:]), ends).sum(axis=0)
            axes.append(along / np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-300))
            early = series.time[kept] - series.time[0] <= until
            points.append(seen[early])
            poses.append(held[early])
            owner.append(np.full(early.sum(), r))
        return cls(np.concatenate(points), np.concatenate(poses), np.concatenate(owner), np.stack(axes))

    @property
    def firsts(self) -> IntArray:
        """The first frame of every recording that has some."""
        return np.unique(self.owner, return_index=True)[1]

    def turned(self, rolls: FloatArray) -> FloatArray:
        """The poses of grippers turned by ``rolls (R, 2)`` [rad] about the rope."""
        out = np.empty_like(self.poses)
        for r, (axes, angles) in enumerate(zip(self.axes, rolls, strict=True)):
            own = self.owner == r
            out[own] = rolled(self.poses[own], axes, angles)
        return out
