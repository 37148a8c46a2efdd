"""How strong a hidden effect is: set by the misfit that is left after the model without it was fitted."""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from muslin.core.arrays import FloatArray
from muslin.core.effect import Effect
from muslin.core.errors import RolloutFailed
from muslin.core.material import with_fields
from muslin.core.measurement import Recording
from muslin.core.rollout import rollout
from muslin.core.study import Problem, SimulationPool
from muslin.inference.noise import Noise
from muslin.inference.polish import Objective, Polished, polish
from muslin.inference.residuals import Offsets

#: Misfits after calibration that are meant [of what is left without the effect], and the range in which one will do.
TARGETS = {"weak": 1.5, "strong": 5.0}
RANGES = {"weak": (0.9, 2.4), "strong": (3.5, 8.0)}
#: A share of the largest coefficients to start from, and how often the share is mended.
FIRST_SHARE, TRIES = 0.3, 8
#: Evaluations of the least-squares fit that calibrates the model.
EVALUATIONS = 12
#: Lift above drag would push a sheet forward.
_AT_MOST = {("air-drag", "lift_coefficient"): 0.4}


def direction(effect: type[Effect], rng: np.random.Generator) -> dict[str, float]:
    """The largest coefficients that a case may have, their signs and proportions drawn."""
    out = {}
    for c in effect.coefficients:
        sign = rng.choice([-1.0, 1.0]) if c.low < 0 < c.high else 1.0
        bound = c.high if sign > 0 else -c.low
        out[c.name] = float(sign * bound * 0.95 * rng.uniform(0.4, 1.0) * _AT_MOST.get((effect.name, c.name), 1.0))
    return out


@dataclass(frozen=True, eq=False)
class Calibrated:
    """The model, fitted to a reality without noise.

    Args:
        problem: with that reality as its recordings.
        fit: the model's best.
        misfit: root mean square of what is left [noise standard deviations].
    """

    problem: Problem
    fit: Polished
    misfit: float


class Calibrator:
    """Plays realities on the model's own engine, without noise, and fits the model to them.

    Args:
        problem: the study's.
        values: true parameters.
        noise: standard deviation that misfits are measured in [m]; may stand for what is left anyway, too.
    """

    def __init__(self, problem: Problem, values: dict[str, float], noise: float) -> None:
        self.problem, self.values = problem, values
        self.noise = Noise(noise, 0.0, "known", "m", 0.02)
        self.truth = problem.space.to_unit(np.array([values[n] for n in problem.space.names]))

    def before(self, effects: list[Effect]) -> float:
        """Root mean square of what ``effects`` change, before anything is fitted [noise standard deviations].

        Raises:
            RolloutFailed: as of :meth:`fit`.
        """
        off, on = self._played([]), self._played(effects)
        apart = [(on[n].series.points - off[n].series.points).ravel() for n in self.problem.fit_on]
        return float(np.sqrt(np.mean(np.concatenate(apart) ** 2)) / self.noise.sd)

    def fit(self, effects: list[Effect], among: tuple[str, ...] = ()) -> Calibrated:
        """The model with the coefficients of ``among`` too, fitted from the truth to what ``effects`` make.

        Raises:
            RolloutFailed: the reality cannot be simulated.
        """
        return self.fit_to(self._played(effects), among)

    def fit_to(self, recordings: dict[str, Recording], among: tuple[str, ...] = ()) -> Calibrated:
        """The same, fitted to recordings that something else has made."""
        problem = replace(self.problem, recordings=recordings).with_effects(*among)
        with SimulationPool(problem, 0) as pool:
            objective = Objective(pool, problem.space, problem.fit_on, self.noise, Offsets())
            best = min((polish(objective, s, EVALUATIONS) for s in self._starts(problem)), key=lambda p: p.rss)
        return Calibrated(problem, best, float(np.sqrt(best.rss / len(best.white))))

    def _played(self, effects: list[Effect]) -> dict[str, Recording]:
        out = dict(self.problem.recordings)
        material = with_fields(self.problem.material, self.values)
        for name in self.problem.fit_on:
            made = rollout(self.problem.simulator, self.problem.scenarios[name], material, effects, time_limit=120.0)
            out[name] = replace(out[name], series=made.series)
        return out

    def _starts(self, problem: Problem) -> list[FloatArray]:
        extra = list(problem.space)[len(self.truth) :]
        if not extra:
            return [self.truth]
        zero = np.array([-p.low / (p.high - p.low) for p in extra])
        sides = (0.2, -0.2) if (zero > 0).any() else (0.2,)
        return [np.concatenate([self.truth, np.clip(zero + s, 0.0, 1.0)]) for s in sides]


@dataclass(frozen=True)
class Scaled:
    """Coefficients of an effect, and the misfit that it leaves [noise standard deviations]."""

    coefficients: dict[str, float]
    misfit: float


def scaled(calibrator: Calibrator, effect: type[Effect], largest: dict[str, float], strength: str) -> Scaled | None:
    """Coefficients in the proportions of ``largest`` that leave the misfit of ``strength``, or as near as can be.

    None where the largest ones leave less than a weak misfit, or none leaves as little as is meant.
    """

    def left(share: float) -> float:
        return calibrator.fit([effect(**{k: share * v for k, v in largest.items()})]).misfit

    with suppress(RolloutFailed):  # too strong to be simulated is not too weak to be seen
        if calibrator.before([effect(**largest)]) < RANGES["weak"][0]:
            return None
    share, misfit = solve(left, TARGETS[strength], RANGES[strength])
    if not RANGES["weak"][0] <= misfit <= RANGES[strength][1]:
        return None
    return Scaled({k: share * v for k, v in largest.items()}, misfit)


def solve(left: Callable[[float], float], target: float, within: tuple[float, float]) -> tuple[float, float]:
    """A share in (0, 1] at which ``left(share)``, which rises with it, is near ``target``; and what it is there.

    Proportional steps until the target lies between two shares, then between these: some effects set in all at once.
    A share that cannot be simulated is too large.
    """
    share, best = FIRST_SHARE, (0.0, 0.0)
    low, high = (0.0, 0.0), (1.0, float("inf"))  # shares below and above, with what they leave
    for _ in range(TRIES):
        try:
            misfit = left(share)
        except RolloutFailed:
            misfit = float("inf")
        if np.isfinite(misfit) and _off(misfit, target) < _off(best[1], target):
            best = (share, misfit)
        if within[0] <= misfit <= within[1]:
            break
        low, high = ((share, misfit), high) if misfit < target else (low, (share, misfit))
        if np.isfinite(high[1]) and low[1] > 0:
            slope = np.log(high[1] / low[1]) / np.log(high[0] / low[0])
            power = float(np.clip(np.log(target / low[1]) / slope / np.log(high[0] / low[0]), 0.3, 0.7))
            wanted = low[0] * (high[0] / low[0]) ** power
        elif np.isfinite(misfit):
            wanted = min(high[0], share * float(np.clip(target / max(misfit, 1e-9), 1 / 8, 8)))
        else:
            wanted = max(share / 2, (low[0] + share) / 2)
        if wanted == share:
            break
        share = wanted
    return best


def _off(misfit: float, target: float) -> float:
    return abs(float(np.log(max(misfit, 1e-9) / target)))
