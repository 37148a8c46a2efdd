"""What a diagnosis left open, and the models that go with it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from ....core.arrays import FloatArray
from ....core.errors import InputError, StepMissingError
from ....core.powerless import why_powerless
from ....core.registry import REGISTRY
from ....core.study import Problem, Study
from ...sequential.result import FitResult
from .goal import Purpose
from .rivals import Rival, kept_rival, refitted_rival


@dataclass(frozen=True)
class Opening:
    """A question for the next experiment.

    Args:
        purpose: what is asked.
        effects: that are tied, or were not seen.
        beside: effects that are missing, too, whichever of those it is: every model has them.
        models: what the diagnosis kept of its models.
        means: coefficients that the diagnosis found, ``effect.coefficient`` [units].
        candidates: effects that it tried.
        reason: why no motion is asked for.
        undecided: the diagnosis compared them, and does not go by what they differ by on the recordings.
    """

    purpose: Purpose
    effects: tuple[str, ...] = ()
    beside: tuple[str, ...] = ()
    models: tuple[Mapping[str, Any], ...] = ()
    means: Mapping[str, float] = field(default_factory=dict)
    candidates: int = 1
    reason: str = ""
    undecided: bool = False

    @property
    def all_effects(self) -> tuple[str, ...]:
        return (*self.beside, *self.effects)


def opening_of(study: Study, asked: Sequence[str] = ()) -> Opening:
    """What is open: what was asked for, else what was left tied, else what was not seen.

    Raises:
        StepMissingError: nothing was asked for, and the study has not been diagnosed.
        InputError: an effect that was asked for is in the model already, cannot act here, or is named twice.
    """
    try:
        attributes: dict[str, Any] = dict(study.step_results("diagnose").attrs)
    except StepMissingError:
        if not asked:
            raise
        attributes = {"result": {"verdict": "", "effects": [], "candidates": []}}
    result = attributes["result"]
    rows = result["candidates"]
    models = tuple(attributes.get("models") or ())
    means = {f"{r['name']}.{c}": float(v["mean"]) for r in rows for c, v in r["coefficients"].items()}
    kept: dict[str, Any] = {"models": models, "means": means, "candidates": len(rows) or 1}
    if asked:
        _check(study, asked)
        return Opening("tied" if len(asked) > 1 else "unseen", tuple(asked), **kept)
    named, further = tuple(result["effects"]), tuple(result.get("further") or ())
    if result["verdict"] == "tied":
        return Opening("tied", named, further, undecided=True, **kept)
    if further:
        return Opening("tied", further, named, undecided=True, **kept)
    hidden = [r["name"] for r in rows if r["identifiability"] == 0.0 and r["name"] not in named]
    if hidden and not result.get("unfinished"):
        return Opening("unseen", tuple(hidden), named, **kept)
    return Opening("nothing", reason=_no_question(study, result), **kept)


def _no_question(study: Study, result: Mapping[str, Any]) -> str:
    """Why a motion would tell no more, and what would."""
    named = result["effects"]
    if named:
        told = f"{' and '.join(named)} {'is' if len(named) == 1 else 'are'} named"
        return f"{told}, and no other candidate would have been hidden"
    if result.get("unfinished"):
        return (
            "the diagnosis ended before what promises most was refitted; allow several times as many simulations "
            "([diagnose] simulations), and diagnose again"
        )
    if result["verdict"] != "none":
        return "no effects are tied, and these data show every candidate"
    what = "something is missing that is none of the candidates, and these data show every one of them"
    if study.problem.recordings[study.problem.fit_on[0]].series.unit == "px":
        return f"{what}; of points in metres muslin unknown estimates the missing force itself"
    return f"{what}; muslin unknown {study.path} estimates the missing force itself"


def tied_rivals(
    study: Study, problem: Problem, fit: FitResult, plain: FloatArray, opening: Opening
) -> tuple[list[Rival], int]:
    """The models with each of the tied effects, and the rollouts that refitting them took.

    They are compared by how well they fit, so either all are taken from the diagnosis, or none.
    """
    beside = opening.beside
    kept = {n: kept_rival(problem, (n, *beside), opening.models) for n in opening.effects}
    if all(kept.values()):
        return [replace(r, name=n) for n, r in kept.items() if r is not None], 0
    out = []
    with study.pool(problem) as pool:
        for k, name in enumerate(opening.effects):
            study.progress(f"refitting {name}", k + 1, len(opening.effects))
            out.append(refitted_rival(study, problem, pool, fit, (name, *beside), plain, opening.means))
        count = pool.count
    return out, count


def _check(study: Study, asked: Sequence[str]) -> None:
    problem = study.problem
    for name in asked:
        effect = REGISTRY.get("effect", name)
        if name in study.config.effects:
            raise InputError(f"{name!r} is in the model of {study.path} already, so it is not in question")
        if not effect.candidate and len(effect.coefficients) > 1:
            raise InputError(f"{name!r} has so many coefficients that it explains anything; name another effect")
        reason = why_powerless(effect, problem.simulator, problem.scenarios[problem.fit_on[0]])
        if reason is not None:
            raise InputError(reason)
    twice = sorted({n for n in asked if list(asked).count(n) > 1})
    if twice:
        raise InputError(f"{twice[0]!r} is named twice; name different effects")
