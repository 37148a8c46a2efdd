"""Where the error was that an effect takes away."""

from typing import Any

import numpy as np

from ...core.measurement import Recording
from .before_after import BeforeAfter

#: Share of what is taken away that the told span of time holds.
_MOST = 0.6


def where_it_is(pair: BeforeAfter, recordings: dict[str, Recording]) -> dict[str, Any] | None:
    """The recording with most of what is taken away, the shortest span that holds most of it, and the point.

    Returns:
        ``recording``, ``share`` of it, ``from`` and ``to`` [s], ``point`` (None without correspondence) and
        ``peak`` [s], when the error was largest before; None where nothing is taken away.
    """
    gains = {}
    for name, take in pair.takes.items():
        before, after = (np.nan_to_num(r.difference**2) for r in take.residuals)
        gains[name] = before - after
    total = sum(max(float(g.sum()), 0.0) for g in gains.values())
    if not gains or total <= 0:
        return None
    name = max(gains, key=lambda n: float(gains[n].sum()))
    series = recordings[name].series
    by_time = np.maximum(gains[name].sum(axis=(1, 2)), 0.0)
    start, stop = _shortest(by_time)
    error = pair.takes[name].residuals[0].by_time
    return {
        "recording": name,
        "share": float(gains[name].sum()) / total,
        "from": float(series.time[start]),
        "to": float(series.time[stop]),
        "point": int(np.argmax(gains[name].sum(axis=(0, 2)))) if series.correspondence else None,
        "peak": float(series.time[int(np.nanargmax(error))]),
    }


def _shortest(weights: np.ndarray) -> tuple[int, int]:
    """First and last index of the shortest run that holds :data:`_MOST` of the weights."""
    sums = np.concatenate([[0.0], np.cumsum(weights)])
    best = (0, len(weights) - 1)
    stop = 0
    for start in range(len(weights)):
        while stop < len(weights) and sums[stop + 1] - sums[start] < _MOST * sums[-1]:
            stop += 1
        if stop >= len(weights):
            break
        if stop - start < best[1] - best[0]:
            best = (start, stop)
    return best
