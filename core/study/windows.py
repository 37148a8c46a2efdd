"""Recordings in pieces that start as measured one after the other: multiple shooting."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from ..errors import InputError
from ..measurement import Recording
from ..scenario import Scenario

#: A piece has so many frames at least.
_FEWEST = 10


def cut_up(recording: Recording, length: float) -> list[Recording]:
    """``recording`` cut into pieces of about ``length`` [s], all of the same share of it.

    Small errors grow in what moves fast, until what a model does after seconds is left to chance, whatever its
    parameters; a piece ends before that. Each starts in the first frame that shows every point, from where its share
    begins.

    References:
        Bock, *Recent advances in parameter identification techniques for ODE*, 1983.

    Raises:
        InputError: a piece would have too few frames.
    """
    series = recording.series
    time = series.time - series.time[0]
    count = max(1, round(float(time[-1]) / length))
    seen = np.isfinite(series.points).all(axis=(1, 2))
    starts = []
    for k in range(count):
        found = np.flatnonzero(seen & (time >= k * time[-1] / count - 1e-9))
        if len(found) and found[0] not in starts:
            starts.append(int(found[0]))
    parts = list(pairwise([*starts, len(time)]))
    if not parts or min(end - start for start, end in parts) < _FEWEST:
        raise InputError(
            f"[study.window]: recording {recording.name!r} has pieces of fewer than {_FEWEST} frames in {length:g} s; "
            "choose longer ones, or start the recording where all points are seen"
        )
    return [
        replace(
            recording,
            name=f"{recording.name} from {time[a]:.3g} s",
            motion=f"{recording.motion} from {time[a]:.3g} s",
            series=replace(series, time=series.time[a:b], points=series.points[a:b]),
        )
        for a, b in parts
    ]


def cut_all(recordings: Sequence[Recording], length: float | None) -> tuple[list[Recording], dict[str, Recording]]:
    """Pieces of all, and by piece the recording that it is of; without a length the same recordings, and none."""
    if length is None:
        return list(recordings), {}
    pieces = [(piece, r) for r in recordings for piece in cut_up(r, length)]
    return [piece for piece, _ in pieces], {piece.name: r for piece, r in pieces}


def joined(scenarios: Mapping[str, Scenario], cut_from: Mapping[str, str]) -> dict[str, Scenario]:
    """By recording, from where its first piece starts to where its last one ends: what was moved in one go.

    Args:
        scenarios: of recordings and pieces, those of a recording in order.
        cut_from: by piece the recording that it is of.
    """
    out: dict[str, Scenario] = {}
    for name, scenario in scenarios.items():
        whole = cut_from.get(name, name)
        before = [out[whole].times] if whole in out else []
        out[whole] = replace(out.get(whole, scenario), times=np.concatenate([*before, scenario.times]))
    return out
