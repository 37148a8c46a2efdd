"""What the next experiment is for: models to be told apart, or effects to be seen at all."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from ....core.arrays import FloatArray
from .rivals import Rival, leads_of
from .telling import View, named_right, probability_of, reduced, repeated, score

Purpose = Literal["tied", "unseen", "nothing"]
#: As many takes of a motion are considered.
MOST_TAKES = 20


@dataclass(frozen=True, eq=False)
class Goal:
    """What is asked of a motion.

    Args:
        purpose: ``"tied"``: the worst pair of models counts; ``"unseen"``: each model after the first is that one
            with an effect of typical strength, and how many of these would be seen counts.
        models: see there.
        thresholds: in -2 log likelihood, ``(M, M)`` by truth and rival.
    """

    purpose: Purpose
    models: tuple[Rival, ...]
    thresholds: FloatArray

    @property
    def leads(self) -> FloatArray:
        return leads_of(self.models)

    @property
    def names(self) -> tuple[str, ...]:
        """The effects that it is about."""
        return tuple(m.name for m in (self.models if self.purpose == "tied" else self.models[1:]))

    def decided(self) -> str | None:
        """Why no motion is needed, if one of the models is ahead of all others by more than the threshold already."""
        if self.purpose != "tied":
            return None
        ahead = self.leads + np.where(np.eye(len(self.models), dtype=bool), np.inf, 0.0)
        best = int(np.argmax(ahead.min(axis=1)))
        if not (ahead[best] > self.thresholds[best]).all():
            return None
        rivals = " and ".join(m.name for k, m in enumerate(self.models) if k != best)
        return (
            f"the recordings tell them apart already: {self.models[best].name} fits better than {rivals}, by "
            f"{ahead[best].min():.0f} in -2 log likelihood"
        )

    def value(self, views: Sequence[View]) -> float:
        """How good a motion is; more is better."""
        scores = score(views, self.leads, self.thresholds)
        if self.purpose == "tied":
            return float(scores.min())
        # the number of effects seen; beyond that, by how much they are
        seen = scores[1:, 0]
        return float(probability_of(seen).sum() + 1e-3 * np.clip(seen, -100, 100).mean())

    def bound(self, points: FloatArray, noise_sd: float) -> float:
        """What :meth:`value` would be if no parameter gave way, which puts motions in order.

        Args:
            points: that the models predict ``(M, T, P, A)`` [m].
            noise_sd: of one independent number [m].
        """
        flat = points.reshape(len(points), -1) / noise_sd
        nothing = np.zeros((flat.shape[1], 0))
        return self.value([View(p, nothing) for p in flat])

    def probabilities(self, views: Sequence[View], takes: int = 1) -> FloatArray:
        """For each name the probability that it would be named, or seen, if it is there ``(len(names),)``."""
        many = repeated(reduced(views), takes)
        if self.purpose == "tied":
            return named_right(many, self.leads, self.thresholds)
        pairs = [
            named_right([many[0], many[k]], np.zeros((2, 2)), self.thresholds[np.ix_([0, k], [0, k])])[1]
            for k in range(1, len(many))
        ]
        return np.array(pairs)

    def takes_for(self, views: Sequence[View], wanted: float) -> int | None:
        """How many takes of a motion bring every probability to ``wanted``; None if :data:`MOST_TAKES` do not."""
        for takes in range(1, MOST_TAKES + 1):
            if self.probabilities(views, takes).min() >= wanted:
                return takes
        return None
