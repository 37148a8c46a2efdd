"""Rest shapes of ropes, from how they turn at every vertex."""

from dataclasses import replace
from itertools import pairwise

import numpy as np

from .arrays import FloatArray
from .bending import RopeBending
from .body import Body

#: Turns at a vertex that are not worth telling from rounding [rad].
_STRAIGHT = 1e-7


def rolled_out(
    first: FloatArray, along: FloatArray, frame: FloatArray, turns: FloatArray, lengths: FloatArray
) -> FloatArray:
    """Vertices ``(V, 3)`` [m] of a rope.

    Args:
        first: vertex ``(3,)`` [m].
        along: unit vector ``(3,)`` of the first segment.
        frame: two unit vectors ``(2, 3)`` normal to it and to each other, carried along without twist.
        turns: from segment to segment, in that frame ``(V - 2, 2)`` [rad].
        lengths: of the segments ``(V - 1,)`` [m].
    """
    angles = np.linalg.norm(turns, axis=1)
    across = turns / np.where(angles > 0.0, angles, 1.0)[:, None]
    # what turns the axes (along, frame) by these angles about those vectors, told in the same axes (Rodrigues)
    axis = np.concatenate([np.zeros((len(turns), 1)), across], axis=1)
    cosine = np.cos(angles)[:, None, None]
    made = cosine * np.eye(3) + (1.0 - cosine) * axis[:, :, None] * axis[:, None, :]
    sideways = np.sin(angles)[:, None] * np.stack([across[:, 1], -across[:, 0]], axis=1)
    made[:, 0, 1:] -= sideways
    made[:, 1:, 0] += sideways
    axes = np.column_stack([along, *frame])
    steps = np.empty((len(turns) + 1, 3))
    steps[0] = along
    for k, turn in enumerate(made):
        axes = axes @ turn
        steps[k + 1] = axes[:, 0]
    return np.asarray(first + np.concatenate([np.zeros((1, 3)), np.cumsum(steps * lengths[:, None], axis=0)]))


def eased(body: Body, share: float) -> Body:
    """A rope that turns at every vertex by ``share`` of what ``body`` does, about the same direction of its material.

    The first segment stays where it is. A straight rope is given back itself.
    """
    bending = RopeBending(body)
    turns = bending.rest * bending.measures[:, None]
    if np.abs(turns).max(initial=0.0) < _STRAIGHT:
        return body
    along = np.diff(body.vertices, axis=0) / body.measures[:, None]
    frames = _untwisted(along)
    vectors = np.einsum("na,nax->nx", turns, bending.axes)
    own = np.einsum("nax,nx->na", frames[:-1], vectors)  # the same in the frame behind: it turns about this vector
    vertices = rolled_out(body.vertices[0], along[0], frames[0], share * own, body.measures)
    return replace(body, vertices=vertices)


def _untwisted(along: FloatArray) -> FloatArray:
    """Frames ``(E, 2, 3)`` normal to segments of direction ``along (E, 3)``, carried along without twist."""
    first = np.cross(along[0], np.eye(3)[np.abs(along[0]).argmin()])
    frame = np.stack([first, np.cross(along[0], first)]) / np.linalg.norm(first)
    out = [frame]
    for a, b in pairwise(along):
        turned = frame - np.outer(frame @ b, a + b) / max(1.0 + float(a @ b), 1e-9)
        frame = turned / np.linalg.norm(turned, axis=1, keepdims=True)
        out.append(frame)
    return np.array(out)
