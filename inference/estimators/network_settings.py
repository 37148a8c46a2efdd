"""Options that estimators with networks on rows of numbers share."""

from dataclasses import dataclass
from typing import Any

from ..density.members import Plan


@dataclass(frozen=True)
class NetworkSettings:
    """Options of networks on summaries, with the default for small budgets on two cores.

    Args:
        summaries: whether the networks read principal components and regressions of the rows
            (:mod:`~..embedding.summaries`), and correct the regression; else they read the standardised rows.
        principal: principal components kept of each kind of row.
        shown: of these, how many the networks read beside the regression.
        hidden: widths of the fully connected layers.
        learning_rate, weight_decay, batch, max_epochs, patience: of the training; patience 0 trains one network for
            all epochs on all draws.
        members: networks, each leaving another part of the draws out.
        sort: whether frames of recordings without correspondence are put in lexicographic order before their points
            are read by place.
        threads: torch threads during training.
    """

    summaries: bool = True
    principal: int = 40
    shown: int = 8
    hidden: tuple[int, ...] = (64, 64)
    learning_rate: float = 3e-3
    weight_decay: float = 1e-4
    batch: int = 128
    max_epochs: int = 200
    patience: int = 15
    members: int = 5
    sort: bool = True
    threads: int = 1

    @property
    def plan(self) -> Plan:
        """How the networks are trained."""
        return Plan(
            self.hidden, self.members, self.learning_rate, self.weight_decay, self.batch, self.max_epochs, self.patience
        )


#: What the paper says of its networks: 3 x 1024, Adam at 1e-6. It names no number of updates; bayes-sim-ig runs
#: 10 000, which at this rate would leave the network where it began.
PAPER: dict[str, Any] = {
    "summaries": False,
    "hidden": (1024, 1024, 1024),
    "learning_rate": 1e-6,
    "weight_decay": 0.0,
    "batch": 64,
    "max_epochs": 2000,
    "patience": 0,
    "sort": False,
}
