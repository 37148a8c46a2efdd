"""Residuals of a fitted model on the recordings that it was not fitted to."""

from dataclasses import dataclass

import numpy as np

from ...core.arrays import FloatArray
from ...core.parameters import ParameterSpace
from ...core.rollout import Trajectory
from ...core.study import Problem, SimulationPool, Task
from ..noise import Noise
from ..residuals import Offsets, Residual, residual


@dataclass(frozen=True, eq=False)
class HeldOut:
    """How a fitted model does on the held-out recordings.

    Args:
        errors: root mean square by recording [unit]; infinite where one cannot be simulated.
        white: residuals of all of them ``(N,)``, whitened by noise and numerics, their squares adding up as fewer,
            independent ones would; None where one has none.
        information: independent numbers that one residual is worth.
        dropped: how many residuals do not count.
    """

    errors: dict[str, float]
    white: FloatArray | None
    information: float
    dropped: int

    @property
    def mean_square(self) -> float:
        """Of what is whitened [noise variances]; NaN if nothing is held out, infinite if it cannot be simulated."""
        if not self.errors:
            return float("nan")
        if self.white is None:
            return float("inf")
        count = self.information * (len(self.white) - self.dropped)
        return float(self.white @ self.white) / max(count, 1.0)

    def shift(self, other: "HeldOut") -> float:
        """How far two models are from each other there, as a sum of squares [noise variances].

        It is what -2 log likelihood falls by in the mean if the other one is true. Infinite where one has no residuals.
        """
        if self.white is None or other.white is None:
            return float("inf")
        return float(np.sum((self.white - other.white) ** 2))

    def gain(self, other: "HeldOut") -> float:
        """By how much -2 log likelihood is less than of another model there; zero where one has no residuals."""
        if self.white is None or other.white is None:
            return 0.0
        return float(other.white @ other.white - self.white @ self.white)


def held_out_residuals(
    pool: SimulationPool, problem: Problem, space: ParameterSpace, unit: FloatArray, noise: Noise, offsets: Offsets
) -> dict[str, Residual | None]:
    """By held-out recording; None where it cannot be simulated.

    Args:
        pool: where rollouts run.
        problem: whose recordings.
        space, unit: parameters, and the point ``(D,)`` of their unit cube.
        noise, offsets: of the measurement.
    """
    values, names = space.as_dict(space.from_unit(unit)), problem.hold_out
    made = pool.map([Task(values, n) for n in names])
    return {
        name: residual(problem.recordings[name], o.series, noise, offsets) if isinstance(o, Trajectory) else None
        for name, o in zip(names, made, strict=True)
    }
