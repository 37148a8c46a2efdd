"""The file's frame turned so that z is up."""

import numpy as np

from ..arrays import FloatArray
from ..errors import InputError

#: Axis that is up in the file -> which of its axes become x, y, z. Cyclic, so the frame stays right-handed.
TURNS: dict[str, tuple[int, int, int]] = {"x": (1, 2, 0), "y": (2, 0, 1), "z": (0, 1, 2)}


def turned(vectors: FloatArray, up: str, where: str) -> FloatArray:
    """Vectors ``(..., 3)`` with ``up``, a key of :data:`TURNS`, turned to z.

    For up = x the new x, y, z are the old y, z, x.

    Raises:
        InputError: the vectors have two axes and are to be turned.
    """
    if up == "z":
        return vectors
    if vectors.shape[-1] != 3:
        raise InputError(f"{where}: the points have 2 coordinates, so there is no axis to turn up; leave --up out")
    return np.ascontiguousarray(vectors[..., TURNS[up]])


def turned_poses(poses: FloatArray, up: str, where: str) -> FloatArray:
    """Poses ``(..., 7)`` in the turned frame; the axis of a rotation turns like any vector."""
    parts = [turned(poses[..., :3], up, where), poses[..., 3:4], turned(poses[..., 4:], up, where)]
    return np.concatenate(parts, axis=-1)
