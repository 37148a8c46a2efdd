"""A table that is not level."""

from typing import ClassVar

import numpy as np

from ...core.arrays import FloatArray
from ...core.effect import Effect
from ...core.motion import Motion
from ...core.parameters import Parameter
from .observation import rotation_matrix


class TableTilt(Effect):
    """Table, spool and all other obstacles tilted about the origin, in a world that is level.

    Simulated in the frame of the table, which for engines stays level: there gravity, the grippers and the
    object in them are turned back by the tilt, and what is seen is turned forth again. So it differs from
    :class:`~.gravity.GravityTilt`, where grippers and cameras are as askew as the table: here a hand that moves
    level presses harder where the table rises, by the tilt times the way. A rotation vector without its part
    about z. Wind and other nodal forces act in the frame of the table, and so do effects on gravity that come after it
    in a list and effects on what is seen that come before it: 2 degrees off at most.
    """

    name: ClassVar[str] = "table-tilt"
    acts_on: ClassVar[str] = "contact"
    coefficients: ClassVar[tuple[Parameter, ...]] = (
        Parameter("about_x", "rad", -0.035, 0.035, description="tilt about x"),
        Parameter("about_y", "rad", -0.035, 0.035, description="tilt about y"),
    )
    symptom: ClassVar[str] = "creeps or presses to one side on its support, where the support of the model is level"

    def _tilt(self) -> FloatArray:
        return np.array([self.values["about_x"], self.values["about_y"], 0.0])

    def on_gravity(self, gravity: FloatArray) -> FloatArray:
        return np.asarray(rotation_matrix(-self._tilt()) @ gravity)

    def on_command(self, motion: Motion, time_step: float) -> Motion:
        poses = motion.poses.copy()
        poses[..., :3] = poses[..., :3] @ rotation_matrix(-self._tilt()).T
        poses[..., 3:] = _turned(-self._tilt(), poses[..., 3:])
        return Motion(motion.times, poses)

    def on_points(self, points: FloatArray) -> FloatArray:
        return np.asarray(points @ rotation_matrix(self._tilt()).T)


def _turned(vector: FloatArray, quaternions: FloatArray) -> FloatArray:
    """The turns ``(..., 4)`` w x y z followed by a turn about ``vector (3,)`` by its length [rad]."""
    half = 0.5 * float(np.linalg.norm(vector))
    w, u = np.cos(half), 0.5 * np.sinc(half / np.pi) * vector
    scalar, axis = quaternions[..., :1], quaternions[..., 1:]
    turned = w * axis + scalar * u + np.cross(u, axis)
    return np.concatenate([w * scalar - np.sum(u * axis, axis=-1, keepdims=True), turned], axis=-1)
