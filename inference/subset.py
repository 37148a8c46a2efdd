"""Searches on some of many recordings, which is quicker, and what they lead to held against all."""

from collections.abc import Sequence

import numpy as np

from ..core.arrays import FloatArray
from .polish import EVALUATIONS, Objective, Polished, polish

#: Recordings that are enough to search on, evenly spread, where there are at least twice as many.
ENOUGH = 10


def some_of(recordings: Sequence[str]) -> list[str]:
    """Those to search on; none where they would be most of ``recordings``."""
    if len(recordings) < 2 * ENOUGH:
        return []
    return [recordings[k] for k in np.linspace(0, len(recordings) - 1, ENOUGH).round().astype(int)]


def on_some(objective: Objective) -> Objective:
    """The same of as many recordings as are enough to search on; itself where these would be most."""
    names = some_of(objective.recordings)
    return objective.on(names) if names else objective


def on_all(
    objective: Objective,
    some: Objective,
    best: Polished,
    near: FloatArray | None = None,
    evaluations: int = EVALUATIONS,
) -> Polished:
    """A fit to some recordings as one to all; with ``near (D,)``, no worse than there."""
    if some is objective:
        return best
    start = best.unit
    if near is not None:
        there, here = (float(w @ w) for w in (objective.one(near), objective.one(start)))
        start = near if there < here else start
    return polish(objective, start, evaluations)
