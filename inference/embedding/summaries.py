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


class Whitened:
    """Principal components of one kind of rows, of unit spread.

    Rows that the components were made from lie further out along them than others do, the more so the fewer they are
    for their length. So a draw that is to stand for a measurement must not have been among them, though no
    parameters are looked at.

    Args:
        rows: ``(N, F)`` float64, of the training draws.
        principal: principal components kept; at most a quarter of the draws.

    Attributes:
        training: ``(N, k)`` of the training draws.
        spread: ``(k,)``, how large they were.
    """

    def __init__(self, rows: Tensor, principal: int) -> None:
        self.center = rows.mean(0)
        count = min(principal, max(2, len(rows) // 4))
        self.components = PrincipalComponents(rows - self.center, None, count)
        scores = self.components.scores(rows - self.center)
        self.spread = (scores**2).mean(0).sqrt().clamp(min=1e-12)
        self.training = scores / self.spread
        low, high = self.training.amin(0), self.training.amax(0)
        self.low, self.high = low - _MARGIN * (high - low), high + _MARGIN * (high - low)

    def __call__(self, rows: Tensor) -> Tensor:
        """New rows ``(B, F)`` to components ``(B, k)``."""
        white = self.components.scores(rows - self.center) / self.spread
        return torch.minimum(torch.maximum(white, self.low), self.high)


class KernelGuess:
    """Kernel regression of the parameters on components of rows.

    Args:
        rows: ``(n, F)`` of the draws it may know, float64.
        targets: ``(n, D)`` in the unit cube.
        weights: ``(n,)`` above zero.
        principal: as of :class:`Whitened`.

    Attributes:
        white: the components.
        left_out: ``(n, D)`` regression of these draws, each made without the draw itself.
        score: ``(D,)`` leave-one-out mean squared error.
    """

    def __init__(self, rows: Tensor, targets: Tensor, weights: Tensor, principal: int) -> None:
        self.white = Whitened(rows, principal)
        white, spread = self.white.training, self.white.spread
        step = -(-len(targets) // _REGRESSION_DRAWS)
        scales = [(spread / spread[:1]) ** power for power in _POWERS]
        self.fits = [(s, KernelRidge((white * s)[::step], targets[::step], weights[::step])) for s in scales]
        errors = torch.stack([fit.score for _, fit in self.fits])
        self.score, choice = errors.min(0)
        self.choice = choice.tolist()
        self.left_out = self(white)
        for j, i in enumerate(self.choice):
            self.left_out[::step, j] = self.fits[i][1].left_out[:, j]

    def __call__(self, white: Tensor) -> Tensor:
        """Components ``(B, k)`` to regressions ``(B, D)``."""
        each = [fit.predict(white * scale) for scale, fit in self.fits]
        return torch.stack([each[i][:, j] for j, i in enumerate(self.choice)], dim=1)


class BestGuess:
    """Kernel regressions on every kind of rows, of which each parameter takes the one of smaller left-out error.

    Args:
        blocks: rows ``(n, F_b)`` of each kind.
        targets, weights, principal: as of :class:`KernelGuess`.

    Attributes:
        leading: ``(n, k)`` components of the first kind.
        left_out: ``(n, D)``, as of :class:`KernelGuess`.
    """

    def __init__(self, blocks: list[Tensor], targets: Tensor, weights: Tensor, principal: int) -> None:
        self.guesses = [KernelGuess(rows, targets, weights, principal) for rows in blocks]
        self.choice: list[int] = torch.stack([g.score for g in self.guesses]).argmin(0).tolist()
        self.leading = self.guesses[0].white.training
        self.left_out = self._chosen([g.left_out for g in self.guesses])

    def _chosen(self, each: list[Tensor]) -> Tensor:
        return torch.stack([each[b][:, j] for j, b in enumerate(self.choice)], dim=1)

    def __call__(self, blocks: list[Tensor]) -> tuple[Tensor, Tensor]:
        """New rows of each kind to components ``(B, k)`` of the first, and regressions ``(B, D)`` in the unit cube."""
        white = [g.white(rows) for g, rows in zip(self.guesses, blocks, strict=True)]
        return white[0], self._chosen([g(w) for g, w in zip(self.guesses, white, strict=True)])


class Summaries:
    """Rows of one or more kinds to features for a density network and a first guess of the parameters.

    The features are the leading components of the first kind; the first guess is :class:`BestGuess`, made on the unit
    cube, where errors weigh alike everywhere, and then taken to probit coordinates. No network reads a guess beside
    components: what a draw's left-out guess differs by from the smooth function of the components that all draws
    follow comes from the draw's own parameters, which could be told from the two together.

    Args:
        blocks, targets, weights, principal: as of :class:`BestGuess`.
        shown: components that are features.

    Attributes:
        training: features and guesses ``(n, D)`` of these draws, each made without the draw itself.
        residual: ``(D,)`` weighted root mean square error of those guesses.
    """

    def __init__(self, blocks: list[Tensor], targets: Tensor, weights: Tensor, principal: int, shown: int) -> None:
        self.shown = shown
        self.best = BestGuess(blocks, targets, weights, principal)
        guess = probit(self.best.left_out, _GUESS_EDGE)
        self.training = self.best.leading[:, :shown], guess
        error = (weights[:, None] * (probit(targets) - guess) ** 2).sum(0) / weights.sum()
        self.residual = error.sqrt().clamp(min=1e-3)

    def __call__(self, blocks: list[Tensor]) -> tuple[Tensor, Tensor]:
        """New rows of each kind to features and first guesses ``(B, D)``."""
        white, guess = self.best(blocks)
        return white[:, : self.shown], probit(guess, _GUESS_EDGE)
