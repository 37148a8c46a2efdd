"""What ``npe-rkhs`` reads of recordings: entries, moments, what a time model predicts, kernel means."""

import numpy as np
import torch
from torch import Tensor

from ...core.arrays import FloatArray
from ..embedding.columns import Standard, relevant
from ..embedding.components import PrincipalComponents
from ..embedding.encoder import Encoder
from ..embedding.moments import moments
from ..embedding.summaries import BlockSummary
from .draws import Draws
from .sparse_regression import SparseRegression
from .stacked import Seen
from .trajectory_features import TimePlan, TrajectoryFeatures

# Rows longer than this are read through their principal components.
_SHORT = 256
# Columns that a linear regression reads at most.
_WIDE = 128
# ... and at least this many draws for each of them, but for this many columns.
_DRAWS_EACH, _FEW = 4, 16
# Part of a parameter's variance that a prediction may leave over and still be read.
_KNOWS = 0.9


class Reading:
    """Recordings to columns, standardised, of which those are kept that say something of the parameters.

    Beside each other stand, of every recording: the coordinates of points that correspond; the moments of the set of
    points of every frame (of one-dimensional points that correspond, which may as well be a list of numbers, not);
    and, of sets and of recordings with more than one frame, what a learned time model predicts and the principal
    components of the kernel means of all frames. Other long rows are read through their principal components, too.

    No left-out prediction is read of a regression whose own columns are read beside it: from the two together, each
    draw's parameters could be told exactly.

    Args:
        x: training draws, ``(N, T_r, P, A)`` a recording; NaN = not seen.
        flags: whether points correspond, one a recording.
        draws: their parameters and weights.
        plan: of the time model; None leaves it out.
        principal: principal components of long rows.
        shown: columns shown to networks at most.
        generator: of all that is random.
        device: where the time model is trained.

    Attributes:
        training: of the training draws: the columns that a linear regression is to read, and what kernel regressions
            on the coordinates and kernel means of trajectories predict.
        shown: indices of those that a network is to read.
    """

    def __init__(
        self,
        x: list[FloatArray],
        flags: tuple[bool, ...],
        draws: Draws,
        plan: TimePlan | None,
        principal: int,
        shown: int,
        generator: torch.Generator,
        device: torch.device,
    ) -> None:
        self.flags = flags
        self.encoder = Encoder(x, flags, principal, generator)
        points, seen = self.encoder.points(x)
        self.model: TrajectoryFeatures | None = None
        self.trusted = torch.zeros(0, dtype=torch.long)
        predicted = None
        if plan is not None and not (all(flags) and all(a.shape[1] == 1 for a in x)):
            self.model = TrajectoryFeatures(
                self.encoder, points, seen, draws.latent, draws.weights, plan, generator, device
            )
            predicted = (self.model.training, self.model.frames)
            dim = draws.unit.shape[1]
            left = (self.model.training[:, :dim] - draws.latent).var(0)
            good = torch.nonzero(left < _KNOWS * draws.latent.var(0)).flatten()
            self.trusted = torch.cat([good, dim + good])
        short, long = self._rows(points, seen, predicted)
        self.centers = [rows.mean(0) for rows in long]
        count = min(principal, max(2, len(draws.unit) // 4))
        self.components = [PrincipalComponents(r - c, None, count) for r, c in zip(long, self.centers, strict=True)]
        columns = self._columns(short, long)
        self.standard = Standard(columns)
        standardised = self.standard(columns)
        unit, weights = draws.unit.numpy(), draws.weights.numpy()
        self.kept = relevant(standardised, unit, None, weights, max(_FEW, min(_WIDE, len(unit) // _DRAWS_EACH)))
        kept = standardised[:, self.kept]
        errors = SparseRegression.fit(kept, unit, weights).residual
        self.shown = relevant(kept, unit, errors, weights, shown)
        self.smooth = [
            BlockSummary(rows, draws.unit, draws.weights, principal) for rows in self._whole(points, predicted)
        ]
        guess = None
        if self.smooth:
            self.choice = torch.stack([s.score for s in self.smooth]).argmin(0).tolist()
            guess = self._chosen([s.guess for s in self.smooth])
        self.training = Seen(kept, guess)

    def _rows(
        self, points: list[Tensor], seen: list[Tensor], predicted: tuple[Tensor, Tensor] | None
    ) -> tuple[list[Tensor], list[Tensor]]:
        """Rows read as they are, and those that are not; which is which depends on shapes alone."""
        rows: list[Tensor] = []
        for z, mask, known in zip(points, seen, self.flags, strict=True):
            if known:
                rows.append(z.flatten(1))
            if not known or (z.shape[2] > 2 and z.shape[3] > 1):
                # Gaps of corresponding points are filled in, so all of them count.
                there = np.ones(mask.shape, bool) if known else mask.numpy()
                rows.append(torch.tensor(moments(z.numpy(), there)).flatten(1))
        short, long = [r for r in rows if r.shape[1] <= _SHORT], [r for r in rows if r.shape[1] > _SHORT]
        if predicted is not None:
            short.append(predicted[0][:, self.trusted])
            long.append(predicted[1])
        return short, long

    def _whole(self, points: list[Tensor], predicted: tuple[Tensor, Tensor] | None) -> list[Tensor]:
        """Rows for kernel regressions: all corresponding coordinates, and all kernel means; none without frames."""
        if predicted is None:
            return []
        known = [z.flatten(1) for z, flag in zip(points, self.flags, strict=True) if flag]
        return [predicted[1], torch.cat(known, dim=1)] if known else [predicted[1]]

    def _chosen(self, each: list[Tensor]) -> FloatArray:
        return np.stack([each[i][:, j].numpy() for j, i in enumerate(self.choice)], axis=1)

    def _columns(self, short: list[Tensor], long: list[Tensor]) -> FloatArray:
        projected = [c.scores(r - m) for c, r, m in zip(self.components, long, self.centers, strict=True)]
        return np.asarray(torch.cat([*short, *projected], dim=1).numpy())

    def __call__(self, x: list[FloatArray]) -> Seen:
        """What is read of recordings ``(B, T_r, P, A)``.

        Raises:
            InputError: recordings that do not fit those trained on.
        """
        points, seen = self.encoder.points(x)
        predicted = None if self.model is None else self.model(points, seen)
        columns = self.standard(self._columns(*self._rows(points, seen, predicted)))[:, self.kept]
        rows = self._whole(points, predicted)
        return Seen(columns, self._chosen([s(r)[1] for s, r in zip(self.smooth, rows, strict=True)]) if rows else None)
