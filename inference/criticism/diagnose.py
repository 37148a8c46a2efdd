"""The step ``diagnose``: which physical effect is missing from the model?"""

import time
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...core.arrays import FloatArray
from ...core.parameters import ParameterSpace
from ...core.registry import REGISTRY
from ...core.rollout import Trajectory
from ...core.store import put, read, storage_errors
from ...core.study import Problem, SimulationPool, Study, Task
from ..fitting import FitResult, load_fit, offsets_of
from ..polish import Objective, Polished, polish
from ..residuals import residual
from .candidate import Candidate, best_starts, effect_start, responds, root_mean_square, screening_points, unchanged
from .candidate_names import candidate_names
from .sentences import explain
from .verdict import Decision, Evidence, decide, has_misfit

#: Effects that one diagnosis may name, one after the other.
MOST_EFFECTS = 2
#: Least-squares evaluations for every candidate, for the contenders on top, and for the most promising of these.
FIRST_EVALUATIONS, CONTENDER_EVALUATIONS, MORE_EVALUATIONS = 2, 4, 10
#: Further starts from which the best candidate is polished.
RESTARTS = 2
#: How many of the candidates go on after the first look: with a dozen effects that act, most are far behind at once.
CONTENDERS = 6
#: The candidates that are polished to the end: this many, and all that explain half of what the best does.
FINALISTS = 2


@dataclass(frozen=True)
class Diagnosis:
    """What :func:`diagnose` found: the JSON of ``muslin diagnose --json`` and a text for people."""

    result: dict[str, Any]
    paragraphs: tuple[str, ...]

    def to_json(self) -> dict[str, Any]:
        return self.result

    def text(self) -> str:
        return "\n".join(self.paragraphs)


@dataclass(frozen=True, eq=False)
class _Stage:
    """The model so far, its best fit, and every candidate beside it."""

    effects: tuple[str, ...]
    plain: Polished
    evidence: Evidence
    decision: Decision


def diagnose(study: Study) -> Diagnosis:
    """Refit the model with each candidate effect and say what that shows."""
    began = time.monotonic()
    fit = load_fit(study)
    names = candidate_names(study)
    effects = {n: REGISTRY.get("effect", n) for n in names}
    problem = replace(study.problem, effects={**study.problem.effects, **effects})
    with study.pool(problem) as pool:
        work = _Work(study, problem, pool, fit)
        stages = [work.stage((), names, _fitted(study))]
        while (
            stages[-1].decision.verdict == "named"
            and len(stages) < MOST_EFFECTS
            and has_misfit(replace(stages[-1].evidence, rss_plain=_chosen(stages[-1]).rss))
        ):
            chosen = _chosen(stages[-1])
            done = (*stages[-1].effects, chosen.name)
            rest = [n for n in names if n not in done]
            if not rest:
                break
            stages.append(work.stage(done, rest, chosen.fit))
        named = tuple(e for s in stages if s.decision.verdict == "named" for e in s.decision.effects)
        after = _last_model(stages)
        curves = work.curves(stages[0], after)
        count = pool.count
    result = _result(study, stages, named, after, work, count, time.monotonic() - began)
    together = stages[0].evidence.explained(after)
    paragraphs = explain(result, effects, stages[0].evidence, together, len(problem.hold_out))
    with storage_errors(study.results_path):
        group = study.results("r+").create_group("diagnose", overwrite=True)
        for name, arrays in curves.items():
            sub = group.create_group(name)
            for key, (data, dims, unit) in arrays.items():
                put(sub, key, data, dims, unit)
        group.attrs.update({"result": result, "text": list(paragraphs), "fingerprint": study.fingerprint("diagnose")})
        group.attrs["finished"] = True
    return Diagnosis(result, tuple(paragraphs))


class _Work:
    """Everything that stages share."""

    def __init__(self, study: Study, problem: Problem, pool: SimulationPool, fit: FitResult) -> None:
        self.study, self.problem, self.pool, self.fit = study, problem, pool, fit
        self.offsets = offsets_of(study)
        self.starts = problem.space.to_unit(fit.samples)[: 4 * study.config.diagnose.draws]

    def space(self, effects: tuple[str, ...]) -> ParameterSpace:
        return self.problem.with_effects(*effects).space

    def objective(self, effects: tuple[str, ...]) -> Objective:
        return Objective(self.pool, self.space(effects), self.problem.fit_on, self.fit.noise, self.offsets)

    def stage(self, effects: tuple[str, ...], names: list[str], plain: Polished | FloatArray) -> _Stage:
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
        return _Stage(effects, plain, evidence, decide(evidence))

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
        """Polish the best of the first look further; the others stay as they are."""
        out = []
        for k, c in enumerate(sorted(candidates, key=lambda c: c.rss)):
            if k < CONTENDERS:
                self.study.progress(f"looking closer at {c.name}", k + 1, min(CONTENDERS, len(candidates)))
                fit = polish(self.objective((*effects, c.name)), c.fit.unit, CONTENDER_EVALUATIONS)
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
                if k == 0:  # what the leader leaves would call for a second effect
                    c = self.again(effects, c)
            out.append(c)
        return out

    def again(self, effects: tuple[str, ...], c: Candidate) -> Candidate:
        """Polish from other starts too, as a fit may have stopped in a side valley."""
        objective = self.objective((*effects, c.name))
        rng = np.random.default_rng([self.study.config.study.seed, 53, *c.name.encode()])
        points = screening_points(c.space, c.base, c.fit.unit[None, : c.base], self.study.config.diagnose.draws, rng)
        fits = [polish(objective, p, MORE_EVALUATIONS) for p in best_starts(objective, points)[:RESTARTS]]
        return replace(c, fit=min([c.fit, *fits], key=lambda p: p.rss))

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

    def curves(self, first: _Stage, after: Candidate) -> dict[str, dict[str, tuple[Any, list[str], str]]]:
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


def _fitted(study: Study) -> FloatArray:
    return read(study.step_results("fit"), "estimate_unit")


def _chosen(stage: _Stage) -> Candidate:
    return next(c for c in stage.evidence.candidates if c.name == stage.decision.effects[0])


def _last_model(stages: list[_Stage]) -> Candidate:
    """The model with what was named; where nothing was, the candidate that came nearest."""
    named = [s for s in stages if s.decision.verdict == "named"]
    if named:
        return _chosen(named[-1])
    if stages[0].decision.effects:  # tied: the first of them
        return _chosen(stages[0])
    return min(stages[0].evidence.candidates, key=lambda c: c.rss)


def _result(
    study: Study,
    stages: list[_Stage],
    named: tuple[str, ...],
    after: Candidate,
    work: _Work,
    count: int,
    seconds: float,
) -> dict[str, Any]:
    first = stages[0]
    e = first.evidence
    held = not np.isnan(e.held_out_plain)
    before = e.held_out_plain if held else work.fitted_error(first.plain)
    later = root_mean_square(list(after.held_out.values())) if held else work.fitted_error(after.fit)
    rows = []
    for c in sorted(e.candidates, key=lambda c: c.rss):
        # of effects that were named together, what they are together
        coefficients = after.coefficients_of(c.name) if c.name in named else c.coefficients
        rows.append(
            {
                "name": c.name,
                "coefficients": {k: {"mean": m, "sd": s, "unit": u} for k, (m, s, u) in coefficients.items()},
                "explained": e.explained(c),
                "z": e.z(c),
                "held_out_before": e.held_out_plain if held else None,
                "held_out_after": e.held_out(c) if held else None,
                "identifiability": c.surviving if c.visible else 0.0,
            }
        )
    return {
        "verdict": first.decision.verdict,
        "effects": list(named or first.decision.effects),
        "candidates": rows,
        "error": {
            "noise": work.fit.noise.sd,
            "before": before,
            "after": later if named or first.decision.verdict == "tied" else before,
            "unit": work.fit.noise.unit,
        },
        "simulations": count,
        "seconds": seconds,
        "seed": study.config.study.seed,
    }
