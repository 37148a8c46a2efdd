"""BayesZoom: one Gaussian about the parameters that a fully connected network reads off the trajectory."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import torch

from ...core.arrays import FloatArray
from ..density.draws import Draws
from ..density.head import MeanHead
from ..density.kernel_mean import KernelMeanRows
from ..embedding.encoder import Encoder
from ..embedding.rows import TrajectoryRows
from ..posterior.cube_gaussian import cube_gaussian
from ..posterior.mixture import MixturePosterior
from .base import Answer, TrainedEstimator
from .densities import error_covariance, gaussian_answer
from .network_settings import PAPER, NetworkSettings
from .rkhs_settings import PAPER as RKHS_PAPER
from .rkhs_settings import RKHSSettings

# Where the network on the layer starts, on the unit cube: the prior's mean and standard deviation.
_MIDDLE, _SPREAD = 0.5, 12.0**-0.5


@dataclass(frozen=True)
class Settings(NetworkSettings):
    """Options of ``bayeszoom``.

    Args:
        correlated: whether the Gaussian has the correlations of the errors.
    """

    correlated: bool = True


@dataclass(frozen=True)
class ZoomRKHSSettings(RKHSSettings):
    """Options of ``bayeszoom-rkhs``.

    Args:
        correlated: as of :class:`Settings`.
    """

    correlated: bool = True


class BayesZoom(TrainedEstimator):
    """One Gaussian: a network of three fully connected layers predicts its mean, the L1 validation error its width.

    Without the RKHS layer: the network reads the standardised coordinates of all points in all frames. It minimises
    the L1 error; the standard deviation is ``sqrt(pi / 2)`` times that error on left-out draws, as it is for a
    Gaussian, the same for every measurement; the Gaussian is cut at the prior's bounds
    (:func:`~..posterior.cube_gaussian.cube_gaussian`). Meant for the sequential loop, which zooms in round by round.

    ``preset="paper"``: 3 x 1024, a fifth of the draws for validation, independent errors. The default corrects a kernel
    ridge regression as :class:`~.bayessim_mdnn.BayesSimMDNN` does; its errors may go together.

    Order and number of points, ``correspondence`` and ``sort`` are as of :class:`~.bayessim_mdnn.BayesSimMDNN`.

    Args:
        correspondence, preset, options: as of :class:`~.base.TrainedEstimator`, with the fields of :class:`Settings`.
    """

    name: ClassVar[str] = "bayeszoom"
    presets: ClassVar[Mapping[str, Any]] = {
        "default": Settings(hidden=(64, 64, 64)),
        "paper": Settings(correlated=False, **{**PAPER, "patience": 2000, "members": 1}),
    }
    may_be_zero: ClassVar[tuple[str, ...]] = ("weight_decay",)

    def _train(self, x: list[FloatArray], flags: tuple[bool, ...], draws: Draws, generator: torch.Generator) -> Answer:
        s: Settings = self.settings
        rows = TrajectoryRows(x, flags, s.sort, s.principal)
        return gaussian_answer(rows, rows(x), draws, s, "l1", s.correlated, generator)


class BayesZoomRKHS(TrainedEstimator):
    """BayesZoom on kernel mean embeddings of every frame's points, with learned frequencies and bandwidth.

    The paper's BayesZoom-RKHS (Antonova et al.): the density of :class:`BayesZoom` on the embedding of
    :class:`~.bayessim_rkhs.BayesSimRKHS`, whose docstring says what is done with points that correspond, with sets,
    and by default on top of the paper's layer. The order of points in a set has no influence, to the last bit.

    Args:
        correspondence, preset, options: as of :class:`~.base.TrainedEstimator`, with the fields of
            :class:`ZoomRKHSSettings`.
    """

    name: ClassVar[str] = "bayeszoom-rkhs"
    presets: ClassVar[Mapping[str, Any]] = {
        "default": ZoomRKHSSettings(summary_hidden=(32, 32, 32)),
        "paper": ZoomRKHSSettings(correlated=False, **{**RKHS_PAPER, "patience": 2000}),
    }
    may_be_zero: ClassVar[tuple[str, ...]] = ("frames", "points", "summary_decay")

    def _train(self, x: list[FloatArray], flags: tuple[bool, ...], draws: Draws, generator: torch.Generator) -> Answer:
        s: ZoomRKHSSettings = self.settings
        encoder = Encoder(x, flags, s.principal, generator)
        points, seen = encoder.points(x)
        dim = draws.unit.shape[1]
        head = MeanHead(s.hidden[-1], dim, torch.full((dim,), _SPREAD), "l1")
        guess = torch.full((dim,), _MIDDLE)
        rows = KernelMeanRows(encoder, points, seen, draws.unit, draws.weights, head, guess, s.layer, generator)
        if s.summaries:
            return gaussian_answer(rows, rows.blocks(points, seen), draws, s, "l1", s.correlated, generator)
        held = rows.held
        with torch.no_grad():
            predicted = rows.outputs([p[held] for p in points], [m[held] for m in seen])
        error = (draws.unit[held] - predicted).numpy()
        covariance = error_covariance(error, draws.weights[held].numpy(), "l1", s.correlated)

        def answer(batch: list[FloatArray]) -> MixturePosterior:
            return cube_gaussian(rows.outputs(*encoder.points(batch))[0].double().numpy(), covariance)

        return answer
