"""The step ``diagnose``: which physical effect is missing from the model?"""

import time
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...core.arrays import FloatArray
from ...core.registry import REGISTRY
from ...core.store import put, read, storage_errors
from ...core.study import Study
from ..sequential.result import load_fit
from .candidate import (
    Candidate,
    root_mean_square,
)
from .candidate_names import candidate_names
from .sentences import explain
from .stage import Stage, Work, chosen_of
from .verdict import has_misfit

#: Effects that one diagnosis may name, one after the other.
MOST_EFFECTS = 2


@dataclass(frozen=True)
class Diagnosis:
    """What :func:`diagnose` found: the JSON of ``muslin diagnose --json`` and a text for people."""

    result: dict[str, Any]
    paragraphs: tuple[str, ...]

    def to_json(self) -> dict[str, Any]:
        return self.result

    def text(self) -> str:
        return "\n".join(self.paragraphs)


def diagnose(study: Study) -> Diagnosis:
    """Refit the model with each candidate effect and say what that shows."""
    began = time.monotonic()
    fit = load_fit(study)
    names = candidate_names(study)
    effects = {n: REGISTRY.get("effect", n) for n in names}
    problem = replace(study.problem, effects={**study.problem.effects, **effects})
    with study.pool(problem) as pool:
        work = Work(study, problem, pool, fit)
        stages = [work.stage((), names, _fitted(study))]
        while (
            stages[-1].decision.verdict == "named"
            and len(stages) < MOST_EFFECTS
            and has_misfit(replace(stages[-1].evidence, rss_plain=chosen_of(stages[-1]).rss))
        ):
            chosen = chosen_of(stages[-1])
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


def _fitted(study: Study) -> FloatArray:
    return read(study.step_results("fit"), "estimate_unit")


def _last_model(stages: list[Stage]) -> Candidate:
    """The model with what was named; where nothing was, the candidate that came nearest."""
    named = [s for s in stages if s.decision.verdict == "named"]
    if named:
        return chosen_of(named[-1])
    if stages[0].decision.effects:  # tied: the first of them
        return chosen_of(stages[0])
    return min(stages[0].evidence.candidates, key=lambda c: c.rss)


def _result(
    study: Study,
    stages: list[Stage],
    named: tuple[str, ...],
    after: Candidate,
    work: Work,
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
