"""Segments of a rope that are held at both ends: they turn about themselves with their gripper, and twist the rope."""

import numpy as np

from .arrays import BoolArray, FloatArray, IntArray
from .body import Body
from .motion import turns_about


def clamped_segments(body: Body, held: IntArray) -> BoolArray:
    """Segments ``(E,)`` of a rope of which both ends are among ``held (H,)``; none of another object."""
    if body.kind != "rope":
        return np.zeros(len(body.elements), np.bool_)
    return np.asarray(np.isin(body.elements, held).all(axis=1))


def clamp_turns(body: Body, grasps: tuple[IntArray, ...], quaternions: FloatArray, held: FloatArray) -> FloatArray:
    """By how much grippers turn :func:`clamped_segments` about themselves ``(T, C)`` [rad] since the first time.

    Seen from frames that are carried along with each segment by the shortest turn from time to time.

    Args:
        body: the object.
        grasps: for every gripper the vertices that it holds.
        quaternions: of the grippers, w x y z ``(T, G, 4)``.
        held: where the held vertices are, gripper by gripper ``(T, H, 3)`` [m].
    """
    order = np.concatenate([np.zeros(0, np.int64), *grasps]).astype(np.int64)
    gripper = np.repeat(np.arange(len(grasps)), [len(g) for g in grasps])
    parts = []
    for ends in body.elements[clamped_segments(body, order)]:
        a, b = (int(np.flatnonzero(order == v)[0]) for v in ends)
        along = held[:, b] - held[:, a]
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        parts.append(turns_about(along, quaternions[:, gripper[a]]))
    return np.stack(parts, axis=1) if parts else np.zeros((len(held), 0))
