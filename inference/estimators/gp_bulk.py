"""GP-bulk: Gaussian process regression of the parameters on one batch of draws."""

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import torch
from torch import Tensor

from ...core.arrays import FloatArray
from ...core.errors import BrokenPluginError
from ..density.draws import Draws
from ..embedding.components import PrincipalComponents
from ..embedding.rows import TrajectoryRows
from ..posterior.cube_gaussian import cube_gaussian
from ..posterior.mixture import MixturePosterior
from .base import Answer, TrainedEstimator


@dataclass(frozen=True)
class Settings:
    """Options of ``gp-bulk``.

    Args:
        principal: principal components of the trajectory that the process sees.
        tuning_draws: draws on which the hyper-parameters are found, at most.
        draws: draws the process is conditioned on, at most; its cost grows with their cube.
        steps: of L-BFGS on the hyper-parameters, at most.
        calibrated: whether the width is set on leave-one-out errors, and their correlations are used.
        sort: whether frames of recordings without correspondence are put in lexicographic order before their points
            are read by place.
        threads: torch threads during training.
    """

    principal: int = 20
    tuning_draws: int = 400
    draws: int = 2000
    steps: int = 60
    calibrated: bool = True
    sort: bool = True
    threads: int = 1


class GPBulk(TrainedEstimator):
    """Gaussian process regression, one process a parameter; its predictive distribution is the posterior.

    The paper's GP-bulk-1.5k: GPyTorch and BoTorch with automatic hyper-parameters (BoTorch's ``SingleTaskGP``: RBF
    kernel with a length a component, dimension-scaled priors; maximum a posteriori by L-BFGS), on draws from the
    prior in one batch. Thousands of coordinates are more than lengths can be found for, so the process sees the
    trajectory's leading principal components, scaled to the unit cube.

    Exact inference costs the cube of the draws, so the hyper-parameters are found on ``tuning_draws`` of them, picked
    at random in proportion to their weights, and the process is then conditioned on at most ``draws``, picked
    likewise. A draw of weight w enters with noise variance ``noise / w``. The Gaussian is cut at the prior's bounds
    (:func:`~..posterior.cube_gaussian.cube_gaussian`).

    ``preset="paper"``: the predictive distribution as it is, parameters independent. The default scales it to the
    leave-one-out errors and gives it their correlations.

    Order and number of points, ``correspondence`` and ``sort`` are as of :class:`~.bayessim_mdnn.BayesSimMDNN`.

    Args:
        correspondence, preset, options: as of :class:`~.base.TrainedEstimator`, with the fields of :class:`Settings`.

    Raises:
        BrokenPluginError: when fitting without GPyTorch and BoTorch (``pip install 'muslin[gp]'``).
    """

    name: ClassVar[str] = "gp-bulk"
    presets: ClassVar[Mapping[str, Any]] = {"default": Settings(), "paper": Settings(calibrated=False, sort=False)}
    may_be_zero: ClassVar[tuple[str, ...]] = ()

    def _train(self, x: list[FloatArray], flags: tuple[bool, ...], draws: Draws, generator: torch.Generator) -> Answer:
        s: Settings = self.settings
        rows = TrajectoryRows(x, flags, s.sort, s.principal)
        flat = rows(x)[0]
        center = flat.mean(0)
        components = PrincipalComponents(flat - center, None, min(s.principal, max(2, len(flat) // 4)))
        scores = components.scores(flat - center)
        low, high = scores.amin(0), scores.amax(0)

        def features(rows: Tensor) -> Tensor:
            # To the unit cube, for which BoTorch's priors on lengths are made; no extrapolation beyond the draws.
            unit = (components.scores(rows - center) - low) / (high - low).clamp(min=1e-9)
            # Draws that are all alike have no component; the process then sees one that does not vary.
            return unit.clamp(-0.1, 1.1) if unit.shape[1] else unit.new_zeros(len(unit), 1)

        picked = _picked(draws.weights, s.draws, generator)
        process = _Process(
            features(flat[picked]), draws.unit[picked], draws.weights[picked], s.tuning_draws, s.steps, generator
        )
        scale, correlation = process.left_out_errors()
        if not s.calibrated:
            scale, correlation = np.ones_like(scale), np.eye(len(scale))

        def answer(batch: list[FloatArray]) -> MixturePosterior:
            mean, variance = process.predict(features(rows(batch)[0]))
            sd = scale * np.sqrt(variance)
            return cube_gaussian(mean, correlation * np.outer(sd, sd))

        return answer


def _picked(weights: Tensor, count: int, generator: torch.Generator) -> Tensor:
    """Indices of at most ``count`` draws, in proportion to their weights, none twice, in order."""
    if len(weights) <= count:
        return torch.arange(len(weights))
    return torch.multinomial(weights, count, generator=generator).sort().values


class _Process:
    """Independent processes for D parameters on the same draws.

    Args:
        features: ``(N, F)`` in the unit cube.
        unit: ``(N, D)``.
        weights: ``(N,)``.
        tuning: draws on which the hyper-parameters are found.
        steps: of L-BFGS.
        generator: picks them.
    """

    def __init__(
        self, features: Tensor, unit: Tensor, weights: Tensor, tuning: int, steps: int, generator: torch.Generator
    ) -> None:
        share = (weights / weights.sum())[:, None]
        self.center = (share * unit).sum(0)
        self.scale = (share * (unit - self.center) ** 2).sum(0).sqrt().clamp(min=1e-6)
        self.features, self.weights = features, weights
        part = _picked(weights, tuning, generator)
        target = (unit - self.center) / self.scale
        self.single = [_Single(features, y, weights, part, steps) for y in target.T]

    def predict(self, features: Tensor) -> tuple[FloatArray, FloatArray]:
        """Mean and variance ``(D,)`` at one row of features, noise included."""
        mean, variance = (torch.stack(v) for v in zip(*(g.predict(features) for g in self.single), strict=True))
        return (self.center + self.scale * mean).numpy(), (self.scale**2 * variance).numpy()

    def left_out_errors(self) -> tuple[FloatArray, FloatArray]:
        """Ratio ``(D,)`` of leave-one-out errors to what was predicted for them, and their correlations ``(D, D)``."""
        white = torch.stack([g.left_out for g in self.single], dim=1)
        share = (self.weights / self.weights.sum())[:, None]
        second = (share * white).T @ white
        sd = second.diagonal().sqrt().clamp(min=1e-6)
        return sd.numpy(), (second / torch.outer(sd, sd)).numpy()


class _Single:
    """One process: ``y = c + f(x) + e``, hyper-parameters from some draws, conditioned on all.

    Attributes:
        left_out: ``(N,)`` leave-one-out errors in predicted standard deviations, in closed form (Rasmussen and
            Williams 2006, eq. 5.10-5.12).
    """

    def __init__(self, features: Tensor, y: Tensor, weights: Tensor, part: Tensor, steps: int) -> None:
        SingleTaskGP, ExactMarginalLogLikelihood, fit_gpytorch_mll_scipy = _botorch()
        with warnings.catch_warnings():
            # BoTorch warns of data not standardised to its taste and of stopping at the last step; how good the fit
            # is, is seen on the left-out draws.
            warnings.simplefilter("ignore")
            model = SingleTaskGP(features[part], y[part, None], outcome_transform=None)
            likelihood = ExactMarginalLogLikelihood(model.likelihood, model)
            fit_gpytorch_mll_scipy(likelihood, options={"maxiter": steps})
        self.features = features
        with torch.no_grad():
            self.kernel = model.covar_module.eval()
            self.noise, self.constant = model.likelihood.noise.squeeze(), model.mean_module.constant.squeeze()
            covariance = self.kernel(features).to_dense() + torch.diag(self.noise / weights)
            self.inverse = torch.cholesky_inverse(torch.linalg.cholesky(covariance))
            self.dual = self.inverse @ (y - self.constant)
            precision = self.inverse.diagonal()
            # Of a draw of weight w the error has noise / w in it; that of a new measurement has noise.
            variance = (1.0 / precision - self.noise / weights).clamp(min=0.0) + self.noise
            self.left_out = self.dual / precision / variance.sqrt()

    def predict(self, features: Tensor) -> tuple[Tensor, Tensor]:
        across = self.kernel(features, self.features).to_dense()[0]
        own = self.kernel(features, diag=True)[0]
        variance = (own - across @ self.inverse @ across).clamp(min=0.0) + self.noise
        return self.constant + across @ self.dual, variance


def _botorch() -> tuple[Any, Any, Any]:
    """What is used of BoTorch and GPyTorch; seconds to import, and not needed by the other estimators."""
    try:
        from botorch.models import SingleTaskGP
        from botorch.optim.fit import fit_gpytorch_mll_scipy
        from gpytorch.mlls import ExactMarginalLogLikelihood
    except ImportError as error:
        raise BrokenPluginError(
            f"gp-bulk needs GPyTorch and BoTorch ({error}); install them with: pip install 'muslin[gp]'"
        ) from error
    return SingleTaskGP, ExactMarginalLogLikelihood, fit_gpytorch_mll_scipy
