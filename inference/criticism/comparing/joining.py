"""Recordings that were fitted in pieces, told of as the recordings that they are."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ....core.rollout import Trajectory
from ....core.series import PointSeries
from ....core.study.windows import joined
from .held import Held


def rejoined(takes: Sequence[Held], cut_from: Mapping[str, str]) -> list[Held]:
    """``takes``, with the pieces of a recording put together: each is predicted from where it starts.

    Args:
        takes: pieces of a recording in order.
        cut_from: by piece the recording that it is of.
    """
    whole = [cut_from.get(h.name, h.name) for h in takes]
    scenarios = joined({h.name: h.scenario for h in takes}, cut_from)
    out = []
    for name in dict.fromkeys(whole):
        pieces = [h for h, of in zip(takes, whole, strict=True) if of == name]
        first, draws = pieces[0], min(len(h.draws) for h in pieces)
        if len(pieces) == 1 and first.name == name:
            out.append(first)
            continue
        out.append(
            replace(
                first,
                recording=replace(first.recording, name=name, series=_series([h.recording.series for h in pieces])),
                scenario=scenarios[name],
                best=_trajectory([h.best for h in pieces]),
                shown=_trajectory([h.shown for h in pieces]),
                residual=replace(
                    first.residual,
                    difference=np.concatenate([h.residual.difference for h in pieces]),
                    white=np.concatenate([h.residual.white for h in pieces]),
                    clock=float(np.mean([h.residual.clock for h in pieces])),
                ),
                draws=np.concatenate([h.draws[:draws] for h in pieces], axis=1),
                baseline=np.concatenate([h.baseline for h in pieces]),
                unfitted=np.concatenate([h.unfitted for h in pieces]),
            )
        )
    return out


def _series(parts: Sequence[PointSeries]) -> PointSeries:
    time = np.concatenate([p.time for p in parts])
    return replace(parts[0], time=time, points=np.concatenate([p.points for p in parts]))


def _trajectory(parts: Sequence[Trajectory]) -> Trajectory:
    return replace(
        parts[0],
        series=_series([p.series for p in parts]),
        vertices=np.concatenate([p.vertices for p in parts]),
        poses=np.concatenate([p.poses for p in parts]),
        seconds=sum(p.seconds for p in parts),
    )
