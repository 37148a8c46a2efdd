"""From rows to posteriors: what the estimators put behind their ways to read a recording."""

from typing import Literal

import numpy as np
import torch
from torch import Tensor

from ...core.arrays import FloatArray
from ..density.draws import Draws
from ..density.members import MeanMembers, MixtureMembers
from ..embedding.plain import PlainRows
from ..embedding.rows import Rows
from ..embedding.summaries import Summaries
from ..posterior.cube_gaussian import cube_gaussian
from ..posterior.mixture import MixturePosterior
from .base import Answer
from .network_settings import NetworkSettings
from .rkhs_settings import RKHSSettings

# A standard deviation on the unit cube is kept above this.
_LEAST = 1e-4


def summarised(blocks: list[Tensor], draws: Draws, s: NetworkSettings | RKHSSettings) -> Summaries | PlainRows:
    """Features and first guesses of the draws, as the settings ask for them."""
    if not s.summaries:
        return PlainRows(blocks, draws.latent)
    return Summaries(blocks, draws.unit, draws.weights, s.principal, s.shown)


def mixture_answer(
    rows: Rows,
    blocks: list[Tensor],
    draws: Draws,
    s: NetworkSettings | RKHSSettings,
    components: int,
    generator: torch.Generator,
) -> Answer:
    """Full-covariance Gaussian mixtures on rows (BayesSim's density).

    Args:
        rows, blocks: how a recording is read, and what it gave for the training draws.
        draws, s, generator: the draws, the settings and the source of all that is random.
        components: Gaussians of a mixture.
    """
    summaries = summarised(blocks, draws, s)
    members = MixtureMembers(
        *summaries.training, draws.latent, draws.weights, summaries.residual, components, s.plan, generator
    )
    return lambda batch: members.posterior(*summaries(rows(batch)))


def gaussian_answer(
    rows: Rows,
    blocks: list[Tensor],
    draws: Draws,
    s: NetworkSettings | RKHSSettings,
    error: Literal["l1", "l2"],
    correlated: bool,
    generator: torch.Generator,
) -> Answer:
    """One Gaussian: networks predict its mean on the unit cube, their validation error is its width.

    Args:
        rows, blocks, draws, s, generator: as of :func:`mixture_answer`.
        error: what the networks minimise, and what the width comes from (:func:`error_covariance`).
        correlated: whether errors of different parameters may go together.
    """
    summaries = summarised(blocks, draws, s)
    features, guess = summaries.training
    members = MeanMembers(features, torch.special.ndtr(guess), draws.unit, draws.weights, error, s.plan, generator)
    covariance = error_covariance(members.residual.numpy(), members.weights.numpy(), error, correlated)

    def answer(batch: list[FloatArray]) -> MixturePosterior:
        features, guess = summaries(rows(batch))
        return cube_gaussian(members.mean(features, torch.special.ndtr(guess))[0].numpy(), covariance)

    return answer


def error_covariance(
    residual: FloatArray, weights: FloatArray, error: Literal["l1", "l2"], correlated: bool
) -> FloatArray:
    """Covariance ``(D, D)`` of errors ``(n, D)`` on left-out draws.

    The standard deviation is the root mean square error, or ``sqrt(pi / 2)`` times the mean absolute one, which is
    the same for a Gaussian and less moved by a few large errors.
    """
    share = weights[:, None] / weights.sum()
    if error == "l1":
        sd = np.sqrt(np.pi / 2.0) * (share * np.abs(residual)).sum(axis=0)
    else:
        sd = np.sqrt((share * residual**2).sum(axis=0))
    sd = np.maximum(sd, _LEAST)
    second = (share * residual).T @ residual
    spread = np.sqrt(np.maximum(np.diagonal(second), 1e-12))
    correlation = second / np.outer(spread, spread) if correlated else np.eye(len(sd))
    np.fill_diagonal(correlation, 1.0)
    return np.asarray(correlation * np.outer(sd, sd))
