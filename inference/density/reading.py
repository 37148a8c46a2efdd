"""What ``npe-rkhs`` knows of recordings: entries, moments, what a time model predicts, kernel means."""

import numpy as np
import torch
from torch import Tensor

from ...core.arrays import FloatArray
from ..embedding.encoder import Encoder
from ..embedding.moments import moments
from .draws import Draws
from .trajectory_features import TimePlan, TrajectoryFeatures
from .view import Known

# Rows longer than this are read through their principal components.
_SHORT = 256
# Part of a parameter's variance that a prediction may leave over and still be read.
_KNOWS = 0.9


class Reading:
    """Recordings to columns and rows; which of them say something of the parameters, a :class:`~.view.View` finds.

    Beside each other stand, of every recording: the coordinates of points that correspond; the moments of the set of
    points of every frame (of one-dimensional points that correspond, which may as well be a list of numbers, not);
    and, of sets and of recordings with more than one frame, what a learned time model predicts and the principal
    components of the kernel means of all frames. Other long rows are read through their principal components, too.

    Args:
        x: training draws, ``(N, T_r, P, A)`` a recording; NaN = not seen.
        flags: whether points correspond, one a recording.
        draws: their parameters and weights.
        plan: of the time model; None leaves it out.
        principal: principal components that gaps are filled in from.
        generator: of all that is random.
        device: where the time model is trained.

    Attributes:
        training: of the training draws.
    """

    def __init__(
        self,
        x: list[FloatArray],
        flags: tuple[bool, ...],
        draws: Draws,
        plan: TimePlan | None,
        principal: int,
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
        self.training = self._known(points, seen, predicted)

    def _known(self, points: list[Tensor], seen: list[Tensor], predicted: tuple[Tensor, Tensor] | None) -> Known:
        short, long = self._rows(points, seen, predicted)
        none = torch.zeros(len(points[0]), 0, dtype=torch.float64)
        return Known(torch.cat([none, *short], dim=1), long, self._whole(points, predicted))

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

    def __call__(self, x: list[FloatArray]) -> Known:
        """What is known of recordings ``(B, T_r, P, A)``.

        Raises:
            InputError: recordings that do not fit those trained on.
        """
        points, seen = self.encoder.points(x)
        return self._known(points, seen, None if self.model is None else self.model(points, seen))
