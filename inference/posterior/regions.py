"""Credible regions: the smallest part of the prior's box that holds a given mass of the posterior."""

from dataclasses import dataclass

import numpy as np

from ...core.arrays import BoolArray, FloatArray
from ...core.errors import InputError
from ...core.estimator import DRAWS, Posterior


@dataclass(frozen=True, eq=False)
class CredibleRegion:
    """All points whose density is at least ``level``.

    The density is that on the unit cube, relative to the prior, so the region does not depend on the units of the
    parameters, nor on whether their logarithm is taken.

    Args:
        posterior: on the unit cube.
        mass: of the posterior that lies in the region.
        level: natural log density at its border.
        volume: share of the prior that lies in it.
    """

    posterior: Posterior
    mass: float
    level: float
    volume: float

    def contains(self, unit: FloatArray) -> BoolArray:
        """Which of the points ``(N, D)`` of the unit cube are inside, ``(N,)``."""
        return np.asarray(self.posterior.log_prob(unit) >= self.level)


def credible_region(posterior: Posterior, mass: float = 0.9) -> CredibleRegion:
    """The highest-density region of a mass, from draws (Hyndman 1996).

    Raises:
        InputError: a mass that is not between 0 and 1.
    """
    if not 0.0 < mass < 1.0:
        raise InputError(f"a credible region needs a mass between 0 and 1, but got {mass:g}")
    density = posterior.log_prob(posterior.sample(DRAWS, np.random.default_rng(0)))
    level = float(np.quantile(density, 1.0 - mass))
    # The volume is the mean of 1 / density over the draws inside, each of which stands for 1 / N of the mass.
    volume = float(np.exp(-density[density >= level]).sum() / len(density))
    return CredibleRegion(posterior, mass, level, min(volume, 1.0))


def credible_intervals(posterior: Posterior, mass: float = 0.9) -> FloatArray:
    """The central interval of each parameter, ``(D, 2)`` on the unit cube.

    Raises:
        InputError: a mass that is not between 0 and 1.
    """
    if not 0.0 < mass < 1.0:
        raise InputError(f"a credible interval needs a mass between 0 and 1, but got {mass:g}")
    return posterior.quantiles(np.array([0.5 - mass / 2, 0.5 + mass / 2])).T
