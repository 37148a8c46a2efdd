"""Several small networks on summaries, each with all that it reads made without the draws that it leaves out."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np
import torch
from torch import Tensor

from ..posterior.mixture import MixturePosterior
from .draws import Draws
from .head import Head, MeanHead
from .mixture_head import MixtureHead
from .networks import SummaryNetwork
from .training import train
from .widths import TAIL_WIDTH, LeftOut, fitted_width

# With fewer draws than this, each is left out by two networks.
_FEW = 500


class Summary(Protocol):
    """What networks read: features and first guesses ``(N, D)``; :class:`~..embedding.summaries.Summaries` is one.

    Attributes:
        training: of the draws it was made from; residual: ``(D,)`` error of their guesses.
    """

    training: tuple[Tensor, Tensor]
    residual: Tensor

    def __call__(self, known: list[Tensor], /) -> tuple[Tensor, Tensor]: ...


#: From what is known of some draws, and these.
Summarise = Callable[[list[Tensor], Draws], Summary]


@dataclass(frozen=True)
class Plan:
    """How networks on features are trained.

    Args:
        hidden: widths of the fully connected layers.
        members: networks; with one, a fifth of the draws is left out. Twice as many with few draws, each of which
            two of them leave out: what these say together is nearer to what all say of a measurement.
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

    def held(self, draws: int, generator: torch.Generator) -> list[Tensor]:
        """Which draws each network leaves out, bool ``(N,)``."""
        if not self.patience:
            return [torch.zeros(draws, dtype=torch.bool)]
        parts = 5 if self.members == 1 else self.members
        repeats = 2 if self.members > 1 and draws < _FEW else 1
        folds = [torch.randperm(draws, generator=generator) % parts for _ in range(repeats)]
        return [fold == k for fold in folds for k in range(self.members)]


@dataclass(frozen=True, eq=False)
class Member:
    """A network and what it reads.

    Args:
        summary: made without the draws left out.
        network: trained without them.
        held: ``(n,)`` their numbers.
        inputs: features and first guesses of them.
    """

    summary: Summary
    network: SummaryNetwork
    held: Tensor
    inputs: tuple[Tensor, Tensor]


class OnCube:
    """A summary whose first guesses are on the unit cube.

    Args:
        summary: in probit coordinates; draws: that it was made from.
    """

    def __init__(self, summary: Summary, draws: Draws) -> None:
        self.summary = summary
        features, guess = summary.training
        self.training = features, torch.special.ndtr(guess)
        error = (draws.weights[:, None] * (draws.unit - self.training[1]) ** 2).sum(0) / draws.weights.sum()
        self.residual = error.sqrt().clamp(min=1e-3)

    def __call__(self, known: list[Tensor]) -> tuple[Tensor, Tensor]:
        features, guess = self.summary(known)
        return features, torch.special.ndtr(guess)


def cross_fit(
    head: Callable[[Summary], Head],
    summarise: Summarise,
    known: list[Tensor],
    draws: Draws,
    target: Tensor,
    plan: Plan,
    generator: torch.Generator,
) -> list[Member]:
    """Networks, each trained with summaries of its own, which know nothing of the draws that it leaves out.

    Left-out draws then meet what a measurement meets: were regressions made from all draws, these would be nearer to
    the draws left out than to any measurement, and widths found on them too small.

    Args:
        head: of a network on a summary.
        summarise: makes the summary.
        known: ``(N, ...)``, what is known of every draw.
        draws, target: their weights, and ``(N, D)`` what networks learn.
        plan, generator: how.
    """
    weights, trained = draws.weights.float(), []
    for held in plan.held(len(target), generator):
        summary = summarise([t[~held] for t in known], draws.among(~held))
        left = [t.float() for t in summary([t[held] for t in known])]
        inputs = []
        for seen, new in zip(summary.training, left, strict=True):
            rows = torch.zeros(len(target), seen.shape[1])
            rows[~held], rows[held] = seen.float(), new
            inputs.append(rows)
        network = SummaryNetwork(inputs[0].shape[1], plan.hidden, head(summary))
        train(
            network, inputs, target.float(), weights, held, generator,
            learning_rate=plan.learning_rate, weight_decay=plan.weight_decay, batch=plan.batch,
            max_epochs=plan.max_epochs, patience=plan.patience,
        )  # fmt: skip
        trained.append(Member(summary, network, torch.nonzero(held).flatten(), (left[0], left[1])))
    return trained


class MixtureMembers:
    """Mixture density networks on summaries, averaged, their widths set on the draws that each left out.

    Args:
        summarise, known: as of :func:`cross_fit`.
        draws: parameters and weights.
        components: Gaussians of a mixture.
        plan: how they are trained.
        generator: of all that is random.
    """

    def __init__(
        self,
        summarise: Summarise,
        known: list[Tensor],
        draws: Draws,
        components: int,
        plan: Plan,
        generator: torch.Generator,
    ) -> None:
        target, weights = draws.latent.float(), draws.weights.float()
        dim = target.shape[1]

        def head(summary: Summary) -> Head:
            return MixtureHead(plan.hidden[-1], dim, components, summary.residual.float())

        self.members = cross_fit(head, summarise, known, draws, target, plan, generator)
        self.widening, self.tail = torch.ones(dim), 0.0
        if plan.patience:
            with torch.no_grad():
                said = [LeftOut(m.held, target[m.held], m.network(*m.inputs)) for m in self.members]
            self.widening, self.tail = fitted_width(said, weights)

    def posterior(self, known: list[Tensor]) -> MixturePosterior:
        """The mixture at one measurement."""
        outputs = []
        for member in self.members:
            features, guess = member.summary(known)
            outputs.append(member.network(features.float(), guess.float()))
        core = MixturePosterior.average([mixture(o, self.widening) for o in outputs])
        if self.tail == 0.0:
            return core
        return MixturePosterior(
            np.concatenate([(1.0 - self.tail) * core.weights, self.tail * core.weights]),
            np.concatenate([core.means, core.means]),
            np.concatenate([core.cholesky, TAIL_WIDTH * core.cholesky]),
        )


class MeanMembers:
    """Networks that predict a mean on the unit cube, averaged, and what they were wrong by on left-out draws.

    Args:
        summarise, known, draws, plan, generator: as of :class:`MixtureMembers`.
        error: what is minimised, ``"l1"`` or ``"l2"``.

    Attributes:
        residual: ``(n, D)`` errors of the left-out draws, each by the network that never saw it.
        weights: ``(n,)`` of those draws.
    """

    def __init__(
        self,
        summarise: Summarise,
        known: list[Tensor],
        draws: Draws,
        error: Literal["l1", "l2"],
        plan: Plan,
        generator: torch.Generator,
    ) -> None:
        target = draws.unit.float()

        def on_cube(known: list[Tensor], some: Draws) -> Summary:
            return OnCube(summarise(known, some), some)

        def head(summary: Summary) -> Head:
            return MeanHead(plan.hidden[-1], target.shape[1], summary.residual.float(), error)

        self.members = cross_fit(head, on_cube, known, draws, target, plan, generator)
        residual = []
        with torch.no_grad():
            for m in self.members:
                residual.append(target[m.held] - m.network(*m.inputs))
        self.residual = torch.cat(residual).double()
        self.weights = torch.cat([draws.weights[m.held] for m in self.members])

    def mean(self, known: list[Tensor]) -> Tensor:
        """``(B, D)`` on the unit cube, float64."""
        each = []
        for member in self.members:
            features, guess = member.summary(known)
            each.append(member.network(features.float(), guess.float()))
        return torch.stack(each).mean(0).double()


def mixture(outputs: tuple[Tensor, Tensor, Tensor], widening: Tensor) -> MixturePosterior:
    """The first row of a network's mixtures as a posterior, all its standard deviations scaled by ``(D,)``."""
    log_weights, means, factors = (t[0].double() for t in outputs)
    inverse = widening.double()[:, None] * torch.linalg.inv(factors)
    # N(m, (P^T P)^-1): the covariance is P^-1 P^-T, and P^-1 is lower triangular like P.
    return MixturePosterior(log_weights.exp().numpy(), means.numpy(), inverse.numpy())
