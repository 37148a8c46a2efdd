"""Markers that stand beside the axis of a rope, and turn with its material."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from .arrays import FloatArray, IntArray, dot
from .motion import rotate
from .twist import settled_twist, twist_by_ends

#: How often the place of the axis is told anew from the markers and their frames.
_ROUNDS = 4
#: Frames are those of one recording.
_ONE = np.zeros(1, np.int64)


@dataclass(frozen=True, eq=False)
class Natural:
    """Natural curvature of a rope, in the axes of its material.

    Args:
        shares: of the length, rising ``(K,)`` [1].
        curvature: there ``(K, 2)`` [1/m].
    """

    shares: FloatArray
    curvature: FloatArray

    def at(self, shares: FloatArray) -> FloatArray:
        """At other ``shares (V,)`` of the length ``(V, 2)`` [1/m]."""
        return np.stack([np.interp(shares, self.shares, k) for k in self.curvature.T], axis=1)


@dataclass(frozen=True, eq=False)
class Beside:
    """Where markers stand, in the cross-sections of a rope that two grippers hold.

    A cross-section has the axes of :func:`rope_frames`: the first is the z axis of the first gripper, carried along.

    Args:
        offsets: of the markers from the axis of the rope ``(M, 2)`` [m].
        turn: angle of the second gripper's z axis, seen from the first one's that was carried along, where the rope is
            not twisted [rad].
        natural: curvature that the rope keeps, which takes part in how it twists; None: it is straight at rest.
    """

    offsets: FloatArray
    turn: float
    natural: Natural | None = None

    def shifts(self, vertices: FloatArray, poses: FloatArray, markers: FloatArray) -> FloatArray:
        """What takes the markers ``(T, M, 3)`` [m] from the axis to where they stand.

        Args:
            vertices: of the rope, in order ``(T, V, 3)`` [m].
            poses: of both grippers ``(T, 2, 7)``.
            markers: weights ``(M, V)`` of their places on the axis.
        """
        frames = rope_frames(vertices, poses, self.turn, self.natural)
        across = np.tensordot(markers, frames, axes=(1, 1))  # one einsum of all three takes far longer
        return np.asarray(np.einsum("ma,mtax->tmx", self.offsets, across))

    def frames(self, points: FloatArray, poses: FloatArray, firsts: IntArray = _ONE) -> FloatArray:
        """Axes of the cross-sections ``(T, M, 2, 3)`` at ``points (T, M, 3)`` on the axis."""
        curve, places = curves(points)
        return rope_frames(curve, poses, self.turn, self.natural, firsts)[:, places]

    def twist_by_grippers(self, points: FloatArray, poses: FloatArray, firsts: IntArray = _ONE) -> FloatArray:
        """By how much the :meth:`frames` turn about the rope as either gripper does ``(T, M, 2)`` [1]."""
        curve, places = curves(points)
        return _twisted(curve, poses, self.turn, self.natural, firsts)[3]()[:, places]

    def twist(self, vertices: FloatArray, poses: FloatArray) -> float:
        """By how much the grippers, at ``poses (2, 7)``, twist the rope of ``vertices (V, 3)`` [m] in all [rad]."""
        angle = float(closing_angles(vertices[None], poses[None])[0]) - self.turn
        return angle - 2 * np.pi * round(angle / (2 * np.pi))

    def axis(self, points: FloatArray, poses: FloatArray, firsts: IntArray = _ONE) -> FloatArray:
        """Places on the axis ``(T, M, 3)`` [m] of markers seen at ``points (T, M, 3)`` [m].

        NaN in frames that do not show every marker: nothing tells then how the rope lies. Frames of several recordings
        that show every marker may follow one another, from ``firsts (R,)`` on.
        """
        whole = np.isfinite(points).all(axis=(1, 2))
        out = np.full(points.shape, np.nan)
        found = seen = points[whole]
        for _ in range(_ROUNDS if len(seen) else 0):
            found = seen - np.einsum("ma,tmax->tmx", self.offsets, self.frames(found, poses[whole], firsts))
        out[whole] = found
        return out


def rope_frames(
    curve: FloatArray, poses: FloatArray, turn: float, natural: Natural | None = None, firsts: IntArray = _ONE
) -> FloatArray:
    r"""Two axes of the cross-section at every vertex of a rope ``(T, V, 2, 3)``, normal to it and to each other.

    At the first vertex the first axis is the z axis of the first gripper, at the last that of the second one, turned
    back by ``turn``. In between the frame is carried along without twist (Bishop 1975), and what the grippers twist the
    rope by, :math:`\theta`, has settled (Bergou et al., *Discrete elastic rods*, 2008): at the length s of L it is
    :math:`\theta s / L` in a uniform rod that is straight at rest, and that of
    :func:`~muslin.core.twist.settled_twist` in one that keeps a bend. From frame to frame it does not jump.

    Args:
        curve: vertices in order ``(T, V, 3)`` [m], neighbours apart.
        poses: of the grippers at the first and the last ``(T, 2, 7)``.
        turn: see :class:`Beside` [rad].
        natural: likewise.
        firsts: where frames of another recording begin ``(R,)``.
    """
    carried, beside, twist, _ = _twisted(curve, poses, turn, natural, firsts)
    twist = twist[..., None]
    turned = (np.cos(twist) * carried + np.sin(twist) * beside, np.cos(twist) * beside - np.sin(twist) * carried)
    return np.stack(turned, axis=2)


def _twisted(
    curve: FloatArray, poses: FloatArray, turn: float, natural: Natural | None, firsts: IntArray
) -> tuple[FloatArray, FloatArray, FloatArray, Callable[[], FloatArray]]:
    """Both axes without twist, the angles of the material ``(T, V)``, and what gives the ends' share ``(T, V, 2)``."""
    carried, beside, share, angle = _carried(curve, poses)
    angle = np.unwrap(angle - turn)
    whole = np.round(angle[firsts] / (2 * np.pi))
    angle -= 2 * np.pi * np.repeat(whole, np.diff([*firsts, len(angle)]))
    if natural is None:
        return carried, beside, angle[:, None] * share, lambda: np.stack([1.0 - share, share], axis=2)
    bends, lengths = bent_by(curve, carried, beside)
    kept, ends = natural.at(share.mean(axis=0)[1:-1]), np.stack([0.0 * angle, angle], axis=1)
    twist = settled_twist(bends, kept, lengths, ends)
    return carried, beside, twist, partial(twist_by_ends, bends, kept, lengths, twist)


def bent_by(curve: FloatArray, first: FloatArray, second: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Curvatures ``(T, V - 2, 2)`` [1/m] along two axes ``(T, V, 3)``, and the lengths of segments ``(T, V - 1)`` [m].

    The curvature vector stands across the plane of the bend; Bergou et al., *Discrete elastic rods*, 2008.
    """
    segments = np.diff(curve, axis=1)
    lengths = np.linalg.norm(segments, axis=2)
    before, behind = (segments / lengths[..., None])[:, :-1], (segments / lengths[..., None])[:, 1:]
    vectors = 2.0 * np.cross(before, behind) / np.maximum(1.0 + np.sum(before * behind, axis=2), 1e-9)[..., None]
    vectors /= 0.5 * (lengths[:, 1:] + lengths[:, :-1])[..., None]
    return np.stack([np.sum(vectors * axis[:, 1:-1], axis=2) for axis in (first, second)], axis=2), lengths


def untwisted_frames(curve: FloatArray, poses: FloatArray) -> FloatArray:
    """The same axes of a rope ``(T, V, 2, 3)`` that the grippers do not twist, whatever the second one's z axis is."""
    return np.stack(_carried(curve, poses)[:2], axis=2)


def closing_angles(curve: FloatArray, poses: FloatArray) -> FloatArray:
    """Angles ``(T,)`` [rad] from the first gripper's z axis, carried along without twist, to that of the second one."""
    return _carried(curve, poses)[3]


def _carried(curve: FloatArray, poses: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Both axes without twist ``(T, V, 3)``, shares of the length ``(T, V)``, and what closes the frame at the end."""
    segments = np.diff(curve, axis=1)
    lengths = np.linalg.norm(segments, axis=2)
    along = segments / lengths[..., None]
    tangents = _unit(np.concatenate([along[:, :1], along[:, 1:] + along[:, :-1], along[:, -1:]], axis=1))
    up = np.array([0.0, 0.0, 1.0])
    first, last = (rotate(poses[:, g, 3:], np.broadcast_to(up, (len(poses), 3))) for g in (0, 1))
    # Carrying keeps angles, so those add up by which any axis at a vertex, carried on, is off from the one at the next.
    any_axis = _across(np.eye(3)[np.abs(tangents).argmin(axis=2)], tangents)
    other = np.cross(tangents, any_axis)
    sums = tangents[:, :-1] + tangents[:, 1:]
    steep = 1.0 / np.maximum(1.0 + dot(tangents[:, :-1], tangents[:, 1:]), 1e-9)
    moved = any_axis[:, :-1] - (dot(any_axis[:, :-1], tangents[:, 1:]) * steep)[..., None] * sums
    moved = np.concatenate([first[:, None], moved], axis=1)
    turns = np.cumsum(np.arctan2(dot(moved, other), dot(moved, any_axis)), axis=1)[..., None]
    carried = np.cos(turns) * any_axis + np.sin(turns) * other
    beside = np.cross(tangents, carried)
    wanted = _across(last, tangents[:, -1])
    angle = np.arctan2(np.sum(wanted * beside[:, -1], axis=1), np.sum(wanted * carried[:, -1], axis=1))
    so_far = np.concatenate([np.zeros((len(curve), 1)), np.cumsum(lengths, axis=1)], axis=1)
    return carried, beside, so_far / so_far[:, -1:], angle


def curves(points: FloatArray, fine: int = 6) -> tuple[FloatArray, IntArray]:
    """Natural cubic splines through ``points (T, M, 3)``, ``fine`` steps from one to the next, over the mean chords.

    Returns:
        The curves ``(T, (M - 1) fine + 1, 3)`` and the numbers ``(M,)`` of their vertices that are the points.
    """
    count = points.shape[1]
    chords = np.linalg.norm(np.diff(points, axis=1), axis=2).mean(axis=0)
    slopes = np.diff(points, axis=1) / chords[:, None]
    matrix, right = np.eye(count), np.zeros(points.shape)
    for k in range(1, count - 1):  # second derivatives: the slopes on both sides of every inner point agree
        matrix[k, k - 1 : k + 2] = chords[k - 1], 2 * (chords[k - 1] + chords[k]), chords[k]
        right[:, k] = 6 * (slopes[:, k] - slopes[:, k - 1])
    bends = np.einsum("kl,tlx->tkx", np.linalg.inv(matrix), right)
    u = (np.arange(fine) / fine)[:, None]
    parts = []
    for k, h in enumerate(chords):
        ends = [v[:, None] for v in (points[:, k], points[:, k + 1], bends[:, k], bends[:, k + 1])]
        line = (1 - u) * ends[0] + u * ends[1]
        parts.append(line + h**2 / 6 * (((1 - u) ** 3 - (1 - u)) * ends[2] + (u**3 - u) * ends[3]))
    return np.concatenate([*parts, points[:, -1:]], axis=1), fine * np.arange(count, dtype=np.int64)


def _across(vectors: FloatArray, tangents: FloatArray) -> FloatArray:
    return _unit(vectors - dot(vectors, tangents)[..., None] * tangents)


def _unit(vectors: FloatArray) -> FloatArray:
    return np.asarray(vectors / np.maximum(np.sqrt(dot(vectors, vectors)), 1e-300)[..., None])
