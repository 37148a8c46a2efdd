"""Least squares from a good start: the best parameters and how far the data let them move."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from ..core.arrays import FloatArray
from ..core.parameters import ParameterSpace
from ..core.rollout import Trajectory
from ..core.study import SimulationPool, Task
from .noise import Noise
from .residuals import Offsets, failed, residual

#: Finite-difference step in the unit cube: small against the prior, large against rounding in a rollout.
STEP = 2e-3


@dataclass(frozen=True, eq=False)
class Polished:
    """The best fit found.

    Args:
        unit: parameters in the unit cube ``(D,)``.
        covariance: of ``unit``, from the curvature at the best fit (Laplace), ``(D, D)``.
        jacobian: of the white residuals ``(N, D)``.
        white: white residuals at the best fit ``(N,)``.
        information: of one residual, below 1 where noise is correlated in time.
    """

    unit: FloatArray
    covariance: FloatArray
    jacobian: FloatArray
    white: FloatArray
    information: float

    @property
    def count(self) -> float:
        """Independent numbers that the residuals are worth: what :attr:`rss` is when only noise is left."""
        return self.information * len(self.white)

    @property
    def rss(self) -> float:
        """Residual sum of squares, in units of the noise variance."""
        return float(self.white @ self.white)


class Objective:
    """White residuals of all given recordings as a function of a point in the unit cube.

    Args:
        pool: where rollouts run.
        space: parameters, in the order of the unit vector.
        recordings: names.
        fixed: values of other parameters.
    """

    def __init__(
        self,
        pool: SimulationPool,
        space: ParameterSpace,
        recordings: Sequence[str],
        noise: Noise,
        offsets: Offsets,
        fixed: dict[str, float] | None = None,
    ) -> None:
        self.pool, self.space, self.recordings = pool, space, list(recordings)
        self.noise, self.offsets, self.fixed = noise, offsets, dict(fixed or {})
        self._last: tuple[FloatArray, FloatArray] | None = None

    def many(self, units: FloatArray) -> list[FloatArray]:
        """White residuals ``(N,)`` at every row of ``units (K, D)``, simulated side by side."""
        tasks = [
            Task({**self.fixed, **self.space.as_dict(self.space.from_unit(u))}, r)
            for u in units
            for r in self.recordings
        ]
        outcomes = iter(self.pool.map(tasks))
        rows = []
        for _ in units:
            parts = []
            for name in self.recordings:
                recording, outcome = self.pool.problem.recordings[name], next(outcomes)
                parts.append(
                    residual(recording, outcome.series, self.noise, self.offsets).white
                    if isinstance(outcome, Trajectory)
                    else failed(recording, self.offsets)
                )
            rows.append(np.concatenate(parts))
        return rows

    def one(self, unit: FloatArray) -> FloatArray:
        if self._last is None or not np.array_equal(self._last[0], unit):
            self._last = (unit.copy(), self.many(unit[None])[0])
        return self._last[1]

    def jacobian(self, unit: FloatArray) -> FloatArray:
        """Derivative of the white residuals ``(N, D)`` by one-sided differences that stay in the cube."""
        steps = np.where(unit + STEP <= 1.0, STEP, -STEP)
        base = self.one(unit)
        rows = self.many(unit + np.diag(steps))
        return np.stack([(row - base) / step for row, step in zip(rows, steps, strict=True)], axis=1)


def polish(objective: Objective, start: FloatArray, evaluations: int = 12) -> Polished:
    """Bounded least squares (trust region reflective) from ``start`` in the unit cube."""
    result = least_squares(
        objective.one,
        np.clip(start, 1e-4, 1 - 1e-4),
        jac=objective.jacobian,
        bounds=(0.0, 1.0),
        x_scale=0.1,
        ftol=1e-4,
        xtol=1e-4,
        max_nfev=evaluations,
    )
    jacobian, white = np.asarray(result.jac, float), np.asarray(result.fun, float)
    # The uniform prior of a unit interval has variance 1/12: it bounds what the data leave open.
    information = jacobian.T @ jacobian + 12.0 * np.eye(len(start))
    return Polished(
        np.asarray(result.x, float), np.linalg.inv(information), jacobian, white, objective.noise.information
    )
