"""Takes of the same motion: simulated once, observed as often as they were recorded, and seen as one."""

from collections.abc import Mapping, Sequence

import numpy as np

from ...core.arrays import FloatArray, IntArray
from ...core.scenario import Scenario
from ..noise import Noise
from ..observe import Observer

#: Draws that are observed at a time; bounds the memory that sixteen takes need.
_CHUNK = 64


class Takes:
    """Recordings grouped by the rollout that is simulated for them.

    Takes of one motion differ in their noise alone, so one rollout serves them all: it is given the flaws of each
    take, and the takes are seen together: points that correspond as their mean over the takes in which each was seen,
    unordered ones as one larger set. The measured takes are put together in the same way, so what an estimator
    learns is the posterior given all of them. Where the noise is Gaussian the mean holds all that the takes say:
    standard deviations fall with the root of their number.

    Args:
        observer: of all recordings.
        scenarios: by recording.
    """

    def __init__(self, observer: Observer, scenarios: Mapping[str, Scenario]) -> None:
        self._observer = observer
        self._groups: list[list[int]] = []
        recordings = observer.recordings
        for i, recording in enumerate(recordings):
            for group in self._groups:
                first = recordings[group[0]]
                alike = first.series.correspondence == recording.series.correspondence
                if alike and scenarios[first.name].same_rollout(scenarios[recording.name]):
                    group.append(i)
                    break
            else:
                self._groups.append([i])
        # coordinates that no take of a motion has, as those of a video of heights: the same nothing in every draw
        missing = [~np.isfinite(p).any(axis=(0, 1)) for p in observer.measured()]
        self._unmeasured = [np.all([missing[i] for i in group], axis=0) for group in self._groups]

    @property
    def simulated(self) -> list[str]:
        """Of every group the recording whose scenario is simulated."""
        return [self._observer.recordings[group[0]].name for group in self._groups]

    def of(self, name: str) -> str:
        """The recording that is simulated for the one of this name."""
        for group, first in zip(self._groups, self.simulated, strict=True):
            if name in (self._observer.recordings[i].name for i in group):
                return first
        raise KeyError(name)

    @property
    def correspondence(self) -> list[bool]:
        """Of every group, whether its points correspond."""
        return [self._observer.recordings[group[0]].series.correspondence for group in self._groups]

    def observe(self, points: Sequence[FloatArray], numbers: IntArray, seed: int) -> list[FloatArray]:
        """Flawed copies of clean draws, one array ``(N, T, P, A)`` a group; see :meth:`Observer.observe`."""
        where = {i: g for g, group in enumerate(self._groups) for i in group}
        parts = []
        for start in range(0, len(numbers), _CHUNK):
            rows = slice(start, start + _CHUNK)
            each = [points[where[i]][rows] for i in range(len(where))]
            parts.append(self._together(self._observer.observe(each, numbers[rows], seed)))
        return [np.concatenate(p) for p in zip(*parts, strict=True)]

    def clean(self, points: Sequence[FloatArray]) -> list[FloatArray]:
        """Clean draws, ``(N, T, P, A)`` a group, without what no take of the motion has measured."""
        return [np.where(unmeasured, 0.0, p) for unmeasured, p in zip(self._unmeasured, points, strict=True)]

    @property
    def noise(self) -> Noise:
        """That draws are given."""
        return self._observer.noise

    def measured(self) -> list[FloatArray]:
        """The real thing in the same form, ``(T, P, A)`` a group."""
        return self._together(self._observer.measured())

    def _together(self, each: Sequence[FloatArray]) -> list[FloatArray]:
        """One array a group of one array a recording, ``(..., T, P, A)``."""
        out = []
        for group, corresponding in zip(self._groups, self.correspondence, strict=True):
            if len(group) == 1:
                out.append(each[group[0]])
            elif not corresponding:
                out.append(np.concatenate([each[i] for i in group], axis=-2))
            else:
                takes = np.stack([each[i] for i in group])
                seen = np.isfinite(takes)
                total, count = np.where(seen, takes, 0.0).sum(axis=0), seen.sum(axis=0)
                out.append(np.where(count > 0, total / np.maximum(count, 1), np.nan))
        return [np.where(unmeasured, 0.0, a) for unmeasured, a in zip(self._unmeasured, out, strict=True)]
