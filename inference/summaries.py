"""Summaries of a trajectory: principal components of its embedding, and kernel regression on them."""

import torch
from torch import Tensor

from .components import PrincipalComponents
from .ridge import KernelRidge

# The regression runs on at most this many draws, evenly spread; its cost grows with their cube.
_REGRESSION_DRAWS = 1000
# Components are weighed by a power of their spread: 0 makes all alike, 1 leaves them as large as they are.
_POWERS = (0.0, 0.5, 1.0)
# A summary beyond the training draws' range by more than this part of it is pulled back: no extrapolation.
_MARGIN = 0.1


class Summaries:
    """Embedded trajectories to features for a density network and a first guess of the parameters.

    Args:
        rows: ``(N, F)`` float64, the embedded trajectories.
        targets: ``(N, D)``.
        weights: ``(N,)`` above zero.
        principal: principal components kept; at most a quarter of the draws.
        shown: of these, how many are features beside the regression.

    Attributes:
        training: features ``(N, D + shown)`` and guesses ``(N, D)`` of the training draws, the guesses made without
            the draw itself.
        residual: ``(D,)`` weighted root mean square error of those guesses.
    """

    def __init__(self, rows: Tensor, targets: Tensor, weights: Tensor, principal: int, shown: int) -> None:
        self.center, self.shown = rows.mean(0), shown
        count = min(principal, max(2, len(targets) // 4))
        self.components = PrincipalComponents(rows - self.center, None, count)
        scores = self.components.scores(rows - self.center)
        self.spread = scores.std(0).clamp(min=1e-12)
        white = scores / self.spread
        low, high = white.amin(0), white.amax(0)
        self.low, self.high = low - _MARGIN * (high - low), high + _MARGIN * (high - low)

        step = -(-len(targets) // _REGRESSION_DRAWS)
        scales = [(self.spread / self.spread[:1]) ** power for power in _POWERS]
        self.fits = [(s, KernelRidge((white * s)[::step], targets[::step], weights[::step])) for s in scales]
        self.choice = [
            min(range(len(self.fits)), key=lambda i: float(self.fits[i][1].score[j])) for j in range(targets.shape[1])
        ]
        guess = self._guess(white)
        for j, i in enumerate(self.choice):
            guess[::step, j] = self.fits[i][1].left_out[:, j]
        error = (weights[:, None] * (targets - guess) ** 2).sum(0) / weights.sum()
        self.residual = error.sqrt().clamp(min=1e-3)
        self.training = (self._features(white, guess), guess)

    def _guess(self, white: Tensor) -> Tensor:
        each = [fit.predict(white * scale) for scale, fit in self.fits]
        return torch.stack([each[i][:, j] for j, i in enumerate(self.choice)], dim=1)

    def _features(self, white: Tensor, guess: Tensor) -> Tensor:
        return torch.cat([guess, white[:, : self.shown]], dim=1)

    def __call__(self, rows: Tensor) -> tuple[Tensor, Tensor]:
        """New rows ``(B, F)`` to features ``(B, D + shown)`` and first guesses ``(B, D)``."""
        white = self.components.scores(rows - self.center) / self.spread
        white = torch.minimum(torch.maximum(white, self.low), self.high)
        guess = self._guess(white)
        return self._features(white, guess), guess
