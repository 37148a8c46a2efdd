"""A table that is not level."""

from typing import ClassVar

import numpy as np

from ...core.arrays import FloatArray
from ...core.effect import Effect
from ...core.motion import multiply
from ...core.parameters import Parameter


class TableTilt(Effect):
    """Table, spool and all other obstacles tilted about the origin, in a world that is level.

    Simulated in the frame of the table, which for engines stays level: there gravity, the grippers and the
    object in them are turned back by the tilt, and where the object was is turned forth again. So it differs from
    :class:`~.gravity.GravityTilt`, where grippers and cameras are as askew as the table: here a hand that moves
    level presses harder where the table rises, by the tilt times the way. A rotation vector without its part
    about z. Wind and other nodal forces act in the frame of the table: 2 degrees off at most.
    """

    name: ClassVar[str] = "table-tilt"
    acts_on: ClassVar[str] = "contact"
    coefficients: ClassVar[tuple[Parameter, ...]] = (
        Parameter("about_x", "rad", -0.035, 0.035, description="tilt about x"),
        Parameter("about_y", "rad", -0.035, 0.035, description="tilt about y"),
    )
    symptom: ClassVar[str] = "creeps or presses to one side on its support, where the support of the model is level"

    def on_obstacles(self, turn: FloatArray) -> FloatArray:
        vector = np.array([self.values["about_x"], self.values["about_y"], 0.0])
        half = 0.5 * float(np.linalg.norm(vector))
        return multiply(np.concatenate([[np.cos(half)], 0.5 * np.sinc(half / np.pi) * vector]), turn)
