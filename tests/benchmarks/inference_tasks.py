"""Simulators whose posteriors are known: tasks of sbibm (Lueckmann et al. 2021) as muslin and as sbi read them."""

import math
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from unittest import mock

import numpy as np
import torch
from sbi.utils import BoxUniform
from sbibm.tasks import get_task
from torch import Tensor
from torch.distributions import Distribution, MultivariateNormal

from muslin.core.arrays import FloatArray

AS_A_SET = " (as a set)"
#: In the order of the table. The last one gives slcp's four points as an unordered set.
ROWS = ("two_moons", "gaussian_mixture", "slcp", "gaussian_linear", "slcp_distractors", "slcp" + AS_A_SET)


@contextmanager
def _own_files_are_trusted() -> Iterator[None]:
    """sbibm keeps the distribution of slcp's distractors as a pickle, which torch refuses since 2.6."""
    with mock.patch("torch.load", partial(torch.load, weights_only=False)):
        yield


class KnownTask:
    """One row of the table: a prior, a simulator, observations and 10 000 draws from each of their posteriors.

    Parameters map to the unit cube linearly where the prior is uniform, and by its distribution function where it is
    normal. A vector of n numbers is a recording of one frame with n points on one axis, which correspond.

    Args:
        row: one of :data:`ROWS`.
    """

    def __init__(self, row: str) -> None:
        self.row = row
        self.correspondence = not row.endswith(AS_A_SET)
        self._task = get_task(row.removesuffix(AS_A_SET))
        params = self._task.get_prior_params()
        self._bounded = "low" in params
        if self._bounded:
            self._low, self._size = params["low"].double(), (params["high"] - params["low"]).double()
            self.prior: Distribution = BoxUniform(params["low"], params["high"])
        else:
            covariance = torch.linalg.inv(params["precision_matrix"])
            assert torch.equal(covariance, torch.diag(torch.diag(covariance))), "the map needs independent parameters"
            self._low, self._size = params["loc"].double(), torch.diag(covariance).double().sqrt()
            self.prior = MultivariateNormal(params["loc"], covariance)

    def simulate(self, count: int, seed: int) -> tuple[Tensor, Tensor]:
        """``(N, D)`` draws from the prior and their data ``(N, n)``; the same for the same seed."""
        torch.manual_seed(seed)
        theta = self._task.get_prior()(num_samples=count)
        with _own_files_are_trusted():
            return theta, self._task.get_simulator()(theta)

    def observation(self, number: int) -> Tensor:
        """``(1, n)`` observation 1 to 10."""
        return self._task.get_observation(number)

    def reference(self, number: int, count: int) -> Tensor:
        """``(count, D)`` of the shipped posterior draws, picked at random."""
        draws = self._task.get_reference_posterior_samples(number)
        return draws[torch.randperm(len(draws), generator=torch.Generator().manual_seed(number))[:count]]

    def to_unit(self, theta: Tensor) -> FloatArray:
        """Parameters ``(N, D)`` to the unit cube."""
        scaled = (theta.double() - self._low) / self._size
        unit = scaled if self._bounded else torch.special.ndtr(scaled)
        return np.asarray(unit.clamp(0.0, 1.0).numpy())

    def from_unit(self, unit: FloatArray) -> Tensor:
        """Back again, in single precision as sbibm has them."""
        u = torch.as_tensor(unit, dtype=torch.float64)
        scaled = u if self._bounded else torch.special.ndtri(u.clamp(1e-15, 1.0 - 1e-15))
        return (self._low + self._size * scaled).float()

    def recording(self, x: Tensor) -> FloatArray:
        """Data ``(N, n)`` as point series ``(N, 1, P, A)``: n points on a line, or n / 2 in the plane."""
        axes = 1 if self.correspondence else 2
        return np.asarray(x.double().numpy().reshape(len(x), 1, math.prod(x.shape[1:]) // axes, axes))
