"""Every candidate beside the model so far: screened, polished, and what the evidence says."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...core.arrays import FloatArray
from ...core.parameters import ParameterSpace
from ...core.rollout import Trajectory
from ...core.study import Problem, SimulationPool, Study, Task
from ..polish import Objective, Polished, polish
from ..residuals import residual
from ..sequential.fitting import offsets_of
from ..sequential.result import FitResult
from .candidate import (
    Candidate,
    best_starts,
    effect_start,
    newton_point,
    responds,
    root_mean_square,
    screening_points,
    unchanged,
)
from .verdict import Decision, Evidence, decide

#: Least-squares evaluations for every candidate, for the contenders on top, and for the most promising of these.
FIRST_EVALUATIONS, CONTENDER_EVALUATIONS, MORE_EVALUATIONS = 2, 4, 10
#: Further starts from which what was named is polished.
RESTARTS = 2
#: How many go on after the first look, by what they reach and by what they promise: most are far behind at once.
CONTENDERS = 4
#: The candidates that are polished to the end: this many, and all that explain half of what the best does.
FINALISTS = 2


@dataclass(frozen=True, eq=False)
class Stage:
    """The model so far, its best fit, and every candidate beside it."""

    effects: tuple[str, ...]
    plain: Polished
    evidence: Evidence
    decision: Decision


def chosen_of(stage: Stage) -> Candidate:
    """The candidate that the verdict puts first."""
    return next(c for c in stage.evidence.candidates if c.name == stage.decision.effects[0])


class Work:
    """Everything that stages share."""

    def __init__(self, study: Study, problem: Problem, pool: SimulationPool, fit: FitResult) -> None:
        self.study, self.problem, self.pool, self.fit = study, problem, pool, fit
        self.offsets = offsets_of(study)
        self.starts = problem.space.to_unit(fit.samples)[: 4 * study.config.diagnose.draws]

    def space(self, effects: tuple[str, ...]) -> ParameterSpace:
        return self.problem.with_effects(*effects).space

    def objective(self, effects: tuple[str, ...]) -> Objective:
        return Objective(self.pool, self.space(effects), self.problem.fit_on, self.fit.noise, self.offsets)

    def stage(self, effects: tuple[str, ...], names: list[str], plain: Polished | FloatArray) -> Stage:
        objective = self.objective(effects)
        if not isinstance(plain, Polished):
            plain = polish(objective, plain, 2)
        candidates = []
        for k, name in enumerate(names):
            self.study.progress(f"trying {name}", k + 1, len(names))
            candidates.append(self.refit((*effects, name), plain))
        candidates = self.contend(effects, candidates)
        candidates = self.finish(effects, candidates, plain)
        best = min(candidates, key=lambda c: c.rss)
        if best.rss < plain.rss:
            # the plain model gets the best candidate's start too, or a better start would pass for an effect
            again = polish(objective, best.fit.unit[: len(objective.space)], MORE_EVALUATIONS)
            plain = min(plain, again, key=lambda p: p.rss)
        candidates = [replace(c, held_out=self.held_out(c.space, c.fit.unit)) for c in candidates]
        evidence = Evidence(
            rss_plain=plain.rss,
            count=max(plain.count - len(objective.space), 1.0),
            held_out_plain=root_mean_square(list(self.held_out(objective.space, plain.unit).values())),
            noise_sd=self.fit.noise.sd,
            noise_error=self.fit.noise.relative_error,
            candidates=tuple(candidates),
        )
        stage = Stage(effects, plain, evidence, decide(evidence))
        return self.again(stage) if stage.decision.verdict == "named" else stage

    def refit(self, effects: tuple[str, ...], plain: Polished) -> Candidate:
        objective = self.objective(effects)
        base = len(plain.unit)
        # own stream for every candidate, whatever the others are
        rng = np.random.default_rng([self.study.config.study.seed, 47, *effects[-1].encode()])
        starts = plain.unit[None]
        if len(effects) == 1:
            starts = np.vstack([starts, self.starts])
        points = screening_points(objective.space, base, starts, self.study.config.diagnose.draws, rng)
        start = effect_start(objective.space, base, plain.unit)
        if not responds(objective, start, base):
            still = np.zeros((len(plain.white), len(objective.space) - base))
            return Candidate(effects[-1], objective.space, base, unchanged(plain, start, still))
        points = np.vstack([start, points])
        first = polish(objective, best_starts(objective, points)[0], FIRST_EVALUATIONS)
        return Candidate(effects[-1], objective.space, base, first)

    def contend(self, effects: tuple[str, ...], candidates: list[Candidate]) -> list[Candidate]:
        """Polish those further that are best, or would be if residuals were linear; the others stay as they are."""
        points = {c.name: newton_point(c.fit) for c in candidates}
        by_promise = sorted(candidates, key=lambda c: points[c.name][1])
        leaders = {c.name for c in [*sorted(candidates, key=lambda c: c.rss)[:CONTENDERS], *by_promise[:CONTENDERS]]}
        out = []
        for c in candidates:
            if c.name in leaders:
                self.study.progress(f"looking closer at {c.name}", 0, 0)
                objective = self.objective((*effects, c.name))
                start = best_starts(objective, np.stack([c.fit.unit, points[c.name][0]]))[0]
                fit = polish(objective, start, CONTENDER_EVALUATIONS)
                c = replace(c, fit=min(fit, c.fit, key=lambda p: p.rss))
            out.append(c)
        return out

    def finish(self, effects: tuple[str, ...], candidates: list[Candidate], plain: Polished) -> list[Candidate]:
        """Polish the promising candidates to the end; the others are far behind and stay as they are."""
        order = sorted(candidates, key=lambda c: c.rss)
        half = (plain.rss + order[0].rss) / 2
        out = []
        for k, c in enumerate(order):
            if k < FINALISTS or c.rss < half:
                self.study.progress(f"refitting {c.name}", 0, 0)
                fit = polish(self.objective((*effects, c.name)), c.fit.unit, MORE_EVALUATIONS)
                c = replace(c, fit=min(fit, c.fit, key=lambda p: p.rss))
            out.append(c)
        return out

    def again(self, stage: Stage) -> Stage:
        """Polish what was named from other starts too: what a fit in a side valley leaves is no second effect.

        Only once the verdict stands: of all candidates the leader alone would have it easier than its rivals.
        """
        c = chosen_of(stage)
        objective = self.objective((*stage.effects, c.name))
        rng = np.random.default_rng([self.study.config.study.seed, 53, *c.name.encode()])
        points = screening_points(c.space, c.base, c.fit.unit[None, : c.base], self.study.config.diagnose.draws, rng)
        fits = [polish(objective, p, MORE_EVALUATIONS) for p in best_starts(objective, points)[:RESTARTS]]
        better = replace(c, fit=min([c.fit, *fits], key=lambda p: p.rss))
        better = replace(better, held_out=self.held_out(better.space, better.fit.unit))
        candidates = tuple(better if other is c else other for other in stage.evidence.candidates)
        return replace(stage, evidence=replace(stage.evidence, candidates=candidates))

    def held_out(self, space: ParameterSpace, unit: FloatArray) -> dict[str, float]:
        values = space.as_dict(space.from_unit(unit))
        names = self.problem.hold_out
        out = {}
        for name, outcome in zip(names, self.pool.map([Task(values, n) for n in names]), strict=True):
            out[name] = (
                residual(self.problem.recordings[name], outcome.series, self.fit.noise, self.offsets).rms
                if isinstance(outcome, Trajectory)
                else float("inf")
            )
        return out

    def fitted_error(self, polished: Polished) -> float:
        """Root mean square on the fitted recordings [unit]."""
        return float(np.sqrt(polished.rss / polished.count) * self.fit.noise.sd)

    def curves(self, first: Stage, after: Candidate) -> dict[str, dict[str, tuple[Any, list[str], str]]]:
        """Error over time and shape, before and after, for the report."""
        spaces = [(self.space(()), first.plain.unit), (after.space, after.fit.unit)]
        names = [*self.problem.fit_on, *self.problem.hold_out]
        tasks = [Task(s.as_dict(s.from_unit(u)), n) for n in names for s, u in spaces]
        outcomes = list(self.pool.map(tasks))
        out: dict[str, dict[str, tuple[Any, list[str], str]]] = {}
        for k, name in enumerate(names):
            recording = self.problem.recordings[name]
            before, later = outcomes[2 * k], outcomes[2 * k + 1]
            if not (isinstance(before, Trajectory) and isinstance(later, Trajectory)):
                continue
            unit = recording.series.unit
            errors = [residual(recording, o.series, self.fit.noise, self.offsets).by_time for o in (before, later)]
            out[name] = {
                "time": (recording.series.time, ["time"], "s"),
                "error_before": (errors[0], ["time"], unit),
                "error_after": (errors[1], ["time"], unit),
                "predicted_before": (before.series.points, ["time", "predicted_point", "axis"], unit),
                "predicted_after": (later.series.points, ["time", "predicted_point", "axis"], unit),
                "vertices_before": (before.vertices, ["time", "vertex", "axis"], "m"),
                "vertices_after": (later.vertices, ["time", "vertex", "axis"], "m"),
            }
        return out
