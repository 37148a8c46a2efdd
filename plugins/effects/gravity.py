"""Gravity that does not point down the z axis of the measurement, or is not as strong as it is taken to be."""

from typing import ClassVar

import numpy as np

from ...core.arrays import FloatArray
from ...core.effect import Effect
from ...core.parameters import Parameter


class GravityTilt(Effect):
    """Gravity turned about the horizontal axes: the frame of the measurement is not level.

    Turned first about x, then about y (rotation matrices R_y R_x).
    """

    name: ClassVar[str] = "gravity-tilt"
    acts_on: ClassVar[str] = "gravity"
    coefficients: ClassVar[tuple[Parameter, ...]] = (
        Parameter("about_x", "rad", -0.05, 0.05, description="turn about x"),
        Parameter("about_y", "rad", -0.05, 0.05, description="turn about y"),
    )
    symptom: ClassVar[str] = "hangs straight down in the model where the real one leans, moving or not"

    def on_gravity(self, gravity: FloatArray) -> FloatArray:
        a, b = self.values["about_x"], self.values["about_y"]
        turn_x = np.array([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]])
        turn_y = np.array([[np.cos(b), 0, np.sin(b)], [0, 1, 0], [-np.sin(b), 0, np.cos(b)]])
        return np.asarray(turn_y @ turn_x @ gravity)


class GravityStrength(Effect):
    """Gravity that is stronger than the standard one by ``excess``, and points where it did.

    So seems gravity where lengths or times were measured by another scale: if all lengths read a share too long, or
    the clock runs half that share too slow, what falls is faster by that share. Gravity itself differs by 0.5 % on
    Earth.
    """

    name: ClassVar[str] = "gravity-strength"
    acts_on: ClassVar[str] = "gravity"
    #: Stiffness or drag can stand in for it on most objects; what is known to ten digits needs no guess.
    candidate: ClassVar[bool] = False
    coefficients: ClassVar[tuple[Parameter, ...]] = (
        Parameter("excess", "m/s2", -2.0, 2.0, description="beyond standard gravity, 9.80665 m/s2"),
    )
    symptom: ClassVar[str] = "falls and swings at another pace in the model, whatever it is made of"

    def on_gravity(self, gravity: FloatArray) -> FloatArray:
        strength = float(np.linalg.norm(gravity))
        return np.asarray(gravity * (1.0 + self.values["excess"] / strength)) if strength else gravity
