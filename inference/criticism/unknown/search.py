"""The few terms that stand for the estimated force: best subsets by the Bayesian information criterion."""

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from ....core.arrays import FloatArray
from .estimate import Estimate
from .library import Piece

#: Laws of one, two and three pieces that go on: what a linear model overrates is mostly large.
KEPT = (3, 2, 1)


@dataclass(frozen=True, eq=False)
class Guess:
    """A law as the linearised residuals have it.

    Args:
        pieces: of which it has a coefficient.
        coefficients: by name; those that it is not linear in among them.
        shift: of the parameters in the unit cube ``(D,)``.
        score: -2 log likelihood plus its penalty.
        rss: residual sum of squares that it promises.
    """

    pieces: tuple[Piece, ...]
    coefficients: dict[str, float]
    shift: FloatArray
    score: float
    rss: float


class LinearModel:
    """Residuals as a linear function of coefficients and parameters, with the estimated force taken away.

    Args:
        estimate: the force.
        columns: what each coefficient does ``(N,)``.
    """

    def __init__(self, estimate: Estimate, columns: dict[str, FloatArray]) -> None:
        base = len(estimate.unknowns.space)
        self.names = list(columns)
        self.base = base
        without = [
            w - s[:, base:] @ estimate.point[base:] for w, s in zip(estimate.white, estimate.slopes, strict=True)
        ]
        parameters = np.concatenate([s[:, :base] for s in estimate.slopes])
        design = np.column_stack([parameters, *columns.values()])
        y = -np.concatenate(without)
        self.gram, self.right, self.square = design.T @ design, design.T @ y, float(y @ y)
        self.gram[np.arange(base), np.arange(base)] += 12.0  # the prior of the unit interval
        self.right[:base] += 12.0 * (estimate.centre - estimate.point[:base])
        self.count = estimate.count
        self.scale = 1.0

    def fit(self, names: tuple[str, ...]) -> tuple[FloatArray, float]:
        """Shift of the parameters and coefficients, and the residual sum of squares."""
        rows = [*range(self.base), *(self.base + self.names.index(n) for n in names)]
        gram, right = self.gram[np.ix_(rows, rows)], self.right[rows]
        found = np.linalg.lstsq(gram, right, rcond=1e-10)[0]
        return found, max(self.square - float(right @ found), 0.0)

    def score(self, rss: float, coefficients: int) -> float:
        return rss / self.scale + coefficients * float(np.log(self.count))


def best_laws(estimate: Estimate, columns: dict[str, FloatArray], pieces: list[Piece]) -> list[Guess]:
    """The :data:`KEPT` best laws of one piece, of two and of three, every combination tried, best first.

    Coefficients that are not worth their penalty are dropped, so a piece may be left with a part.
    """
    model = LinearModel(estimate, columns)
    order = {c: k for k, c in enumerate(columns)}
    tried: dict[tuple[str, ...], tuple[tuple[Piece, ...], float]] = {}
    for size in range(1, len(KEPT) + 1):
        for some in combinations(pieces, size):
            if len({p.name for p in some}) < size:  # one frequency is enough
                continue
            names = tuple(sorted({c for p in some for c in p.columns}, key=order.__getitem__))
            if names not in tried:
                tried[names] = (some, model.fit(names)[1])
    model.scale = max(1.0, min(rss for _, rss in tried.values()) / model.count)
    ranked = sorted(tried, key=lambda n: model.score(tried[n][1], len(n)))
    kept: dict[frozenset[str], Guess] = {}
    for size, wanted in enumerate(KEPT, start=1):
        mine = [n for n in ranked if len(tried[n][0]) == size]
        new = 0
        for names in mine[: 10 * wanted]:
            guess = _pruned(model, names, tried[names][0])
            if new < wanted and frozenset(guess.coefficients) not in kept:
                kept[frozenset(guess.coefficients)] = guess
                new += 1
    return sorted(kept.values(), key=lambda g: g.score)


def _pruned(model: LinearModel, names: tuple[str, ...], pieces: tuple[Piece, ...]) -> Guess:
    """A law without the coefficients that it can do without."""
    found, rss = model.fit(names)
    while len(names) > 1:
        fewer = [tuple(n for n in names if n != gone) for gone in names]
        fits = [model.fit(f) for f in fewer]
        best = int(np.argmin([f[1] for f in fits]))
        if model.score(fits[best][1], len(names) - 1) >= model.score(rss, len(names)):
            break
        names, (found, rss) = fewer[best], fits[best]
    told = {n.partition("@")[0]: float(v) for n, v in zip(names, found[model.base :], strict=True)}
    used = tuple(p for p in pieces if any(c in names for c in p.columns))
    for piece in used:
        if any("@" in c for c in piece.columns):
            told.update(dict(piece.fixed))
    return Guess(used, told, found[: model.base], model.score(rss, len(names)), rss)
