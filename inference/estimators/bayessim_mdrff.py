"""BayesSim-MDRFF: a full-covariance mixture density network on random Fourier features of the trajectory."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import torch

from ...core.arrays import FloatArray
from ...core.errors import InputError
from ..density.draws import Draws
from ..embedding.fourier import FourierRows
from ..embedding.rows import TrajectoryRows
from .base import Answer, TrainedEstimator
from .densities import mixture_answer
from .network_settings import PAPER, NetworkSettings


@dataclass(frozen=True)
class Settings(NetworkSettings):
    """Options of ``bayessim-mdrff``.

    Args:
        features: random Fourier features of a trajectory, cosines and sines together.
        kernel: ``"rbf"`` or ``"matern"`` (5/2).
        bandwidth: of the kernel [median distances between training draws].
        whitened: principal components of the trajectory that the kernel sees; 0 for the trajectory itself.
        components: Gaussians of a mixture.
    """

    features: int = 200
    kernel: str = "rbf"
    bandwidth: float = 2.0
    whitened: int = 10
    components: int = 8


class BayesSimMDRFF(TrainedEstimator):
    """q(theta | x): full-covariance Gaussian mixtures on random Fourier features of the whole trajectory.

    Random, not learned, frequencies of the standardised coordinates of all points in all frames
    (:class:`~..embedding.fourier.FourierRows`; Ramos et al. 2019, Antonova et al.).

    ``preset="paper"``: 200 features of the trajectory, one network of 3 x 1024, 4 Gaussians; the paper names no
    length for the kernel, the median distance between draws is taken. The default: features of the trajectory's
    principal components, then summaries and averaged networks as of :class:`~.bayessim_mdnn.BayesSimMDNN`.

    Order and number of points, ``correspondence`` and ``sort`` are as of :class:`~.bayessim_mdnn.BayesSimMDNN`: points
    are read by their place.

    Args:
        correspondence, preset, options: as of :class:`~.base.TrainedEstimator`, with the fields of :class:`Settings`.
    """

    name: ClassVar[str] = "bayessim-mdrff"
    presets: ClassVar[Mapping[str, Any]] = {
        "default": Settings(),
        "paper": Settings(bandwidth=1.0, whitened=0, components=4, **PAPER),
    }
    may_be_zero: ClassVar[tuple[str, ...]] = ("patience", "weight_decay", "whitened")

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        if self.settings.kernel not in ("rbf", "matern"):
            raise InputError(f'{self.name}: kernel must be "rbf" or "matern", not {self.settings.kernel!r}')

    def _train(self, x: list[FloatArray], flags: tuple[bool, ...], draws: Draws, generator: torch.Generator) -> Answer:
        s: Settings = self.settings
        trajectory = TrajectoryRows(x, flags, s.sort, s.principal)
        blocks = trajectory(x)
        rows = FourierRows(trajectory, blocks, s.features, s.kernel, s.bandwidth, s.whitened, generator)
        return mixture_answer(rows, rows.of(blocks), draws, s, s.components, generator)
