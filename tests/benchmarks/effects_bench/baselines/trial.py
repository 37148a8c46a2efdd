"""What a baseline is shown: the study, fitted, and a pool that can simulate it with every candidate effect."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from muslin.core.arrays import FloatArray
from muslin.core.effect import Effect
from muslin.core.powerless import why_powerless
from muslin.core.registry import REGISTRY
from muslin.core.store import read
from muslin.core.study import Problem, SimulationPool, Study
from muslin.inference.discrepancy import Discrepancy
from muslin.inference.noise import Noise
from muslin.inference.polish import Objective
from muslin.inference.residuals import Offsets
from muslin.inference.sequential.result import load_fit

from ..cases import Case


@dataclass(frozen=True)
class Answer:
    """What a baseline says: a name or none, and its held-out error if it predicts [m]."""

    name: str | None
    held_out: float | None = None


@dataclass(frozen=True, eq=False)
class Fitted:
    """What baselines take from the fit of a case.

    Args:
        unit: the best fit of the model without effects ``(D,)``, in the unit cube.
        noise: of the measurement.
        step: of derivatives in the unit cube.
    """

    unit: FloatArray
    noise: Noise
    step: float

    @classmethod
    def of(cls, study: Study) -> "Fitted":
        """Of a study that is fitted."""
        fit = load_fit(study)
        return cls(read(study.step_results("fit"), "estimate_unit"), fit.noise, fit.derivative_step)

    def to_json(self) -> dict[str, Any]:
        return {"unit": self.unit.tolist(), "noise": self.noise.as_dict(), "step": self.step}

    @classmethod
    def from_json(cls, content: dict[str, Any]) -> "Fitted":
        return cls(np.array(content["unit"]), Noise.from_dict(content["noise"]), content["step"])


@dataclass(frozen=True, eq=False)
class Trial:
    """One case as a baseline sees it. Nothing here knows the truth.

    Args:
        case: its flaws and setting, not to be asked for what it hides.
        study: of the case.
        problem: of the study, with every candidate effect in it.
        pool: of this problem.
        fitted: the model without effects.
        candidates: names of the effects that can act.
        draws: that may be simulated beforehand for all cases of a setting.
        cache: folder for them.
    """

    case: Case
    study: Study
    problem: Problem
    pool: SimulationPool
    fitted: Fitted
    candidates: tuple[str, ...]
    draws: int
    cache: Path

    @property
    def noise(self) -> Noise:
        return self.fitted.noise

    @property
    def unit(self) -> FloatArray:
        return self.fitted.unit

    def objective(self, *effects: str) -> Objective:
        """Residuals of the model with these effects, on the fitted recordings."""
        space = self.problem.with_effects(*effects).space
        return Objective(
            self.pool,
            space,
            self.problem.fit_on,
            self.noise,
            Offsets(),
            discrepancy=Discrepancy(step=self.fitted.step),
        )

    def start(self, effect: str) -> FloatArray:
        """The best fit with the effect in the model, but off."""
        zero = [-c.low / (c.high - c.low) for c in self.problem.effects[effect].coefficients]
        return np.concatenate([self.unit, zero])


@contextmanager
def make_trial(case: Case, study: Study, fitted: Fitted, draws: int, cache: Path) -> Iterator[Trial]:
    """A trial, and its pool while it lasts."""
    scenario = study.problem.scenarios[study.problem.fit_on[0]]
    names = tuple(
        n
        for n in REGISTRY.names("effect")
        if (effect := REGISTRY.get("effect", n)).candidate
        and why_powerless(effect, study.problem.simulator, scenario) is None
    )
    effects: dict[str, type[Effect]] = {n: REGISTRY.get("effect", n) for n in names}
    problem = replace(study.problem, effects=effects)
    with study.pool(problem) as pool:
        yield Trial(case, study, problem, pool, fitted, names, draws, cache)
