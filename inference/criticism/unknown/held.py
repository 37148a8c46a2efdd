"""Residuals of a model that is held to the recordings, with a law in place of the estimated force."""

import numpy as np

from ....core.arrays import FloatArray
from ....core.parameters import ParameterSpace
from ....core.rollout import Trajectory
from ....core.study import Task
from ...polish import Objective
from ...residuals import residual
from .estimate import ForceObjective
from .field import PULL


class HeldObjective(Objective):
    """White residuals as a function of parameters and the coefficients of a law, under the pull of the estimate.

    A model left to itself loses the recording wherever the guess is not good yet, and a least-squares search gets
    stuck there; held, its residuals answer nearly linearly.

    Args:
        force: the objective of the force, whose pull is used.
        space: parameters and coefficients, as ``law.NAME``.
    """

    def __init__(self, force: ForceObjective, space: ParameterSpace) -> None:
        u = force.unknowns
        super().__init__(force.pool, space, u.recordings, force.noise, force.offsets)
        self._pulls = [{f"{e}.{PULL}": p} for e, p in zip(u.effects, u.pulls, strict=True)]

    def many(self, units: FloatArray) -> list[FloatArray | None]:
        told = [self.space.as_dict(self.space.from_unit(u)) for u in units]
        tasks = [Task({**t, **p}, r) for t in told for r, p in zip(self.recordings, self._pulls, strict=True)]
        made = iter(self.pool.map(tasks))
        rows: list[FloatArray | None] = []
        for _ in units:
            pairs = [(self.pool.problem.recordings[name], next(made)) for name in self.recordings]
            white = [
                residual(r, m.series, self.noise, self.offsets).white for r, m in pairs if isinstance(m, Trajectory)
            ]
            rows.append(np.concatenate(white) if len(white) == len(pairs) else None)
        return rows
