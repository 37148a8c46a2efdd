"""One candidate effect: screened over its prior, refitted jointly with the parameters, held out."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy import stats

from ...core.arrays import FloatArray
from ...core.parameters import ParameterSpace
from ..polish import Objective, Polished

#: A coefficient that a motion shows is known to this share of its prior range, or better: a typical
#: effect is a quarter of the range, and a third of that is three standard deviations away from zero.
VISIBLE = 1.0 / 12.0
#: Held-out motions show an effect if -2 log likelihood would fall by this much, three standard deviations.
SHOWN = 9.0


@dataclass(frozen=True, eq=False)
class Candidate:
    """A model with one more effect.

    Args:
        name: of the effect.
        space: parameters and coefficients.
        base: number of parameters that are not coefficients of this effect.
        fit: jointly polished, in units of the noise.
        held_out: root mean square error on each held-out recording [unit].
        held_out_white: mean square of all of them, whitened by noise and numerics [noise variances].
        held_out_shift: how far it is on held-out recordings from the model without it, as a sum of squares [noise
            variances].
        held_out_gain: by how much -2 log likelihood of these falls with it.
        promised: residual sum of squares that a linear model promised at the first look.
        approached: the curvature is of a search from near here rather than of the first look.
        refitted: polished to the end, so what it leaves is what it cannot explain.
        tried: simulated beyond its first look, or it moves nothing; else nothing is known of what it explains.
        doubt: how far off parameters and coefficients may be beside their covariance, as standard deviations ``(D,)``.
    """

    name: str
    space: ParameterSpace
    base: int
    fit: Polished
    held_out: dict[str, float] = field(default_factory=dict)
    held_out_white: float = float("nan")
    held_out_shift: float = float("inf")
    held_out_gain: float = 0.0
    promised: float = float("inf")
    approached: bool = False
    refitted: bool = False
    tried: bool = False
    doubt: FloatArray | None = None

    @property
    def rss(self) -> float:
        return self.fit.rss

    @property
    def rank(self) -> tuple[float, float]:
        """What candidates are put in order by, smallest first: what they reach, then what they promise."""
        return self.rss, self.promised

    @property
    def coefficients(self) -> dict[str, tuple[float, float, str]]:
        """Mean, standard deviation and unit of every coefficient."""
        return self.coefficients_of(self.name)

    def coefficients_of(self, effect: str) -> dict[str, tuple[float, float, str]]:
        """The same for any effect in the model."""
        low = np.array([p.low for p in self.space])
        span = np.array([p.high for p in self.space]) - low
        doubt = np.zeros(len(low)) if self.doubt is None else self.doubt
        sd = np.sqrt(np.diag(self.fit.widened) + doubt**2)
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
        return float(away @ np.linalg.solve(self.fit.widened[self.base :, self.base :], away))

    @property
    def visible(self) -> bool:
        """Would these data show a typical strength of this effect, whatever the parameters are?

        True if the best determined coefficient is known well enough.
        """
        sd = np.sqrt(np.diag(self.fit.covariance))[self.base :]
        return bool(sd.min() < VISIBLE)

    @property
    def shown_held_out(self) -> bool:
        """Would the held-out motions get better by this effect, as strong as it was found, beyond what chance gives?"""
        return self.held_out_shift >= SHOWN

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


def best_starts(objective: Objective, points: FloatArray) -> list[tuple[FloatArray, FloatArray]]:
    """``points`` and their white residuals from the smallest residual to the largest; failed ones are left out."""
    rows = [(p, w) for p, w in zip(points, objective.many(points), strict=True) if w is not None]
    return sorted(rows, key=lambda row: float(row[1] @ row[1]))


def z_value(rss_without: float, candidate: Candidate, tried: int) -> float:
    """Significance of the drop in residual, as standard deviations of a normal, Bonferroni-corrected for ``tried``.

    The likelihood ratio is scaled by what the candidate itself leaves unexplained, so that a model that
    is wrong anyway does not make every effect significant.
    """
    scale = max(1.0, candidate.rss / candidate.fit.count)
    return drop_z(max(0.0, rss_without - candidate.rss) / scale, len(candidate.space) - candidate.base, tried)


def drop_z(drop: float, coefficients: int, tried: int) -> float:
    """The same of a ``drop`` in -2 log likelihood by so many coefficients."""
    log_p = stats.chi2.logsf(drop, coefficients) + np.log(tried)
    if log_p > -1e-3:
        return 0.0
    if log_p > -600:
        return float(stats.norm.isf(np.exp(log_p) / 2))
    return float(np.sqrt(drop))  # the normal tail, far out: log p -> -z^2 / 2


def root_mean_square(values: Sequence[float]) -> float:
    """Of root mean squares; NaN of none."""
    return float(np.sqrt(np.mean(np.square(values)))) if len(values) else float("nan")
