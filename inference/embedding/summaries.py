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
# A regression that comes nearer to a face of the unit cube, or leaves it, is read as lying this far inside.
_GUESS_EDGE = 0.01
# Draws on a face of the cube would lie at infinity; this is far below what hundreds of draws resolve.
FACE = 1e-4


def probit(unit: Tensor, edge: float = FACE) -> Tensor:
    """Unit cube to probit coordinates, kept ``edge`` away from the faces."""
    z: Tensor = torch.special.ndtri(unit.clamp(edge, 1.0 - edge))
    return z


def picked(each: list[Tensor], choice: list[int]) -> Tensor:
    """Of predictions ``(B, D)`` of several kinds, for each parameter those of the kind chosen for it."""
    return torch.stack([each[i][:, j] for j, i in enumerate(choice)], dim=1)


class BlockSummary:
    """One kind of rows: its principal components, and kernel regression of the parameters on them.

    Args:
        rows: ``(N, F)`` float64.
        targets: ``(N, D)`` in the unit cube.
        weights: ``(N,)`` above zero.
        principal: principal components kept; at most a quarter of the draws.

    Attributes:
        white: ``(N, k)`` components of the training draws, of unit spread.
        guess: ``(N, D)`` regression of the training draws, each made without the draw itself.
        score: ``(D,)`` leave-one-out mean squared error.
    """

    def __init__(self, rows: Tensor, targets: Tensor, weights: Tensor, principal: int) -> None:
        self.center = rows.mean(0)
        count = min(principal, max(2, len(targets) // 4))
        self.components = PrincipalComponents(rows - self.center, None, count)
        scores = self.components.scores(rows - self.center)
        self.spread = (scores**2).mean(0).sqrt().clamp(min=1e-12)
        self.white = scores / self.spread
        low, high = self.white.amin(0), self.white.amax(0)
        self.low, self.high = low - _MARGIN * (high - low), high + _MARGIN * (high - low)

        step = -(-len(targets) // _REGRESSION_DRAWS)
        scales = [(self.spread / self.spread[:1]) ** power for power in _POWERS]
        self.fits = [(s, KernelRidge((self.white * s)[::step], targets[::step], weights[::step])) for s in scales]
        errors = torch.stack([fit.score for _, fit in self.fits])
        self.score, choice = errors.min(0)
        self.choice = choice.tolist()
        self.guess = self._predict(self.white)
        for j, i in enumerate(self.choice):
            self.guess[::step, j] = self.fits[i][1].left_out[:, j]

    def _predict(self, white: Tensor) -> Tensor:
        return picked([fit.predict(white * scale) for scale, fit in self.fits], self.choice)

    def __call__(self, rows: Tensor) -> tuple[Tensor, Tensor]:
        """New rows ``(B, F)`` to components ``(B, k)`` and regressions ``(B, D)``."""
        white = self.components.scores(rows - self.center) / self.spread
        white = torch.minimum(torch.maximum(white, self.low), self.high)
        return white, self._predict(white)


class Summaries:
    """Rows of one or more kinds to features for a density network and a first guess of the parameters.

    The features are the regressions of every kind and the leading components of the first; the first guess of each
    parameter is the regression that had the smaller leave-one-out error. The regression is done on the unit cube,
    where errors weigh alike everywhere, and then taken to probit coordinates.

    Args:
        blocks: rows ``(N, F_b)`` of each kind.
        targets, weights, principal: as of :class:`BlockSummary`.
        shown: components that are features.

    Attributes:
        training: features and guesses ``(N, D)`` of the training draws.
        residual: ``(D,)`` weighted root mean square error of those guesses.
    """

    def __init__(self, blocks: list[Tensor], targets: Tensor, weights: Tensor, principal: int, shown: int) -> None:
        self.blocks = [BlockSummary(rows, targets, weights, principal) for rows in blocks]
        self.choice: list[int] = torch.stack([b.score for b in self.blocks]).argmin(0).tolist()
        self.shown = shown
        self.training = self._combined([(b.white, b.guess) for b in self.blocks])
        error = (weights[:, None] * (probit(targets) - self.training[1]) ** 2).sum(0) / weights.sum()
        self.residual = error.sqrt().clamp(min=1e-3)

    def _combined(self, parts: list[tuple[Tensor, Tensor]]) -> tuple[Tensor, Tensor]:
        guesses = [probit(guess, _GUESS_EDGE) for _, guess in parts]
        return torch.cat([*guesses, parts[0][0][:, : self.shown]], dim=1), picked(guesses, self.choice)

    def __call__(self, blocks: list[Tensor]) -> tuple[Tensor, Tensor]:
        """New rows of each kind to features and first guesses ``(B, D)``."""
        return self._combined([b(rows) for b, rows in zip(self.blocks, blocks, strict=True)])
