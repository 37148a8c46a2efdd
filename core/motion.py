"""Gripper motion over time: what a robot was told to do, or was measured doing."""

from dataclasses import dataclass

import numpy as np

from .arrays import FloatArray
from .errors import InputError
from .interpolation import interpolate

IDENTITY_POSE = np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0])


def rotate(quaternion: FloatArray, vectors: FloatArray) -> FloatArray:
    """Rotate ``vectors (..., 3)`` by unit quaternions w x y z ``(..., 4)``, broadcasting."""
    w, u = quaternion[..., :1], quaternion[..., 1:]
    t = 2.0 * np.cross(u, vectors)
    return np.asarray(vectors + w * t + np.cross(u, t))


def inverse(quaternion: FloatArray) -> FloatArray:
    """The inverse of unit quaternions w x y z ``(..., 4)``."""
    return np.asarray(quaternion * np.array([1.0, -1.0, -1.0, -1.0]))


def multiply(a: FloatArray, b: FloatArray) -> FloatArray:
    """The turn ``b`` followed by the turn ``a``, unit quaternions w x y z ``(..., 4)``, broadcasting."""
    v, u = a[..., :1], a[..., 1:]
    w, x = b[..., :1], b[..., 1:]
    scalar = v * w - np.sum(u * x, axis=-1, keepdims=True)
    return np.concatenate([scalar, v * x + w * u + np.cross(u, x)], axis=-1)


def turned(quaternion: FloatArray, poses: FloatArray) -> FloatArray:
    """``poses (..., 7)`` turned as a whole about the origin by ``quaternion (4,)``."""
    made = [rotate(quaternion, poses[..., :3]), multiply(quaternion, poses[..., 3:])]
    return np.concatenate(made, axis=-1)


def rolled(poses: FloatArray, axes: FloatArray, angles: FloatArray) -> FloatArray:
    """``poses (..., G, 7)`` of grippers that are each turned by ``angles (G,)`` [rad] about an axis fixed in it.

    The ``axes (G, 3)`` are unit vectors in the frames of the grippers.
    """
    half = 0.5 * angles[:, None]
    turns = np.concatenate([np.cos(half), np.sin(half) * axes], axis=1)
    return np.concatenate([poses[..., :3], multiply(poses[..., 3:], turns)], axis=-1)


def turns_about(axes: FloatArray, quaternions: FloatArray) -> FloatArray:
    """By how much what turns about moving axes has turned about them ``(T,)`` [rad] since the first time.

    Seen from a frame that is carried along with the axis from time to time by the shortest turn (Bishop 1975).

    Args:
        axes: unit vectors ``(T, 3)``, fixed in what turns.
        quaternions: of what turns, w x y z ``(T, 4)``.
    """
    first = np.cross(axes[0], np.eye(3)[np.argmin(np.abs(axes[0]))])
    fixed = rotate(multiply(quaternions, inverse(quaternions[0])), first / np.linalg.norm(first))
    before, after, u = axes[:-1], axes[1:], fixed[:-1]
    bend = np.sum(u * after, axis=1, keepdims=True) / np.maximum(1.0 + np.sum(before * after, axis=1), 1e-9)[:, None]
    carried = u - bend * (before + after)
    steps = np.arctan2(np.sum(np.cross(after, carried) * fixed[1:], axis=1), np.sum(carried * fixed[1:], axis=1))
    return np.concatenate([[0.0], np.cumsum(steps)])


def quaternion_of(m: FloatArray) -> FloatArray:
    """The unit quaternion w x y z of a rotation matrix ``(3, 3)``, with w not below zero."""
    # Bar-Itzhack (2000): the quaternion is the eigenvector of the largest eigenvalue of this symmetric matrix
    k = np.array(
        [
            [m[0, 0] + m[1, 1] + m[2, 2], m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]],
            [0.0, m[0, 0] - m[1, 1] - m[2, 2], m[0, 1] + m[1, 0], m[0, 2] + m[2, 0]],
            [0.0, 0.0, m[1, 1] - m[0, 0] - m[2, 2], m[1, 2] + m[2, 1]],
            [0.0, 0.0, 0.0, m[2, 2] - m[0, 0] - m[1, 1]],
        ]
    )
    quaternion = np.linalg.eigh(k, UPLO="U")[1][:, -1]
    return np.asarray(quaternion * np.where(quaternion[0] < 0, -1.0, 1.0))


@dataclass(frozen=True, eq=False)
class Motion:
    """Poses of G grippers at K times, held before the first and after the last.

    Args:
        times: ``(K,)`` [s], rising.
        poses: ``(K, G, 7)``: position x y z [m] and quaternion w x y z, all of them known.
    """

    times: FloatArray
    poses: FloatArray

    def __post_init__(self) -> None:
        if self.times.ndim != 1 or self.poses.shape[:1] != self.times.shape or self.poses.shape[2:] != (7,):
            raise InputError(
                f"a motion needs times (K,) and poses (K, G, 7), got {self.times.shape} and {self.poses.shape}"
            )
        known = np.isfinite(self.poses).all(axis=2) & np.isfinite(self.times)[:, None]
        if not known.all():
            k, g = (int(i) for i in np.argwhere(~known)[0])
            raise InputError(
                f"the pose of gripper {g} at time[{k}] = {self.times[k]:g} s is not a finite number; leave out the "
                "times at which a pose is not known"
            )
        if len(self.times) > 1 and not (np.diff(self.times) > 0).all():
            k = int(np.argmin(np.diff(self.times) > 0)) + 1
            raise InputError(
                f"time must rise, but time[{k}] = {self.times[k]:g} s follows time[{k - 1}] = {self.times[k - 1]:g} s"
            )

    @classmethod
    def from_positions(cls, times: FloatArray, positions: FloatArray) -> "Motion":
        """Grippers that never turn: ``positions (K, G, 3)`` [m]."""
        turn = np.broadcast_to(IDENTITY_POSE[3:], (*positions.shape[:2], 4))
        return cls(np.asarray(times, float), np.concatenate([positions, turn], axis=2))

    @classmethod
    def still(cls, grippers: int = 1) -> "Motion":
        return cls(np.zeros(1), np.tile(IDENTITY_POSE, (1, grippers, 1)))

    @property
    def grippers(self) -> int:
        return int(self.poses.shape[1])

    def at(self, times: FloatArray) -> FloatArray:
        """Poses ``(T, G, 7)`` at ``times (T,)`` [s]; positions linear, quaternions along the chord."""
        poses = self.poses.copy()
        # q and -q are the same turn: keep to one side, or the chord goes the long way round
        flips = np.sum(poses[1:, :, 3:] * poses[:-1, :, 3:], axis=-1) < 0
        poses[1:, :, 3:] *= np.cumprod(np.where(flips, -1.0, 1.0), axis=0)[..., None]
        out = interpolate(times, self.times, poses)
        out[..., 3:] /= np.linalg.norm(out[..., 3:], axis=-1, keepdims=True)
        return np.asarray(out)
