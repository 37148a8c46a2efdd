"""What all stages of a diagnosis share: rollouts and their budget, objectives, held-out errors."""

from dataclasses import replace

import numpy as np

from ...core.arrays import FloatArray
from ...core.parameters import ParameterSpace
from ...core.rollout import Trajectory
from ...core.study import Problem, SimulationPool, Study, Task
from ..discrepancy import NONE
from ..polish import Objective, Polished, polish
from ..residuals import residual
from ..sequential.fitting import offsets_of
from ..sequential.result import FitResult
from .candidate import Candidate
from .numerics import numerical_discrepancy
from .verdict import Evidence


class Work:
    """Rollouts of one diagnosis.

    Args:
        study, problem, pool, fit: the study, its problem with all candidates, where it is simulated, its fit.

    Attributes:
        discrepancy: how far the model's own numbers may be off, as last seen.
        limit: of rollouts.
    """

    def __init__(self, study: Study, problem: Problem, pool: SimulationPool, fit: FitResult) -> None:
        self.study, self.problem, self.pool, self.fit = study, problem, pool, fit
        self.offsets = offsets_of(study)
        self.starts = problem.space.to_unit(fit.samples)[: 4 * study.config.diagnose.draws]
        self.limit = study.config.diagnose.simulations
        self.discrepancy = NONE
        self._elsewhere = 0  # rollouts of other engines and meshes

    @property
    def count(self) -> int:
        """Rollouts so far."""
        return self.pool.count + self._elsewhere

    @property
    def spent(self) -> bool:
        """Is the budget used up?"""
        return self.count >= self.limit

    def space(self, effects: tuple[str, ...]) -> ParameterSpace:
        return self.problem.with_effects(*effects).space

    def objective(self, effects: tuple[str, ...]) -> Objective:
        return Objective(
            self.pool, self.space(effects), self.problem.fit_on, self.fit.noise, self.offsets,
            discrepancy=self.discrepancy,
        )  # fmt: skip

    def see_numerics(self, effects: tuple[str, ...], unit: FloatArray) -> None:
        """Look at the model's own errors where it fits best so far."""
        space = self.space(effects)
        values = space.as_dict(space.from_unit(unit))
        self.discrepancy, cost = numerical_discrepancy(self.pool, values, self.fit.noise, self.offsets)
        self._elsewhere += cost

    def polished(self, effects: tuple[str, ...], start: FloatArray, evaluations: int) -> Polished:
        """A least-squares fit of the model with ``effects``, of as many evaluations as the budget has left."""
        objective = self.objective(effects)
        each = (1 + len(objective.space)) * len(self.problem.fit_on)
        return polish(objective, start, max(1, min(evaluations, (self.limit - self.count) // each)))

    def evidence(self, effects: tuple[str, ...], plain: Polished, candidates: list[Candidate]) -> Evidence:
        """Hold out, and put together what decides."""
        space = self.space(effects)
        raw, white = self.held_out(space, plain.unit)
        full = []
        for c in candidates:
            held, held_white = self.held_out(c.space, c.fit.unit) if c.rss < plain.rss else (raw, white)
            full.append(
                replace(c, held_out=held, held_out_white=held_white, numerics=self.numerics_of(effects, c.name, c.fit))
            )
        return Evidence(
            rss_plain=plain.rss,
            count=max(plain.count - len(space), 1.0),
            held_out_plain=float(np.sqrt(np.mean(np.square(list(raw.values()))))) if raw else float("nan"),
            held_out_white=white,
            noise_sd=self.fit.noise.sd,
            noise_error=self.fit.noise.relative_error,
            candidates=tuple(full),
        )

    def numerics_of(self, effects: tuple[str, ...], name: str, fit: Polished) -> float:
        """What the numerics explain in the residuals of a fit [noise variances]."""
        parts = self.objective((*effects, name)).parts(fit.white)
        return sum(self.discrepancy.explained(recording, part) for recording, part in parts.items())

    def held_out(self, space: ParameterSpace, unit: FloatArray) -> tuple[dict[str, float], float]:
        """Root mean square error on every held-out recording [unit], and mean square of all, whitened."""
        values = space.as_dict(space.from_unit(unit))
        names = self.problem.hold_out
        errors, white = {}, []
        for name, outcome in zip(names, self.pool.map([Task(values, n) for n in names]), strict=True):
            if not isinstance(outcome, Trajectory):
                return dict.fromkeys(names, float("inf")), float("inf")
            r = residual(self.problem.recordings[name], outcome.series, self.fit.noise, self.offsets)
            errors[name] = r.rms
            white.append(self.discrepancy.whitened(name, r.white))
        if not white:
            return {}, float("nan")
        all_of_them = np.concatenate(white)
        return errors, float(all_of_them @ all_of_them) / (self.fit.noise.information * len(all_of_them))
