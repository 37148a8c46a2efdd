"""What a density reads of recordings, chosen and learned from some of the draws alone."""

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from ...core.arrays import FloatArray, IntArray
from ..embedding.columns import Standard, relevant
from ..embedding.components import PrincipalComponents
from ..embedding.summaries import BlockSummary, picked
from .draws import Draws
from .first_guess import FirstGuess

# Columns that a linear regression reads at most.
_WIDE = 128
# ... and at least this many draws for each of them, but for this many columns.
_DRAWS_EACH, _FEW = 4, 16


@dataclass(frozen=True, eq=False)
class Known:
    """What is known of draws, or of a measurement, before parameters are looked at.

    Args:
        short: ``(N, F)`` columns.
        long: rows ``(N, F_l)`` of several kinds, to be read through their principal components.
        whole: rows ``(N, F_w)`` of several kinds for kernel regressions; none where there is no trajectory.
    """

    short: Tensor
    long: list[Tensor]
    whole: list[Tensor]

    def among(self, rows: Tensor) -> "Known":
        """Those of some rows, bool ``(N,)``."""
        return Known(self.short[rows], [r[rows] for r in self.long], [r[rows] for r in self.whole])


@dataclass(frozen=True, eq=False)
class Seen:
    """What a density reads of draws, or of a measurement.

    Args:
        columns: ``(N, F)`` standardised features.
        guess: ``(N, D)`` predictions of the parameters in the unit cube, of draws that they were learned from each
            made without the draw; None where there are none. No network reads them.
    """

    columns: FloatArray
    guess: FloatArray | None


class View:
    """The columns that say something of the parameters, and kernel regressions, as some of the draws have it.

    A draw that is to stand for a measurement must be none of these draws: columns are chosen by what they happen to
    have in common with their parameters, and they lie further out along the principal components made from them than
    others do, the more so the longer the rows.

    No network reads a left-out prediction beside the columns of its regression: from the two together, each draw's
    parameters could be told exactly.

    Args:
        known: of these draws.
        draws: their parameters and weights.
        principal: principal components of long rows.
        shown: columns shown to networks at most.

    Attributes:
        training: what is read of these draws.
        first: the first guess on the unit cube.
        shown: indices of the columns that a network is to read.
    """

    def __init__(self, known: Known, draws: Draws, principal: int, shown: int) -> None:
        unit, weights = draws.unit.numpy(), draws.weights.numpy()
        self.centers = [rows.mean(0) for rows in known.long]
        count = min(principal, max(2, len(unit) // 4))
        self.components = [
            PrincipalComponents(r - c, None, count) for r, c in zip(known.long, self.centers, strict=True)
        ]
        rows = self._columns(known)
        self.standard = Standard(rows)
        columns = self.standard(rows)
        most = max(_FEW, min(_WIDE, len(unit) // _DRAWS_EACH))
        self.kept: IntArray = relevant(columns, unit, None, weights, most)
        self.smooth = [BlockSummary(rows, draws.unit, draws.weights, principal) for rows in known.whole]
        self.training = Seen(columns[:, self.kept], self._guess([s.guess for s in self.smooth]))
        self.first = FirstGuess.fit(self.training.columns, unit, weights, self.training.guess)
        self.shown: IntArray = relevant(self.training.columns, unit, self.first.residual, weights, shown)

    def _columns(self, known: Known) -> FloatArray:
        projected = [c.scores(r - m) for c, r, m in zip(self.components, known.long, self.centers, strict=True)]
        return np.asarray(torch.cat([known.short, *projected], dim=1).numpy())

    def _guess(self, each: list[Tensor]) -> FloatArray | None:
        if not each:
            return None
        return np.asarray(picked(each, torch.stack([s.score for s in self.smooth]).argmin(0).tolist()).numpy())

    def __call__(self, known: Known) -> Seen:
        """What is read of others."""
        columns = self.standard(self._columns(known))[:, self.kept]
        return Seen(columns, self._guess([s(rows)[1] for s, rows in zip(self.smooth, known.whole, strict=True)]))

    def context(self, seen: Seen, width: int) -> FloatArray:
        """``(N, width)``, what a network reads; zeros where it is wider than the columns shown."""
        columns = seen.columns[:, self.shown]
        return np.pad(columns, ((0, 0), (0, width - columns.shape[1])))
