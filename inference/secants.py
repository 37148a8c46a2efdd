"""Least squares without derivatives: steps of a linear model through the points that were tried.

Rollouts of soft objects are not smooth: folds, contacts and slack threads put kinks into them, and derivatives by small
differences are those of one facet. A model through points as far apart as the next step is long sees the slope of the
valley instead, and needs one rollout a step rather than one a parameter. This is DFO-GN (Cartis and Roberts, A
derivative-free Gauss-Newton method, 2019), with boxes as trust regions, because parameters are bounded by one.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import lsq_linear

from ..core.arrays import FloatArray

#: White residuals ``(N,)`` at every row of ``(K, D)``; None where they cannot be had.
Many = Callable[[FloatArray], Sequence[FloatArray | None]]

#: Half the side of the box that the first model is trusted in, and of the largest.
RADIUS, LARGEST = 0.1, 0.25
#: A model is right where what it promised came true but for this share; it is good above and bad below these.
RIGHT, GOOD, BAD = 0.1, 0.7, 0.1
#: A fresh model that is wrong about less than this times what is enough is wrong by chance.
CHANCE = 10.0
#: So many steps in a row that come to nothing, and each promised less than this share of what is left beyond noise, end
#: a search: what they go after is the roughness of a model that is wrong by much more.
IN_VAIN, LITTLE = 3, 0.01
#: Points so many radii from the best are too far for the model; a worse one is kept if this share of it is new.
FAR, NEAR = 2.0, 1e-3
#: A parameter that changes less than this share of what another does is taken for one that does nothing.
FLAT = 1e-9


@dataclass(frozen=True, eq=False)
class Found:
    """Where a search came to.

    Args:
        unit: the best point ``(D,)``.
        white: white residuals there ``(N,)``.
        jacobian: their derivatives ``(N, D)``, by secants or by differences.
    """

    unit: FloatArray
    white: FloatArray
    jacobian: FloatArray

    @property
    def rss(self) -> float:
        """Residual sum of squares."""
        return float(self.white @ self.white)


def search(
    many: Many,
    start: Found,
    evaluations: int,
    *,
    enough: float,
    least: float,
    noise: float = 0.0,
    radius: float = RADIUS,
    known: bool = False,
) -> tuple[Found, int, bool]:
    """Least squares from ``start`` in the unit cube, how many steps it took, and if its model was right in the end.

    Args:
        many: residuals.
        start: its derivatives count only if ``known``; else D differences over ``radius`` are taken first.
        evaluations: at most, after those.
        enough: it ends where a model that was right promises less than this share of the residual sum of squares.
        least: half the side of the smallest box.
        noise: squares that it alone leaves.
        radius: half the side of the first.
        known: begin with the derivatives that are given.
    """
    model = _Model(many, start, radius, known)
    used, right, in_vain = 0, False, 0
    while used < evaluations and radius >= least:
        step, gain = model.step(radius)
        size = float(np.abs(step).max())
        if gain < enough * model.rss or size < least:
            if right:
                break
            if model.renew(radius):  # a model that promises nothing may be a poor one
                used += 1
            else:
                radius /= 4.0
            continue
        came_true = model.tried(step, radius) / gain
        used += 1
        right = abs(came_true - 1.0) < RIGHT
        in_vain = in_vain + 1 if came_true < BAD and gain < LITTLE * (model.rss - noise) else 0
        if in_vain == IN_VAIN:
            break
        if came_true >= GOOD:
            radius = min(max(2.0 * size, radius / 4.0), LARGEST)
        elif came_true >= BAD:
            radius = max(size, radius / 4.0)
        elif used < evaluations and model.renew(radius):
            used += 1
        elif gain < CHANCE * enough * model.rss:
            break
        else:
            radius = min(radius / 2.0, max(size, radius / 4.0))
    return model.found, used, right


class _Model:
    """The linear model through the best point and D others."""

    def __init__(self, many: Many, start: Found, radius: float, known: bool) -> None:
        self._many, self.unit, self.white = many, start.unit, start.white
        inside = np.where(start.unit + radius <= 1.0, radius, -radius)
        self.points = start.unit + np.diag(inside)
        if known:
            self.whites = start.white + (self.points - start.unit) @ start.jacobian.T
            return
        rows = list(many(self.points))
        for k in [k for k, row in enumerate(rows) if row is None]:  # the other side may be simulated, or nearer
            other = start.unit[k] - inside[k] / 4.0
            self.points[k, k] = other if 0.0 <= other <= 1.0 else start.unit[k] + inside[k] / 4.0
            rows[k] = many(self.points[k : k + 1])[0]
        self.whites = np.stack([self._or_flat(row) for row in rows])
        k = int(np.argmin(np.linalg.norm(self.whites, axis=1)))
        self._keep(k, self.points[k].copy(), self.whites[k].copy())

    @property
    def rss(self) -> float:
        return float(self.white @ self.white)

    @property
    def found(self) -> Found:
        slopes = self._coordinates() @ (self.whites - self.white)
        return Found(self.unit, self.white, np.asarray(slopes.T))

    def step(self, radius: float) -> tuple[FloatArray, float]:
        """See :func:`linear_step`."""
        return linear_step(self.found, radius)

    def tried(self, step: FloatArray, radius: float) -> float:
        """Simulate there, keep it if it is better or tells more than a point that is kept, and return what it gains."""
        new = self.unit + step
        row = self._many(new[None])[0]
        if row is None:
            return -np.inf
        gain = self.rss - float(row @ row)
        center = new if gain > 0.0 else self.unit
        share = np.abs(self._coordinates().T @ step)  # of each difference in the step
        far = np.maximum(1.0, (np.abs(self.points - center).max(axis=1) / radius) ** 2)
        k = int(np.argmax(share * far))
        if gain > 0.0 or share[k] > NEAR:
            self._keep(k, new, row)
        return gain

    def renew(self, radius: float) -> bool:
        """Put a point within the box in place of the farthest; False if none is far."""
        away = np.abs(self.points - self.unit).max(axis=1)
        k = int(np.argmax(away))
        if away[k] <= FAR * radius:
            return False
        gradient = self._coordinates()[:, k]
        low, high = np.maximum(self.unit - radius, 0.0), np.minimum(self.unit + radius, 1.0)
        corners = np.where(gradient > 0, high, low), np.where(gradient > 0, low, high)
        new = max(corners, key=lambda c: abs(float(gradient @ (c - self.unit))))
        self._keep(k, new, self._or_flat(self._many(new[None])[0]))
        return True

    def _coordinates(self) -> FloatArray:
        """What makes a step a sum of differences to the best point ``(D, D)``; none across a line of them."""
        return np.asarray(np.linalg.pinv(self.points - self.unit))

    def _or_flat(self, row: FloatArray | None) -> FloatArray:
        """What is not known is taken for flat."""
        return self.white if row is None else row

    def _keep(self, k: int, unit: FloatArray, white: FloatArray) -> None:
        """In place of another point; the better of it and the best is the best."""
        if float(white @ white) < self.rss:
            self.unit, unit = unit, self.unit
            self.white, white = white, self.white
        self.points[k], self.whites[k] = unit, white


def linear_step(at: Found, radius: float) -> tuple[FloatArray, float]:
    """Where a linear model leaves least within the box and the cube ``(D,)``, from there, and how much it promises."""
    sizes = np.linalg.norm(at.jacobian, axis=0)
    moves = sizes > FLAT * sizes.max()  # rounding is no reason to go anywhere
    step = np.zeros(len(at.unit))
    if moves.any():
        basis, triangle = np.linalg.qr(at.jacobian[:, moves])
        low, high = np.maximum(-radius, -at.unit)[moves], np.minimum(radius, 1.0 - at.unit)[moves]
        found = lsq_linear(triangle, -basis.T @ at.white, (low, high), method="bvls").x
        step[moves] = np.clip(found, low, high)
    there = at.white + at.jacobian @ step
    return step, at.rss - float(there @ there)
