"""What a density reads, chosen and learned from some of the draws alone."""

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from ...core.arrays import BoolArray, FloatArray, IntArray
from ..embedding.columns import Standard, relevant
from ..embedding.components import PrincipalComponents
from ..embedding.summaries import BestGuess
from .draws import Draws
from .first_guess import FirstGuess

# Columns that a linear regression reads at most.
_WIDE = 128
# ... and at least this many draws for each of them, but for this many columns.
_DRAWS_EACH, _FEW = 4, 16


@dataclass(frozen=True, eq=False)
class Known:
    """What is known of draws, or of measurements, before other draws are looked at.

    Args:
        short: ``(N, F)`` columns.
        long: rows ``(N, F_l)`` of several kinds, to be read through their principal components.
        whole: rows ``(N, F_w)`` of several kinds for kernel regressions; empty where there is no trajectory.
    """

    short: Tensor
    long: list[Tensor]
    whole: list[Tensor]

    def among(self, rows: BoolArray) -> "Known":
        """Those of some rows, bool ``(N,)``."""
        kept = torch.tensor(rows)
        return Known(self.short[kept], [r[kept] for r in self.long], [r[kept] for r in self.whole])


@dataclass(frozen=True, eq=False)
class Seen:
    """What a density reads of draws, or of a measurement.

    Args:
        columns: ``(N, F)`` standardised features.
        guess: ``(N, D)`` predictions of the parameters in the unit cube, of draws that made them each without the
            draw; None where there are none. No network reads them.
    """

    columns: FloatArray
    guess: FloatArray | None


class View:
    """The columns that say something of the parameters, and kernel regressions, as some of the draws have it.

    Args:
        known: of these draws.
        draws: their parameters and weights.
        principal: principal components of long rows.
        shown: columns shown to networks at most.

    Attributes:
        training: of these draws.
        first: the first guess on the cube.
        shown: numbers of the columns that a network is to read.
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
        self.smooth = BestGuess(known.whole, draws.unit, draws.weights, principal) if known.whole else None
        guess = None if self.smooth is None else self.smooth.left_out.numpy()
        self.training = Seen(columns[:, self.kept], guess)
        self.first = FirstGuess.fit(self.training.columns, unit, weights, guess)
        self.shown: IntArray = relevant(self.training.columns, unit, self.first.residual, weights, shown)

    def _columns(self, known: Known) -> FloatArray:
        projected = [c.scores(r - m) for c, r, m in zip(self.components, known.long, self.centers, strict=True)]
        return np.asarray(torch.cat([known.short, *projected], dim=1).numpy())

    def __call__(self, known: Known) -> Seen:
        """What is read of others."""
        columns = self.standard(self._columns(known))[:, self.kept]
        return Seen(columns, None if self.smooth is None else self.smooth(known.whole)[1].numpy())

    def context(self, seen: Seen, width: int) -> FloatArray:
        """``(N, width)``, what networks read; zeros where there are fewer columns."""
        columns = seen.columns[:, self.shown]
        return np.pad(columns, ((0, 0), (0, width - columns.shape[1])))
