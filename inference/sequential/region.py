"""The region that holds a posterior, and the uniform density on it: what truncated proposals are made of."""

import numpy as np

from ...core.arrays import BoolArray, FloatArray
from ...core.estimator import Posterior

#: Mass of the posterior that is left outside its region.
TAIL = 1e-3
#: Draws of the posterior that find its region, and uniform points that measure its volume.
_DRAWS, _POINTS = 4000, 40_000
#: Part of its length by which the box of those draws is made longer at each end.
_MARGIN = 0.1
#: With fewer of the points inside than this, the box itself is the region.
_FEW = 100


class Region:
    """The uniform density on the highest-density region of a posterior (TSNPE, Deistler et al. 2022).

    The region is where the log density is at least what all but :data:`TAIL` of the posterior's draws have, within
    a box along their principal axes. Its volume is the box's times the share of uniform points of the box that lie
    in the region, so the density is known up to the error of that share (below one percent where a tenth lie in it).

    Args:
        posterior: whose region.
        rng: of the draws and points.
    """

    def __init__(self, posterior: Posterior, rng: np.random.Generator) -> None:
        self._posterior = posterior
        draws = posterior.sample(_DRAWS, rng)
        log_q = posterior.log_prob(draws)
        self._level = float(np.quantile(log_q, TAIL))
        held = draws[log_q >= self._level]
        self._center = held.mean(axis=0)
        _, self._axes = np.linalg.eigh(np.atleast_2d(np.cov(held.T)))
        along = (held - self._center) @ self._axes
        low, high = along.min(axis=0), along.max(axis=0)
        margin = _MARGIN * (high - low) + 1e-9
        self._low, self._length = low - margin, high - low + 2 * margin
        share = float(self._holds(self._in_box(_POINTS, rng)).mean())
        if share * _POINTS < _FEW:  # nothing but the cube bounds the box then
            self._level = -np.inf
            share = float(self._holds(self._in_box(_POINTS, rng)).mean())
        self.volume = float(share * np.prod(self._length))

    def sample(self, count: int, rng: np.random.Generator) -> FloatArray:
        """``(count, D)`` points, uniform on the region."""
        parts: list[FloatArray] = []
        while sum(map(len, parts)) < count:
            points = self._in_box(max(1000, 4 * count), rng)
            parts.append(points[self._holds(points)])
        return np.concatenate(parts)[:count]

    def log_prob(self, unit: FloatArray) -> FloatArray:
        """Log density ``(N,)``; ``-inf`` outside the region."""
        along = (unit - self._center) @ self._axes - self._low
        boxed = ((along >= 0) & (along <= self._length)).all(axis=1)
        return np.asarray(np.where(boxed & self._holds(unit), -np.log(self.volume), -np.inf))

    def _in_box(self, count: int, rng: np.random.Generator) -> FloatArray:
        along = self._low + self._length * rng.random((count, len(self._length)))
        return np.asarray(self._center + along @ self._axes.T)

    def _holds(self, unit: FloatArray) -> BoolArray:
        inside = ((unit >= 0) & (unit <= 1)).all(axis=1)
        out = np.zeros(len(unit), bool)
        if inside.any():
            out[inside] = self._posterior.log_prob(unit[inside]) >= self._level
        return out
