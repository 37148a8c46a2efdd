"""Several small networks on the same features, each stopped early on draws that it leaves out."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
import torch
from torch import Tensor

from ..posterior.mixture import MixturePosterior
from .head import MeanHead
from .mixture_head import MixtureHead, mixture_log_prob
from .networks import SummaryNetwork
from .training import train

# Part of the mass in a copy of the mixture this much wider, so that the few draws in its tail do not widen it all.
_TAILS = (0.001, 0.01, 0.03, 0.06, 0.1, 0.2)
_TAIL_WIDTH = 3.0
# Factors on all standard deviations, of which the one that suits the left-out draws best is taken.
_WIDENINGS = (0.7, 0.8, 0.9, 1.0, 1.1, 1.2, 1.35, 1.5, 1.75, 2.0, 2.5, 3.0)


@dataclass(frozen=True)
class Plan:
    """How networks on features are trained.

    Args:
        hidden: widths of the fully connected layers.
        members: networks; with one, a fifth of the draws is left out.
        learning_rate, weight_decay, batch, max_epochs, patience: of :func:`~.training.train`. Patience 0 trains one
            network for all epochs on all draws.
    """

    hidden: tuple[int, ...]
    members: int
    learning_rate: float
    weight_decay: float
    batch: int
    max_epochs: int
    patience: int


def cross_fit(
    make: Callable[[], SummaryNetwork],
    inputs: list[Tensor],
    target: Tensor,
    weights: Tensor,
    plan: Plan,
    generator: torch.Generator,
) -> list[tuple[SummaryNetwork, Tensor]]:
    """Networks, and the draws ``(n,)`` that each left out (none when patience is 0)."""
    members = plan.members if plan.patience else 1
    fold = torch.randperm(len(target), generator=generator) % max(members, 5 if plan.patience else 1)
    trained = []
    for k in range(members):
        network = make()
        held = fold == k if plan.patience else torch.zeros(len(target), dtype=torch.bool)
        train(
            network, inputs, target, weights, held, generator,
            learning_rate=plan.learning_rate, weight_decay=plan.weight_decay, batch=plan.batch,
            max_epochs=plan.max_epochs, patience=plan.patience,
        )  # fmt: skip
        trained.append((network, torch.nonzero(held).flatten()))
    return trained


class MixtureMembers:
    """Mixture density networks on summaries, averaged, their width set on the draws that each left out.

    Args:
        features: ``(N, F)`` of the training draws.
        guess: ``(N, D)`` first guesses of the mean, in probit coordinates.
        target: ``(N, D)`` parameters in probit coordinates.
        weights: ``(N,)``.
        scale: ``(D,)`` standard deviations the mixtures start from.
        components: Gaussians of a mixture.
        plan: how they are trained.
        generator: of all that is random.
    """

    def __init__(
        self,
        features: Tensor,
        guess: Tensor,
        target: Tensor,
        weights: Tensor,
        scale: Tensor,
        components: int,
        plan: Plan,
        generator: torch.Generator,
    ) -> None:
        features, guess, target, weights, scale = (t.float() for t in (features, guess, target, weights, scale))

        def make() -> SummaryNetwork:
            head = MixtureHead(plan.hidden[-1], target.shape[1], components, scale)
            return SummaryNetwork(features.shape[1], plan.hidden, head)

        left_out = torch.zeros(len(_TAILS), len(_WIDENINGS))
        self.networks = []
        for network, rows in cross_fit(make, [features, guess], target, weights, plan, generator):
            self.networks.append(network)
            with torch.no_grad():
                outputs = network(features[rows], guess[rows])
                left_out += _widened_scores(target[rows], weights[rows], outputs)
        best = int(left_out.argmax())
        self.tail, self.widening = (
            (_TAILS[best // len(_WIDENINGS)], _WIDENINGS[best % len(_WIDENINGS)]) if plan.patience else (0.0, 1.0)
        )

    def posterior(self, features: Tensor, guess: Tensor) -> MixturePosterior:
        """The mixture at one row of features and first guess."""
        outputs = [m(features.float(), guess.float()) for m in self.networks]
        core = MixturePosterior.average([mixture(o, self.widening) for o in outputs])
        if self.tail == 0.0:
            return core
        return MixturePosterior(
            np.concatenate([(1.0 - self.tail) * core.weights, self.tail * core.weights]),
            np.concatenate([core.means, core.means]),
            np.concatenate([core.cholesky, _TAIL_WIDTH * core.cholesky]),
        )


class MeanMembers:
    """Networks that predict a mean on the unit cube, averaged, and what they were wrong by on left-out draws.

    Args:
        features, weights, plan, generator: as of :class:`MixtureMembers`.
        guess: ``(N, D)`` first guesses on the unit cube.
        target: ``(N, D)`` parameters in the unit cube.
        error: what is minimised, ``"l1"`` or ``"l2"``.

    Attributes:
        residual: ``(n, D)`` errors of the left-out draws, each by the network that never saw it.
        weights: ``(n,)`` of those draws.
    """

    def __init__(
        self,
        features: Tensor,
        guess: Tensor,
        target: Tensor,
        weights: Tensor,
        error: Literal["l1", "l2"],
        plan: Plan,
        generator: torch.Generator,
    ) -> None:
        features, guess, target, weights = (t.float() for t in (features, guess, target, weights))
        scale = ((weights[:, None] * (target - guess) ** 2).sum(0) / weights.sum()).sqrt().clamp(min=1e-3)

        def make() -> SummaryNetwork:
            head = MeanHead(plan.hidden[-1], target.shape[1], scale, error)
            return SummaryNetwork(features.shape[1], plan.hidden, head)

        trained = cross_fit(make, [features, guess], target, weights, plan, generator)
        self.networks = [network for network, _ in trained]
        residual, share = [], []
        with torch.no_grad():
            for network, rows in trained:
                residual.append(target[rows] - network(features[rows], guess[rows]))
                share.append(weights[rows])
        self.residual, self.weights = torch.cat(residual).double(), torch.cat(share).double()

    def mean(self, features: Tensor, guess: Tensor) -> Tensor:
        """``(B, D)`` on the unit cube, float64."""
        each = [m(features.float(), guess.float()) for m in self.networks]
        return torch.stack(each).mean(0).double()


def mixture(outputs: tuple[Tensor, Tensor, Tensor], widening: float = 1.0) -> MixturePosterior:
    """The first row of a network's mixtures as a posterior, all its standard deviations scaled."""
    log_weights, means, factors = (t[0].double() for t in outputs)
    inverse = widening * torch.linalg.inv(factors)
    # N(m, (P^T P)^-1): the covariance is P^-1 P^-T, and P^-1 is lower triangular like P.
    return MixturePosterior(log_weights.exp().numpy(), means.numpy(), inverse.numpy())


def _widened_scores(target: Tensor, weights: Tensor, outputs: tuple[Tensor, Tensor, Tensor]) -> Tensor:
    """Summed log density of some draws under each part of mass in the tail and each widening."""
    logits, means, factors = outputs
    narrow, wide = (
        torch.stack([mixture_log_prob(target, logits, means, factors / (f * c)) for c in _WIDENINGS])
        for f in (1.0, _TAIL_WIDTH)
    )
    mixed = [torch.logaddexp(narrow + math.log(1.0 - t), wide + math.log(t)) for t in _TAILS]
    return torch.stack([log_p @ weights for log_p in mixed])
