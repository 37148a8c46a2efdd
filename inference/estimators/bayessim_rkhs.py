"""BayesSim-RKHS: a mixture density network on kernel mean embeddings of the points of every frame."""

import math
from collections.abc import Sequence
from typing import Any, ClassVar

import numpy as np
import torch
from torch import Tensor

from ...core.arrays import FloatArray
from ...core.errors import StepMissingError
from ...core.estimator import PosteriorEstimator
from ..density.mixture_head import mixture_log_prob
from ..density.networks import SummaryNetwork, TrajectoryNetwork
from ..density.training import isolated, train
from ..embedding.encoder import Encoder
from ..embedding.rkhs import RKHSEmbedding
from ..embedding.summaries import Summaries, probit
from ..posterior.mixture import MixturePosterior
from .inputs import checked, flags_of, measured
from .options import with_options
from .rkhs_settings import PRESETS

_MAY_BE_ZERO = ("patience", "frames", "points", "summary_decay")
# Part of the mass in a copy of the mixture this much wider, so that the few draws in its tail do not widen it all.
_TAILS = (0.001, 0.01, 0.03, 0.06, 0.1, 0.2)
_TAIL_WIDTH = 3.0
# Factors on all standard deviations, of which the one that suits the left-out draws best is taken.
_WIDENINGS = (0.7, 0.8, 0.9, 1.0, 1.1, 1.2, 1.35, 1.5, 1.75, 2.0, 2.5, 3.0)


class BayesSimRKHS(PosteriorEstimator):
    """q(theta | x): RKHS layer per frame, fully connected layers, full-covariance Gaussian mixture.

    The paper's (Antonova et al., *A Bayesian Treatment of Real-to-Sim for Deformable Object Manipulation*): the
    points of a frame as samples of a distribution, embedded by the mean of random Fourier features whose
    frequencies and bandwidth are learned with the network; a mixture density network on the embedded trajectory;
    draws weighted by prior over proposal.

    Ours, for budgets of hundreds of draws (all off with ``preset="paper"`` except the first two):

    - points are standardised by the training draws, and the size of each set stands beside its mean;
    - the mixture lives in probit coordinates of the unit cube, so no mass leaves the prior's bounds;
    - corresponding points enter the kernel with a code of their identity (:class:`~..embedding.encoder.Encoder`);
    - the layer is learned on some frames, then every frame is embedded with it, and the embedded trajectory is
      summarised by principal components and kernel ridge regression (leave-one-out,
      :mod:`~..embedding.ridge`); where points correspond, so are their displacements;
    - several small networks, each stopped early on draws that it leaves out, turn the summaries into mixtures,
      which are averaged; one scale of all standard deviations, and the mass in a wider copy of the mixture, are set
      on the left-out draws.

    Training takes seconds for hundreds of draws. A measurement far outside the range of the draws is pulled to its
    border: check a posterior against the measurement before trusting it.

    Args:
        correspondence: whether point p is the same spot of the object in every frame and draw: one flag, or one a
            recording. Without it, the order of the points has no influence, to the last bit.
        preset: ``"default"`` or ``"paper"``.
        options: any field of :class:`~.rkhs_settings.Settings`, put over the preset.

    Raises:
        InputError: an unknown preset or option, or a value out of range.
    """

    name: ClassVar[str] = "bayessim-rkhs"

    def __init__(
        self, *, correspondence: bool | Sequence[bool] = True, preset: str = "default", **options: Any
    ) -> None:
        self.correspondence = correspondence
        self.settings = with_options(self.name, PRESETS, preset, options, _MAY_BE_ZERO)
        self._encoder: Encoder | None = None
        self._summaries: Summaries | None = None
        self._members: list[SummaryNetwork] = []

    def fit(
        self, theta: FloatArray, x: list[FloatArray], *, log_weights: FloatArray | None = None, seed: int = 0
    ) -> None:
        """Train, replacing whatever was trained before.

        Args:
            theta: ``(N, D)`` in the unit cube.
            x: ``(N, T_r, P, A)`` a recording; NaN = not seen.
            log_weights: ``(N,)``; see :func:`~..density.training.importance_weights` for how they are used. Draws of
                weight zero are left out.
            seed: of everything random; the same draws and seed give the same posterior to the bit.

        Raises:
            InputError: fewer than 10 draws, shapes that do not fit, parameters outside the unit cube, draws in
                which nothing was seen, or weights that make no sense.
        """
        theta, x, weights = checked(theta, x, log_weights)
        flags = flags_of(self.correspondence, len(x))
        with isolated(seed, self.settings.threads) as generator:
            self._fit(theta, x, flags, weights, generator)

    def _fit(
        self,
        theta: FloatArray,
        x: list[FloatArray],
        flags: tuple[bool, ...],
        weights: FloatArray,
        generator: torch.Generator,
    ) -> None:
        s = self.settings
        self._encoder, self._summaries, self._members = None, None, []
        unit = torch.tensor(theta)
        z = probit(unit)
        w = torch.tensor(weights)
        encoder = Encoder(x, flags, s.principal, generator)
        points, seen = encoder.points(x)
        network = self._train_trajectories(encoder, points, seen, z, w, generator)
        self._network = network
        if s.summaries:
            blocks = encoder.blocks(network.embedding, points, seen)
            self._summaries = Summaries(blocks, unit, w, s.principal, s.shown)
            self._train_members(self._summaries, z, w, generator)
        self._encoder = encoder

    def _train_trajectories(
        self,
        encoder: Encoder,
        points: list[Tensor],
        seen: list[Tensor],
        z: Tensor,
        w: Tensor,
        generator: torch.Generator,
    ) -> TrajectoryNetwork:
        s = self.settings
        inputs, masks = encoder.coded(points, seen, s.frames, s.points)
        layer = RKHSEmbedding(encoder.inputs, s.features, s.bandwidth, generator)
        scale = z.std(0).clamp(min=1e-3).float()
        network = TrajectoryNetwork(layer, inputs, masks, z.shape[1], s.hidden, s.components, scale)
        held = torch.zeros(len(z), dtype=torch.bool)
        if s.patience:
            held[torch.randperm(len(z), generator=generator)[: max(2, len(z) // 5)]] = True
        train(
            network, [*inputs, *masks], z.float(), w.float(), held, generator,
            learning_rate=s.learning_rate, weight_decay=0.0, batch=s.batch, max_epochs=s.max_epochs,
            patience=s.patience,
        )  # fmt: skip
        return network

    def _train_members(self, summaries: Summaries, z: Tensor, w: Tensor, generator: torch.Generator) -> None:
        s = self.settings
        features, guess = (t.float() for t in summaries.training)
        target, weights, scale = z.float(), w.float(), summaries.residual.float()
        members = max(2, s.members)
        fold = torch.randperm(len(z), generator=generator) % members
        left_out = torch.zeros(len(_TAILS), len(_WIDENINGS))
        for k in range(members):
            network = SummaryNetwork(features.shape[1], z.shape[1], s.summary_hidden, s.components, scale)
            train(
                network, [features, guess], target, weights, fold == k, generator,
                learning_rate=s.summary_learning_rate, weight_decay=s.summary_decay, batch=s.summary_batch,
                max_epochs=s.summary_epochs, patience=s.summary_patience,
            )  # fmt: skip
            self._members.append(network)
            rows = torch.nonzero(fold == k).flatten()
            with torch.no_grad():
                logits, means, factors = network(features[rows], guess[rows])
                narrow, wide = (
                    torch.stack([mixture_log_prob(target[rows], logits, means, factors / (f * c)) for c in _WIDENINGS])
                    for f in (1.0, _TAIL_WIDTH)
                )
                for i, tail in enumerate(_TAILS):
                    log_p = torch.logaddexp(narrow + math.log(1.0 - tail), wide + math.log(tail))
                    left_out[i] += log_p @ weights[rows]
        best = int(left_out.argmax())
        self._tail, self._widening = _TAILS[best // len(_WIDENINGS)], _WIDENINGS[best % len(_WIDENINGS)]

    def posterior(self, x: list[FloatArray]) -> MixturePosterior:
        """The posterior given one measurement.

        Raises:
            StepMissingError: before :meth:`fit`.
            InputError: recordings that do not fit those trained on, or nothing seen in one of them.
        """
        if self._encoder is None:
            raise StepMissingError("bayessim-rkhs has no posterior before fit")
        batch = measured(x)
        with isolated(0, self.settings.threads), torch.no_grad():
            points, seen = self._encoder.points(batch)
            if self._summaries is None:
                s = self.settings
                inputs, masks = self._encoder.coded(points, seen, s.frames, s.points)
                return _mixture(self._network(*inputs, *masks))
            features, guess = self._summaries(self._encoder.blocks(self._network.embedding, points, seen))
            outputs = [m(features.float(), guess.float()) for m in self._members]
            core = MixturePosterior.average([_mixture(o, self._widening) for o in outputs])
            wide = _TAIL_WIDTH * core.cholesky
            return MixturePosterior(
                np.concatenate([(1.0 - self._tail) * core.weights, self._tail * core.weights]),
                np.concatenate([core.means, core.means]),
                np.concatenate([core.cholesky, wide]),
            )


def _mixture(outputs: tuple[Tensor, Tensor, Tensor], widening: float = 1.0) -> MixturePosterior:
    """The first row of a network's mixtures as a posterior, all its standard deviations scaled."""
    log_weights, means, factors = (t[0].double() for t in outputs)
    inverse = widening * torch.linalg.inv(factors)
    # N(m, (P^T P)^-1): the covariance is P^-1 P^-T, and P^-1 is lower triangular like P.
    return MixturePosterior(log_weights.exp().numpy(), means.numpy(), inverse.numpy())
