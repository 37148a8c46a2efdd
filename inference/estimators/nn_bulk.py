"""NN-bulk: a fully connected network on one batch of draws from the prior."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import torch

from ...core.arrays import FloatArray
from ..density.draws import Draws
from ..embedding.rows import TrajectoryRows
from .base import Answer, TrainedEstimator
from .densities import gaussian_answer
from .network_settings import PAPER, NetworkSettings


@dataclass(frozen=True)
class Settings(NetworkSettings):
    """Options of ``nn-bulk``.

    Args:
        correlated: whether the Gaussian has the correlations of the errors.
    """

    correlated: bool = True


class NNBulk(TrainedEstimator):
    """Parameters from the trajectory by least squares; a Gaussian as wide as the validation error.

    The paper's NN-bulk-1.5k is a fully connected network trained on 1500 draws from the prior in one batch, which
    predicts parameters and has no posterior. Here the Gaussian about the prediction has the root mean square error
    on left-out draws as its standard deviation, the same for every measurement, and is cut at the prior's bounds
    (:func:`~..posterior.cube_gaussian.cube_gaussian`). It works on weighted draws too, but is meant for one round.

    ``preset="paper"``: 3 x 1024 on the standardised trajectory, a fifth of the draws for validation, independent
    errors. The default corrects a kernel ridge regression as :class:`~.bayessim_mdnn.BayesSimMDNN` does; its
    errors may go together.

    Order and number of points, ``correspondence`` and ``sort`` are as of :class:`~.bayessim_mdnn.BayesSimMDNN`.

    Args:
        correspondence, preset, options: as of :class:`~.base.TrainedEstimator`, with the fields of :class:`Settings`.
    """

    name: ClassVar[str] = "nn-bulk"
    presets: ClassVar[Mapping[str, Any]] = {
        "default": Settings(),
        "paper": Settings(correlated=False, **{**PAPER, "patience": 2000, "members": 1}),
    }
    may_be_zero: ClassVar[tuple[str, ...]] = ("weight_decay",)

    def _train(self, x: list[FloatArray], flags: tuple[bool, ...], draws: Draws, generator: torch.Generator) -> Answer:
        s: Settings = self.settings
        rows = TrajectoryRows(x, flags, s.sort, s.principal)
        return gaussian_answer(rows, rows(x), draws, s, "l2", s.correlated, generator)
