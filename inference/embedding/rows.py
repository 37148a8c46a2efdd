"""Recordings as rows of numbers: what an estimator reads of a draw before any density is trained."""

from abc import ABC, abstractmethod

import numpy as np
import torch
from torch import Tensor

from ...core.arrays import FloatArray
from ...core.errors import InputError
from .encoder import Encoder
from .points import canonical


class Rows(ABC):
    """Recordings to blocks of rows. What it knows, it learned from the training draws."""

    @abstractmethod
    def __call__(self, x: list[FloatArray]) -> list[Tensor]:
        """Recordings ``(N, T_r, P, A)`` to one or more blocks ``(N, F_b)``, float64.

        Raises:
            InputError: recordings that do not fit those trained on.
        """


class TrajectoryRows(Rows):
    """The standardised coordinates of every point in every frame, side by side: order matters.

    Column p is the p-th point, so this suits points that correspond. Of sets it can read the order in which they
    come, or put every frame in lexicographic order first; either way the number of points is that of training: fewer
    are filled up as unseen, and of more as many are taken, evenly along that order. Gaps are filled in from the other
    markers and frames.

    Args:
        x: training draws, ``(N, T_r, P, A)`` a recording.
        correspondence: one flag a recording.
        sort: whether frames of recordings without correspondence are put in order.
        principal: principal components used to fill in gaps.
    """

    def __init__(self, x: list[FloatArray], correspondence: tuple[bool, ...], sort: bool, principal: int) -> None:
        self.sorted = [sort and not c for c in correspondence]
        self.sets = [not c for c in correspondence]
        self.points = [a.shape[2] for a in x]
        # The encoder's codes are for kernels; none is drawn from here.
        self.encoder = Encoder(self._ordered(x), (True,) * len(x), principal, torch.Generator().manual_seed(0))

    def _ordered(self, x: list[FloatArray]) -> list[FloatArray]:
        return [_in_order(a) if wanted else a for a, wanted in zip(x, self.sorted, strict=True)]

    def coordinates(self, x: list[FloatArray]) -> list[Tensor]:
        """Standardised points ``(N, T_r, P, A)`` without gaps."""
        if len(x) != len(self.points):
            raise InputError(f"the estimator was trained on {len(self.points)} recordings, but got {len(x)}")
        filled = [self._filled_up(r, a) for r, a in enumerate(x)]
        return self.encoder.points(self._ordered(filled))[0]

    def _filled_up(self, r: int, a: FloatArray) -> FloatArray:
        missing = self.points[r] - a.shape[2]
        if not self.sets[r] or missing == 0:
            return a
        if missing < 0:
            return _thinned(_in_order(a) if self.sorted[r] else a, self.points[r])
        return np.concatenate([a, np.full((*a.shape[:2], missing, a.shape[3]), np.nan)], axis=2)

    def __call__(self, x: list[FloatArray]) -> list[Tensor]:
        return [torch.cat([z.flatten(1) for z in self.coordinates(x)], dim=1)]


def _in_order(a: FloatArray) -> FloatArray:
    """The points of every frame of ``(N, T, P, A)`` in lexicographic order, those not seen last."""
    seen = np.asarray(np.isfinite(a).all(axis=3))
    z, seen = canonical(np.where(seen[..., None], a, 0.0), seen)
    return np.where(seen[..., None], z, np.nan)


def _thinned(a: FloatArray, count: int) -> FloatArray:
    """Of the points that are seen in each frame of ``(N, T, P, A)`` as many as ``count``, evenly along their order."""
    seen = np.isfinite(a).all(axis=3)
    first = np.argsort(~seen, axis=2, kind="stable")  # those that are seen, as they come
    number = seen.sum(axis=2)[..., None]
    places = np.arange(count)
    evenly = np.round(places * (number - 1) / max(count - 1, 1)).astype(np.int64)
    chosen = np.take_along_axis(first, np.where(number > count, evenly, places), axis=2)
    return np.take_along_axis(a, chosen[..., None], axis=2)
