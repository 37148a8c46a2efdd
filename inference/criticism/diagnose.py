"""The step ``diagnose``: which physical effect is missing from the model?"""

import time
from dataclasses import replace
from typing import Any

from ...core.arrays import FloatArray
from ...core.registry import REGISTRY
from ...core.store import put, read, storage_errors
from ...core.study import Study
from ..roughness import unrepeatable
from ..sequential.result import load_fit
from .before_after import BeforeAfter
from .candidate import Candidate
from .candidate_names import candidate_names
from .sentences import explain, told
from .stepwise import Findings, borne_out, confirmed, find
from .told import Told
from .verdict import Evidence, has_misfit
from .where import where_it_is
from .work import Work

#: Models whose fits are kept, for steps that go on from them.
KEPT = 4


class Diagnosis(Told):
    """What :func:`diagnose` found: the JSON of ``muslin diagnose --json`` and a text for people."""


def diagnose(study: Study) -> Diagnosis:
    """Refit the model with each candidate effect and say what that shows."""
    began = time.monotonic()
    fit = load_fit(study)
    study.check_writable()
    names = candidate_names(study)
    effects = {n: REGISTRY.get("effect", n) for n in names}
    problem = replace(study.problem, effects={**study.problem.effects, **effects})
    with study.pool(problem) as pool:
        work = Work(study, problem, pool, fit)
        found = find(work, names, _fitted(study))
        plain = found.first.plain
        joint = work.jointly(found.after, plain, replace(plain, unit=_fitted(study)))
        found = confirmed(replace(found, after=joint.nearest), joint)
        # before is the fit as the user has it; the diagnosis' own plain fit leaves to numerics what they may explain
        started = work.space(()), _fitted(study)
        changed = found.verdict in ("named", "tied")
        later = work.as_a_user_fits(found.after) if changed else found.after.fit.unit
        pair = BeforeAfter(work, started, (found.after.space, later))
        found = borne_out(found, joint, *pair.error(problem.hold_out))
        surely = _surely(work, found)
        count = work.simulations
    result = _result(study, found, surely, joint, pair, work, count, time.monotonic() - began)
    result["told"] = told(study, result, effects)
    paragraphs = explain(result)
    with storage_errors(study.results_path):
        group = study.results("r+").create_group("diagnose", overwrite=True)
        for name, arrays in pair.arrays().items():
            sub = group.create_group(name)
            for key, (data, dims, unit) in arrays.items():
                put(sub, key, data, dims, unit)
        group.attrs.update(
            {
                "result": result,
                "text": list(paragraphs),
                "models": _models(found),
                "fingerprint": study.fingerprint("diagnose"),
            }
        )
        group.attrs["finished"] = True
    return Diagnosis(result, tuple(paragraphs))


def _surely(work: Work, found: Findings) -> dict[str, Candidate]:
    """The models whose coefficients are told, by effect, with what is known of them."""
    if found.verdict == "named":
        return dict.fromkeys(found.effects, work.told(found.after))
    return {n: work.told(found.first.candidate(n)) for n in found.effects}


def _fitted(study: Study) -> FloatArray:
    return read(study.step_results("fit"), "estimate_unit")


def _models(found: Findings) -> list[dict[str, Any]]:
    """The fitted models that came nearest, best first."""
    best = sorted(found.first.evidence.candidates, key=lambda c: c.rank)[:KEPT]
    best += [c for c in found.first.evidence.candidates if c.name in found.effects and c not in best]
    each = [([c.name], c) for c in best] + [(list(names), c) for names, c in found.rivals]
    if len(found.effects) > 1 and found.verdict == "named":
        each.insert(0, (list(found.effects), found.after))
    return [
        {
            "effects": names,
            "values": c.space.as_dict(c.space.from_unit(c.fit.unit)),
            "parameters": list(c.space.names),
            "unit": c.fit.unit.tolist(),
            "covariance": c.fit.widened.tolist(),
            "rss": c.rss,
        }
        for names, c in each
    ]


def _together(found: Findings, e: Evidence) -> dict[str, Any] | None:
    """Two effects that explain most where nothing is named, and others that explain as much."""
    told = [{"effects": list(p.names), "explained": e.explained(p.both)} for p in found.together]
    return {**told[0], "alike": told[1:], "judged": not found.unjudged} if told else None


def _rest(found: Findings, joint: Evidence, work: Work) -> str | None:
    """What is known of a misfit that stays with all that was named in the model.

    ``"none"``: no candidate explains it; ``"unfinished"``: the budget ended before that was known; ``"open"``: it was
    not looked into, as no more effects are named at once, or one of them was dropped; None: there is no such misfit, or
    nothing was named, or the effects that it is about are told as ``further``.
    """
    if found.verdict != "named" or found.further or joint.left(found.after) == 0.0:
        return None
    if found.rest is not None and not found.rest.unfinished:
        return "none" if found.rest.verdict == "none" else None
    return "unfinished" if work.cut_short else "open"


def _result(
    study: Study,
    found: Findings,
    surely: dict[str, Candidate],
    joint: Evidence,
    pair: BeforeAfter,
    work: Work,
    count: int,
    seconds: float,
) -> dict[str, Any]:
    first, after = found.first, found.after
    e = first.evidence
    problem = work.problem
    before, later = pair.error(problem.hold_out or problem.fit_on)
    fitted = pair.error(problem.fit_on)
    held = bool(problem.hold_out)
    rows = []
    for c in sorted(e.candidates, key=lambda c: c.rank):
        # of effects that were named together, what they are together
        coefficients = surely.get(c.name, c).coefficients_of(c.name)
        doubt = found.doubt if found.doubt is not None and found.doubt.effect == c.name else None
        rows.append(
            {
                "name": c.name,
                "coefficients": {k: {"mean": m, "sd": s, "unit": u} for k, (m, s, u) in coefficients.items()},
                "explained": e.explained(c) if doubt is None else doubt.explained,
                "z": e.z(c),
                "behind": e.behind(c, e.nearest),
                "objection": first.objection(c) if doubt is None else doubt.objection,
                "held_out_before": e.held_out_plain if held else None,
                "held_out_after": e.held_out(c) if held else None,
                "held_out_shows": c.shown_held_out if held else None,
                "identifiability": c.surviving if c.visible else 0.0,
                "refitted": c.refitted,
                "tried": c.tried,
            }
        )
    changed = found.verdict in ("named", "tied")
    return {
        "verdict": found.verdict,
        "effects": list(found.effects),
        "further": list(found.further),
        "rest": _rest(found, joint, work),
        "together": _together(found, e),
        "candidates": rows,
        "error": {
            "noise": work.fit.noise.sd,
            "noise_error": work.fit.noise.relative_error,
            "before": before,
            "after": later if changed else before,
            "unit": work.fit.noise.unit,
            "held_out": held,
            "fitted_before": fitted[0],
            "fitted_after": fitted[1] if changed else fitted[0],
        },
        "evidence": {
            "misfit": joint.rss_plain / joint.count,
            "beyond_noise": has_misfit(e),
            "misfit_after": after.rss / joint.count,
            "held_out": joint.held_out_white if held else None,
            "explained": joint.explained(after),
        },
        "numerics": work.moved,
        "unrepeatable": unrepeatable(work.rough, problem.recordings, work.fit.noise),
        "where": where_it_is(pair, problem.recordings) if changed else None,
        "simulations": count,
        "budget_spent": work.cut_short,
        "unfinished": found.first.decision.unfinished,
        "seconds": seconds,
        "seed": study.config.study.seed,
    }
