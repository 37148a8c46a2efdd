"""Grippers that do not do at once what they are told."""

from typing import ClassVar

import numpy as np

from ...core.effect import Effect
from ...core.motion import Motion
from ...core.parameters import Parameter


class ActuatorLag(Effect):
    """First-order lag of the grippers: tau dy/dt = u - y, starting from rest at the first pose.

    Integrated exactly for a command that is linear between samples.
    """

    name: ClassVar[str] = "actuator-lag"
    acts_on: ClassVar[str] = "command"
    coefficients: ClassVar[tuple[Parameter, ...]] = (Parameter("time_constant", "s", 0.0, 0.1, description="tau"),)
    symptom: ClassVar[str] = "follows the gripper command at once in the model, where the real gripper comes late"

    def on_command(self, motion: Motion, time_step: float) -> Motion:
        if len(motion.times) < 2:
            return motion
        tau = self.values["time_constant"]
        tail = 10.0 * tau  # the lagging gripper still moves after the last command
        times = np.arange(motion.times[0], motion.times[-1] + tail + time_step, time_step)
        u = motion.at(times)
        decay = np.exp(-time_step / tau)
        ramp = 1.0 - tau / time_step * (1.0 - decay)
        y = np.empty_like(u)
        y[0] = u[0]
        for k in range(1, len(times)):
            y[k] = decay * y[k - 1] + (1.0 - decay) * u[k - 1] + ramp * (u[k] - u[k - 1])
        y[..., 3:] /= np.linalg.norm(y[..., 3:], axis=-1, keepdims=True)
        return Motion(times, y)
