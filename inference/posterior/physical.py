"""A posterior in the units of its parameters."""

import numpy as np

from ...core.arrays import FloatArray
from ...core.errors import InputError
from ...core.estimator import DRAWS, Posterior
from ...core.parameters import ParameterSpace


class PhysicalPosterior:
    """What a posterior on the unit cube says of a parameter space; values are vectors ``(N, D)`` [units].

    Nothing lies outside the bounds of the prior, to the last bit: rounding in a logarithm and back is cut off.

    Args:
        posterior: on the unit cube.
        space: whose cube that is.

    Raises:
        InputError: they have not the same number of parameters.
    """

    def __init__(self, posterior: Posterior, space: ParameterSpace) -> None:
        if posterior.dim != len(space):
            raise InputError(f"the posterior has {posterior.dim} parameters, but the space has {len(space)}")
        self.unit, self.space = posterior, space
        self._low = np.array([p.low for p in space])
        self._high = np.array([p.high for p in space])

    def values(self, unit: FloatArray) -> FloatArray:
        """Points ``(..., D)`` of the cube as values [units]."""
        return np.asarray(np.clip(self.space.from_unit(unit), self._low, self._high))

    def sample(self, count: int, rng: np.random.Generator) -> FloatArray:
        """``(count, D)`` draws [units], all within the bounds."""
        return self.values(self.unit.sample(count, rng))

    def log_prob(self, values: FloatArray) -> FloatArray:
        """Natural log density ``(N,)`` per product of units; -inf outside the bounds."""
        v = np.asarray(values, float)
        inside = ((v >= self._low) & (v <= self._high)).all(axis=1)
        unit = np.clip(self.space.to_unit(v), 0.0, 1.0)
        density = self.unit.log_prob(unit) + np.log(self.slope(np.clip(v, self._low, self._high))).sum(axis=1)
        return np.asarray(np.where(inside, density, -np.inf))

    def slope(self, values: FloatArray) -> FloatArray:
        """How fast the coordinate of the cube grows with each value, ``(..., D)`` [1/units]."""
        log = np.array([p.scale == "log" for p in self.space])
        span = np.log(np.where(log, self._high, np.e) / np.where(log, self._low, 1.0))
        return np.asarray(np.where(log, 1.0 / (np.where(log, values, 1.0) * span), 1.0 / (self._high - self._low)))

    def quantiles(self, levels: FloatArray) -> FloatArray:
        """Quantiles ``(Q, D)`` of each parameter [units] at levels ``(Q,)``."""
        return self.values(self.unit.quantiles(levels))

    def marginal(self, name: str, points: int = 201) -> tuple[FloatArray, FloatArray]:
        """Values ``(M,)`` [unit] of one parameter over its prior's range, and its density there [1/unit].

        Raises:
            InputError: there is no such parameter.
        """
        if name not in self.space.names:
            raise InputError(f"there is no parameter {name!r}; there are {', '.join(self.space.names)}")
        index = self.space.names.index(name)
        at = np.linspace(0.0, 1.0, points)
        values = self.values(np.repeat(at[:, None], len(self.space), axis=1))
        return values[:, index], self.unit.marginal(index, at) * self.slope(values)[:, index]

    def mean(self) -> FloatArray:
        """``(D,)`` expectation [units], over a fixed set of draws."""
        return np.asarray(self._draws().mean(axis=0))

    def std(self) -> FloatArray:
        """``(D,)`` standard deviation [units], over a fixed set of draws."""
        return np.asarray(self._draws().std(axis=0))

    def covariance(self) -> FloatArray:
        """``(D, D)`` covariance [products of units], over a fixed set of draws."""
        return np.atleast_2d(np.cov(self._draws(), rowvar=False, ddof=0))

    def _draws(self) -> FloatArray:
        return self.sample(DRAWS, np.random.default_rng(0))
