"""Options of the estimators on kernel mean embeddings, ``bayessim-rkhs`` and ``bayeszoom-rkhs``."""

from dataclasses import dataclass
from typing import Any

from ..density.kernel_mean import LayerPlan
from ..density.members import Plan


@dataclass(frozen=True)
class RKHSSettings:
    """Options that both have, with the default for small budgets on two cores.

    Args:
        features: M, random Fourier features of the RKHS layer.
        bandwidth: where the learned bandwidth starts [standardised coordinates].
        size: whether the size of a set stands beside its mean.
        hidden: widths of the fully connected layers on trajectories.
        learning_rate: of Adam, for the network on trajectories.
        max_epochs, patience: of the network on trajectories; patience 0 trains all epochs on all draws.
        batch: draws a gradient step.
        frames: frames a recording the trajectory network sees, evenly spread; 0 for all.
        points: points a frame it sees, evenly spread in their sorted order; 0 for all.
        summaries: whether the posterior comes from the second stage, on summaries of all frames.
        principal: principal components kept of each kind of summary.
        shown: of these, how many the second stage's networks read beside the regression.
        summary_hidden, summary_learning_rate, summary_decay, summary_epochs, summary_patience, summary_batch: of
            the second stage.
        members: networks of the second stage, each leaving another part of the draws out.
        threads: torch threads during training.
    """

    features: int = 64
    bandwidth: float = 1.0
    size: bool = True
    hidden: tuple[int, ...] = (64,)
    learning_rate: float = 3e-3
    max_epochs: int = 25
    patience: int = 8
    batch: int = 64
    frames: int = 8
    points: int = 64
    summaries: bool = True
    principal: int = 40
    shown: int = 8
    summary_hidden: tuple[int, ...] = (32, 32)
    summary_learning_rate: float = 3e-3
    summary_decay: float = 1e-4
    summary_epochs: int = 200
    summary_patience: int = 15
    summary_batch: int = 128
    members: int = 5
    threads: int = 1

    @property
    def layer(self) -> LayerPlan:
        """How the RKHS layer is learned."""
        return LayerPlan(
            self.features, self.bandwidth, self.hidden, self.learning_rate, self.max_epochs, self.patience,
            self.batch, self.frames, self.points, self.size,
        )  # fmt: skip

    @property
    def plan(self) -> Plan:
        """How the networks of the second stage are trained."""
        return Plan(
            self.summary_hidden, self.members, self.summary_learning_rate, self.summary_decay, self.summary_batch,
            self.summary_epochs, self.summary_patience,
        )  # fmt: skip


@dataclass(frozen=True)
class Settings(RKHSSettings):
    """Options of ``bayessim-rkhs``.

    Args:
        components: Gaussians of a mixture.
    """

    components: int = 4


# 3 x 1024, Adam at 1e-6, embedding and density trained as one network on all frames: the paper's. It names no number
# of updates and no number of features; bayes-sim-ig runs 10 000 updates, MDRFF has 200.
PAPER: dict[str, Any] = {
    "features": 200,
    "size": False,
    "hidden": (1024, 1024, 1024),
    "learning_rate": 1e-6,
    "max_epochs": 2000,
    "patience": 0,
    "frames": 0,
    "points": 0,
    "summaries": False,
}

PRESETS: dict[str, Settings] = {"default": Settings(), "paper": Settings(**PAPER)}
