"""BayesSim-MDNN: a full-covariance mixture density network on trajectories or on their summaries."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import torch

from ...core.arrays import FloatArray
from ...core.errors import InputError
from ..density.draws import Draws
from ..embedding.correlation import CorrelationRows
from ..embedding.rows import Rows, TrajectoryRows
from .base import Answer, TrainedEstimator
from .densities import mixture_answer
from .network_settings import PAPER, NetworkSettings


@dataclass(frozen=True)
class Settings(NetworkSettings):
    """Options of ``bayessim-mdnn``.

    Args:
        on: ``"trajectory"`` (the paper's) or ``"summaries"`` (BayesSim's cross-correlations).
        components: Gaussians of a mixture.
    """

    on: str = "trajectory"
    components: int = 8


class BayesSimMDNN(TrainedEstimator):
    """q(theta | x): full-covariance Gaussian mixtures by fully connected networks on the trajectory.

    ``on="trajectory"`` reads the standardised coordinates of all points in all frames (Antonova et al., *A Bayesian
    Treatment of Real-to-Sim for Deformable Object Manipulation*); ``on="summaries"`` reads BayesSim's
    ``({<tau_i, a_j>}, E[tau], Var[tau])`` (Ramos et al. 2019), with actions taken from the motion that the draws
    share (:class:`~..embedding.correlation.CorrelationRows`).

    ``preset="paper"``: one network of 3 x 1024 on the standardised rows, 4 Gaussians. The default, for budgets of
    hundreds to thousands of draws: principal components and a kernel ridge regression of the rows
    (:class:`~..embedding.summaries.Summaries`), whose guess several small networks correct, averaged, their width
    set on the draws that each left out.

    Points are read by their place, so their order matters by construction. Where ``correspondence`` is False the
    default puts every frame in lexicographic order first (``sort``), which makes the order in which points come
    irrelevant but lets a lost or displaced point shift all those after it; the paper's preset reads them as they
    come. Fewer points than in training count as not seen, more are refused. Gaps are filled in from other points.

    Args:
        correspondence, preset, options: as of :class:`~.base.TrainedEstimator`, with the fields of :class:`Settings`.
    """

    name: ClassVar[str] = "bayessim-mdnn"
    presets: ClassVar[Mapping[str, Any]] = {"default": Settings(), "paper": Settings(components=4, **PAPER)}
    may_be_zero: ClassVar[tuple[str, ...]] = ("patience", "weight_decay")

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        if self.settings.on not in ("trajectory", "summaries"):
            raise InputError(f'{self.name}: on must be "trajectory" or "summaries", not {self.settings.on!r}')

    def _train(self, x: list[FloatArray], flags: tuple[bool, ...], draws: Draws, generator: torch.Generator) -> Answer:
        s: Settings = self.settings
        trajectory = TrajectoryRows(x, flags, s.sort, s.principal)
        rows: Rows = trajectory if s.on == "trajectory" else CorrelationRows(trajectory)
        return mixture_answer(rows, rows(x), draws, s, s.components, generator)
