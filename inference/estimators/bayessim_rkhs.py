"""BayesSim-RKHS: a mixture density network on kernel mean embeddings of the points of every frame."""

from collections.abc import Mapping
from typing import Any, ClassVar

import torch

from ...core.arrays import FloatArray
from ..density.draws import Draws
from ..density.kernel_mean import KernelMeanRows
from ..density.members import mixture
from ..density.mixture_head import MixtureHead
from ..embedding.encoder import Encoder
from .base import Answer, TrainedEstimator
from .densities import mixture_answer
from .rkhs_settings import PRESETS, Settings


class BayesSimRKHS(TrainedEstimator):
    """q(theta | x): RKHS layer per frame, fully connected layers, full-covariance Gaussian mixture.

    The paper's (Antonova et al., *A Bayesian Treatment of Real-to-Sim for Deformable Object Manipulation*): the
    points of a frame as samples of a distribution, embedded by the mean of random Fourier features whose
    frequencies and bandwidth are learned with the network; a mixture density network on the embedded trajectory;
    draws weighted by prior over proposal.

    Ours, for budgets of hundreds of draws (all off with ``preset="paper"`` except the first two):

    - points are standardised by the training draws;
    - the mixture lives in probit coordinates of the unit cube, so no mass leaves the prior's bounds;
    - the size of each set stands beside its mean (``size``);
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

    presets: ClassVar[Mapping[str, Any]] = PRESETS
    may_be_zero: ClassVar[tuple[str, ...]] = ("patience", "frames", "points", "summary_decay")

    def _train(self, x: list[FloatArray], flags: tuple[bool, ...], draws: Draws, generator: torch.Generator) -> Answer:
        s: Settings = self.settings
        encoder = Encoder(x, flags, s.principal, generator)
        points, seen = encoder.points(x)
        dim = draws.latent.shape[1]
        head = MixtureHead(s.hidden[-1], dim, s.components, draws.latent.std(0).clamp(min=1e-3).float())
        rows = KernelMeanRows(
            encoder, points, seen, draws.latent, draws.weights, head, torch.zeros(dim), s.layer, generator
        )
        if not s.summaries:
            return lambda batch: mixture(rows.outputs(*encoder.points(batch)))
        return mixture_answer(rows, rows.blocks(points, seen), draws, s, s.components, generator)
