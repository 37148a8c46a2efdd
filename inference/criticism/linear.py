"""A first look at a candidate: what a linear model of the residuals promises, for one rollout a coefficient."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import lsq_linear

from ...core.arrays import BoolArray, FloatArray
from ...core.parameters import ParameterSpace
from ..polish import Objective, Polished

#: How far a coefficient is moved from zero [of its prior range]: far enough that effects with a threshold show.
STEP = 0.1
#: A coefficient that does nothing then is moved this far, or to the farther end of its range.
FAR_STEP = 0.9
#: Where none does anything without the others (water, by how much there is and how far it reaches), all are moved so
#: far.
JOINT_STEP = 0.5
#: No solution is nearer to a face of the unit cube.
_EDGE = 0.01


@dataclass(frozen=True, eq=False)
class Look:
    """One candidate at the plain fit.

    Args:
        name: of the effect.
        space: parameters and coefficients.
        start: the plain fit with every coefficient zero ``(D,)``.
        white: residuals there ``(N,)``.
        jacobian: of them ``(N, D)``.
        at: where the linear model of the residuals has its least square inside the cube ``(D,)``.
        rss: that square [noise variances].
        step: how far the coefficient that was moved most was moved.
        reach: how much the largest response to that is, in units of the misfit.
    """

    name: str
    space: ParameterSpace
    start: FloatArray
    white: FloatArray
    jacobian: FloatArray
    at: FloatArray
    rss: float
    step: float
    reach: float

    def along(self, size: float) -> FloatArray:
        """The point ``(D,)`` whose largest coefficient is ``size`` of its range, in the direction of :attr:`at`."""
        way = (self.at - self.start)[self.base :]
        if not way.any():
            way = np.where(self.start[self.base :] > 0.5, -1.0, 1.0)
        point = self.start.copy()
        point[self.base :] += size * way / np.abs(way).max()
        return np.asarray(np.clip(point, 0.0, 1.0))

    @property
    def responds(self) -> bool:
        """Does anything at all change? A lag of grippers that never move, say, cannot be seen."""
        return bool(self.jacobian[:, self.base :].any())

    @property
    def base(self) -> int:
        """Number of parameters that are not coefficients of this effect."""
        return sum(not p.name.startswith(f"{self.name}.") for p in self.space)

    def on(self, rows: BoolArray) -> "Look":
        """The same of some of the residuals."""
        white, jacobian = self.white[rows], self.jacobian[rows]
        at, rss = least_square(self.start, white, jacobian)
        return replace(self, white=white, jacobian=jacobian, at=at, rss=rss)

    def as_fit(self, plain: Polished, unit: FloatArray, white: FloatArray) -> Polished:
        """A point ``unit (D,)`` with residuals ``white (N,)`` as a fit, with the curvature of this look."""
        information = self.jacobian.T @ self.jacobian + 12.0 * np.eye(len(unit))
        return Polished(unit, white, self.jacobian, np.asarray(np.linalg.inv(information), float), plain.count)


def look_at(name: str, objective: Objective, plain: Polished) -> Look:
    """Move every coefficient of ``name`` a little, the parameters staying at the plain fit; all if that does nothing.

    Args:
        name: of the effect.
        objective: of the model with the effect.
        plain: fit of the model without.
    """
    space, base = objective.space, len(plain.unit)
    zero = np.array([(0.0 - p.low) / (p.high - p.low) for p in list(space)[base:]])
    start = np.concatenate([plain.unit, zero])
    columns, steps = np.zeros((len(plain.white), len(zero))), np.zeros(len(zero))
    for size in (STEP, FAR_STEP):
        idle = np.flatnonzero(~columns.any(axis=0))
        if not len(idle):
            break
        up, down = np.minimum(size, 1.0 - zero[idle]), np.minimum(size, zero[idle])
        steps[idle] = np.where(up >= down, up, -down)
        moved = np.repeat(start[None], len(idle), axis=0)
        moved[np.arange(len(idle)), base + idle] += steps[idle]
        for k, row in zip(idle, objective.many(moved), strict=True):
            if row is not None:
                columns[:, k] = (row - plain.white) / steps[k]
    responses = columns * steps
    if not columns.any() and len(zero) > 1:
        steps = np.where(1.0 - zero >= zero, JOINT_STEP, -JOINT_STEP)
        row = objective.many(np.concatenate([plain.unit, zero + steps])[None])[0]
        if row is not None:
            responses = (row - plain.white)[:, None]
            columns = responses / (len(zero) * steps)  # each its part, so that all together give what was seen
    jacobian = np.hstack([plain.jacobian, columns])
    at, rss = least_square(start, plain.white, jacobian)
    reach = float(np.max(np.linalg.norm(responses, axis=0)) / np.sqrt(plain.rss))
    return Look(name, space, start, plain.white, jacobian, at, rss, float(np.abs(steps).max()), reach)


def least_square(unit: FloatArray, white: FloatArray, jacobian: FloatArray) -> tuple[FloatArray, float]:
    """Where ``|white + jacobian (x - unit)|^2`` is least inside the unit cube ``(D,)``, and that square."""
    q, r = np.linalg.qr(jacobian)
    along = q.T @ white
    across = float(white @ white - along @ along)
    # the uniform prior of a unit interval, where the data say nothing
    ridge = np.sqrt(12.0) * np.eye(len(unit))
    low, high = np.minimum(_EDGE, unit) - unit, np.maximum(1.0 - _EDGE, unit) - unit
    solved = lsq_linear(np.vstack([r, ridge]), np.concatenate([-along, np.zeros(len(unit))]), (low - 1e-9, high + 1e-9))
    left = along + r @ solved.x
    return np.clip(unit + solved.x, 0.0, 1.0), float(across + left @ left)
