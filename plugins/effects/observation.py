"""Cameras that see late, from another place, or turned."""

from typing import ClassVar

import numpy as np

from ...core.arrays import FloatArray
from ...core.effect import Effect
from ...core.parameters import Parameter


class CameraLatency(Effect):
    """Pictures stamped late: what is said to be seen at t is where the object was at t - latency.

    Typical of cameras and motion capture over a network, 10 to 80 ms. Before the first observation the object
    is taken to have been at rest; one that starts as it was seen in motion starts that much earlier. Grippers stay on
    time, which tells it from :class:`~.command.ActuatorLag` only in where the grippers themselves are seen.
    """

    name: ClassVar[str] = "camera-latency"
    acts_on: ClassVar[str] = "observation"
    coefficients: ClassVar[tuple[Parameter, ...]] = (Parameter("latency", "s", 0.0, 0.1, description="of the camera"),)
    symptom: ClassVar[str] = "is seen late by one and the same time throughout, the held part and the free part alike"

    def on_clock(self, times: FloatArray) -> FloatArray:
        return np.asarray(times - self.values["latency"])


class CameraOffset(Effect):
    """A camera that sees everything displaced by a constant: its place was calibrated wrong."""

    name: ClassVar[str] = "camera-offset"
    acts_on: ClassVar[str] = "observation"
    coefficients: ClassVar[tuple[Parameter, ...]] = tuple(
        Parameter(axis, "m", -0.02, 0.02, description=f"seen too far along {axis}") for axis in "xyz"
    )
    symptom: ClassVar[str] = "is seen displaced by the same distance everywhere and at all times"

    def on_points(self, points: FloatArray) -> FloatArray:
        return np.asarray(points + self._offset())

    def off_points(self, points: FloatArray, first: FloatArray) -> FloatArray:
        return np.asarray(points - self._offset())

    def _offset(self) -> FloatArray:
        return np.array([self.values[axis] for axis in "xyz"])


class CameraRotation(Effect):
    """A camera that sees everything turned by a constant: its direction was calibrated wrong.

    A rotation vector, so that the order of the axes plays no part (Rodrigues 1840). The turn is about the
    centroid of the points of the first frame: a turn about another point is this one with a
    :class:`CameraOffset`, and this choice keeps the two least alike.
    """

    name: ClassVar[str] = "camera-rotation"
    acts_on: ClassVar[str] = "observation"
    coefficients: ClassVar[tuple[Parameter, ...]] = tuple(
        Parameter(f"about_{axis}", "rad", -0.02, 0.02, description=f"seen turned about {axis}") for axis in "xyz"
    )
    symptom: ClassVar[str] = "is seen turned as a whole about its place in the first frame, at all times alike"

    def on_points(self, points: FloatArray) -> FloatArray:
        pivot = points[0].mean(axis=0)
        return np.asarray((points - pivot) @ self._turn().T + pivot)

    def off_points(self, points: FloatArray, first: FloatArray) -> FloatArray:
        pivot = first.mean(axis=0)  # it stays where it is
        return np.asarray((points - pivot) @ self._turn() + pivot)

    def _turn(self) -> FloatArray:
        return rotation_matrix(np.array([self.values[f"about_{axis}"] for axis in "xyz"]))


def rotation_matrix(vector: FloatArray) -> FloatArray:
    """The matrix ``(3, 3)`` that turns by ``|vector|`` [rad] about ``vector (3,)`` (Rodrigues' formula)."""
    angle = float(np.linalg.norm(vector))
    x, y, z = vector
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    # sin(a)/a and (1 - cos a)/a^2, exact at zero
    return np.asarray(
        np.eye(3) + np.sinc(angle / np.pi) * cross + 0.5 * np.sinc(angle / 2 / np.pi) ** 2 * cross @ cross
    )
