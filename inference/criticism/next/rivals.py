"""The models that the next experiment should tell apart: what a diagnosis kept of them, or refitted."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ....core.arrays import FloatArray
from ....core.parameters import ParameterSpace
from ....core.study import Problem, SimulationPool, Study
from ...discrepancy import Discrepancy
from ...polish import Objective, polish
from ...sequential.polishing import offsets_of
from ...sequential.result import FitResult

#: Least-squares evaluations for a model that has to be refitted.
EVALUATIONS = 40
#: A typical strength of an effect that nobody has seen: this share of the prior range.
TYPICAL = 0.25
#: Steps in the unit cube are no shorter than this, or rounding in a rollout would show.
_LEAST_STEP = 2e-3


@dataclass(frozen=True, eq=False)
class Rival:
    """A fitted model.

    Args:
        name: for people: the effects that it has beyond the study's.
        space: parameters, coefficients of its effects included.
        unit: best fit in the unit cube ``(D,)``.
        covariance: of ``unit`` given the recordings ``(D, D)``.
        rss: residual sum of squares on the fitted recordings [noise variances]; NaN if it is not known.
    """

    name: str
    space: ParameterSpace
    unit: FloatArray
    covariance: FloatArray
    rss: float = float("nan")

    def values(self, unit: FloatArray | None = None) -> dict[str, float]:
        """Parameters by name [units] at ``unit (D,)``, default the best fit."""
        return self.space.as_dict(self.space.from_unit(self.unit if unit is None else unit))

    def steps(self) -> tuple[FloatArray, FloatArray]:
        """Where the posterior reaches to.

        Returns:
            points: one standard deviation along every principal axis of the covariance, inside the cube ``(D, D)``.
            weights: by which a difference to the best fit grows to one of a whole standard deviation ``(D,)``.
        """
        variances, axes = np.linalg.eigh(0.5 * (self.covariance + self.covariance.T))
        lengths = np.sqrt(np.maximum(variances, 0.0))
        points, weights = [], []
        for length, axis in zip(lengths, axes.T, strict=True):
            step = max(float(length), _LEAST_STEP)
            sides = [np.clip(self.unit + s * step * axis, 0.0, 1.0) for s in (1.0, -1.0)]
            went = [float(np.linalg.norm(p - self.unit)) for p in sides]
            points.append(sides[int(np.argmax(went))])
            weights.append(float(length) / max(*went, 0.2 * step))
        return np.array(points), np.array(weights)

    def with_strength(self, name: str, extra: ParameterSpace) -> "Rival":
        """The same model with an effect of :data:`TYPICAL` strength whose coefficients nobody fits."""
        none = zero_of(extra)
        strong = np.where(none < 0.7, none + TYPICAL, none - TYPICAL)
        count = len(self.unit)
        covariance = np.zeros((count + len(extra), count + len(extra)))
        covariance[:count, :count] = self.covariance
        return Rival(name, self.space + extra, np.concatenate([self.unit, strong]), covariance)


def zero_of(space: ParameterSpace) -> FloatArray:
    """Where in the unit cube all of these coefficients are zero ``(D,)``."""
    return np.array([(0.0 - p.low) / (p.high - p.low) for p in space])


def kept_rival(problem: Problem, effects: Sequence[str], models: Sequence[Mapping[str, Any]]) -> Rival | None:
    """The model with ``effects``, in any order, if the diagnosis has kept it."""
    for model in models:
        if sorted(model["effects"]) != sorted(effects):
            continue
        space = problem.with_effects(*effects).space
        names = list(model.get("parameters") or model["values"])
        if sorted(names) != sorted(space.names):
            continue
        order = [names.index(n) for n in space.names]
        covariance = np.asarray(model["covariance"], float)[np.ix_(order, order)]
        rss = float(model.get("rss", float("nan")))
        return Rival(" and ".join(effects), space, np.asarray(model["unit"], float)[order], covariance, rss)
    return None


def refitted_rival(
    study: Study,
    problem: Problem,
    pool: SimulationPool,
    known: FitResult,
    effects: Sequence[str],
    plain: FloatArray,
    means: Mapping[str, float],
) -> Rival:
    """The model with ``effects``, polished from weak or typical coefficients, or from those that the diagnosis found.

    Args:
        study: that is fitted.
        problem: of the study, knowing the classes of the effects.
        pool: of the same problem.
        known: the study's fit.
        effects: beyond those of the study, of which the first is in question.
        plain: the fit without them in the unit cube.
        means: coefficients of the diagnosis, ``effect.coefficient`` [units]; may lack some.
    """
    space = problem.with_effects(*effects).space
    extra = ParameterSpace(tuple(space)[len(plain) :])
    none = zero_of(extra)
    starts = [none + share * np.where(none < 0.7, 1.0, -1.0) for share in (0.02, TYPICAL)]
    if all(n in means for n in extra.names):
        starts.append(np.clip(extra.to_unit(np.array([means[n] for n in extra.names])), 0.0, 1.0))
    discrepancy = Discrepancy(step=known.derivative_step)
    objective = Objective(pool, space, problem.fit_on, known.noise, offsets_of(study), discrepancy=discrepancy)
    points = np.stack([np.concatenate([plain, s]) for s in starts])
    sizes = [np.inf if w is None else float(w @ w) for w in objective.many(points)]
    fit = polish(objective, points[int(np.argmin(sizes))], EVALUATIONS)
    return Rival(effects[0], space, fit.unit, fit.widened, fit.rss)


def leads_of(rivals: Sequence[Rival]) -> FloatArray:
    """How much worse model b fits the recordings than model a ``(M, M)`` in -2 log likelihood, at [a, b].

    Models whose fit is not known are taken for equally good, as tied ones nearly are.
    """
    rss = np.array([r.rss for r in rivals])
    return np.asarray(np.nan_to_num(rss[None, :] - rss[:, None]))


def knowing(problem: Problem, effects: Mapping[str, type[Any]]) -> Problem:
    """``problem`` with the classes of further effects."""
    return replace(problem, effects={**problem.effects, **effects})
