"""One candidate effect: screened over its prior, refitted jointly with the parameters, held out."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy import stats

from ...core.arrays import FloatArray
from ...core.parameters import ParameterSpace
from ..polish import Objective, Polished

#: A coefficient that a motion shows is known to this share of its prior range, or better: a typical
#: effect is a quarter of the range, and a third of that is three standard deviations away from zero.
VISIBLE = 1.0 / 12.0


@dataclass(frozen=True, eq=False)
class Candidate:
    """A model with one more effect.

    Args:
        name: of the effect.
        space: parameters and coefficients.
        base: number of parameters that are not coefficients of this effect.
        fit: jointly polished, in units of the noise.
        held_out: root mean square error on each held-out recording [unit].
    """

    name: str
    space: ParameterSpace
    base: int
    fit: Polished
    held_out: dict[str, float] = field(default_factory=dict)

    @property
    def rss(self) -> float:
        return self.fit.rss

    @property
    def coefficients(self) -> dict[str, tuple[float, float, str]]:
        """Mean, standard deviation and unit of every coefficient."""
        return self.coefficients_of(self.name)

    def coefficients_of(self, effect: str) -> dict[str, tuple[float, float, str]]:
        """The same for any effect in the model."""
        low = np.array([p.low for p in self.space])
        span = np.array([p.high for p in self.space]) - low
        sd = np.sqrt(np.diag(self.fit.covariance)) * np.sqrt(max(1.0, self.rss / self.fit.count))
        return {
            p.name.split(".", 1)[1]: (float(low[k] + span[k] * self.fit.unit[k]), float(span[k] * sd[k]), p.unit)
            for k, p in enumerate(self.space)
            if p.name.startswith(f"{effect}.")
        }

    @property
    def wald(self) -> float:
        """Squared distance of the coefficients from zero, in units of their joint uncertainty."""
        zero = np.array([(0.0 - p.low) / (p.high - p.low) for p in list(self.space)[self.base :]])
        away = self.fit.unit[self.base :] - zero
        covariance = self.fit.covariance[self.base :, self.base :] * max(1.0, self.rss / self.fit.count)
        return float(away @ np.linalg.solve(covariance, away))

    @property
    def visible(self) -> bool:
        """Would these data show a typical strength of this effect, whatever the parameters are?

        True if the best determined coefficient is known well enough.
        """
        sd = np.sqrt(np.diag(self.fit.covariance))[self.base :]
        return bool(sd.min() < VISIBLE)

    @property
    def surviving(self) -> float:
        """Share of the effect's sensitivity left after projecting off the other parameters."""
        j = self.fit.jacobian
        effect, others = j[:, self.base :], j[:, : self.base]
        total = float(np.linalg.norm(effect))
        if total < 1e-9:
            return 0.0
        basis, _ = np.linalg.qr(others)
        return float(np.linalg.norm(effect - basis @ (basis.T @ effect)) / total)


def effect_start(space: ParameterSpace, base: int, plain: FloatArray) -> FloatArray:
    """The plain fit in the larger cube: every coefficient zero."""
    zero = np.array([(0.0 - p.low) / (p.high - p.low) for p in list(space)[base:]])
    return np.concatenate([plain, zero])


def screening_points(
    space: ParameterSpace, base: int, starts: FloatArray, count: int, rng: np.random.Generator
) -> FloatArray:
    """Where a refit may start ``(count, D)``: coefficients space-filling over their prior.

    The other parameters come from ``starts (K, base)``, the plain fit among them, and for every other
    point from anywhere in the prior: a missing effect may have driven the plain fit far away.
    """
    sobol = stats.qmc.Sobol(len(space), rng=rng)
    points = np.asarray(sobol.random_base2(int(np.ceil(np.log2(count)))))[:count]
    anchored = np.arange(count) % 2 == 0
    points[anchored, :base] = starts[rng.integers(len(starts), size=int(anchored.sum()))]
    points[0, :base] = starts[0]
    return np.asarray(points)


def newton_point(fit: Polished) -> tuple[FloatArray, float]:
    """Where a linear model of the residuals has its least square ``(D,)``, inside the cube, and that square.

    Steps of a bounded search from near a bound are short; this looks at what lies behind them.
    """
    step = -fit.covariance @ (fit.jacobian.T @ fit.white)
    left = fit.white + fit.jacobian @ step
    return np.clip(fit.unit + step, 0.01, 0.99), float(left @ left)


def responds(objective: Objective, start: FloatArray, base: int) -> bool:
    """Does anything at all change when every coefficient takes a quarter of its prior range?

    A lag of grippers that never move, say, cannot be seen, and need not be refitted.
    """
    strong = start.copy()
    strong[base:] = np.where(start[base:] < 0.7, start[base:] + 0.25, start[base:] - 0.25)
    plain, moved = objective.many(np.stack([start, strong]))
    return plain is None or moved is None or not np.array_equal(plain, moved)


def unchanged(plain: Polished, start: FloatArray, response: FloatArray) -> Polished:
    """The plain fit as the fit of an effect without any ``response (N, coefficients)`` in the data."""
    extra = len(start) - len(plain.unit)
    covariance = np.zeros((len(start), len(start)))
    covariance[: len(plain.unit), : len(plain.unit)] = plain.covariance
    covariance[len(plain.unit) :, len(plain.unit) :] = np.eye(extra) / 12.0  # of the prior
    return replace(plain, unit=start, covariance=covariance, jacobian=np.hstack([plain.jacobian, response]))


def best_starts(objective: Objective, points: FloatArray) -> list[FloatArray]:
    """``points`` from the smallest residual to the largest."""
    sizes = [np.inf if w is None else float(w @ w) for w in objective.many(points)]
    return [points[k] for k in np.argsort(sizes)]


def z_value(rss_without: float, candidate: Candidate, tried: int) -> float:
    """Significance of the drop in residual, as standard deviations of a normal, Bonferroni-corrected for ``tried``.

    The likelihood ratio is scaled by what the candidate itself leaves unexplained, so that a model that
    is wrong anyway does not make every effect significant.
    """
    scale = max(1.0, candidate.rss / candidate.fit.count)
    drop = max(0.0, rss_without - candidate.rss) / scale
    log_p = stats.chi2.logsf(drop, len(candidate.space) - candidate.base) + np.log(tried)
    if log_p > -1e-3:
        return 0.0
    if log_p > -600:
        return float(stats.norm.isf(np.exp(log_p) / 2))
    return float(np.sqrt(drop))  # the normal tail, far out: log p -> -z^2 / 2


def root_mean_square(values: Sequence[float]) -> float:
    """Of root mean squares; NaN of none."""
    return float(np.sqrt(np.mean(np.square(values)))) if len(values) else float("nan")
