"""A diagnosis in words: the verdict, what it rests on, where, what was ruled out and why, and how to be sure."""

from typing import Any

import numpy as np

from ...core.effect import Effect
from ...core.study import Study
from .caveats import budget, elsewhere, further, invisible, length, numerics, rest, small, unrepeatable, untried
from .verdict import EXPLAINS, MARGIN

#: Candidates that explain at least this share are told one by one.
_WORTH_TELLING = 0.2
#: A coefficient known to this part of its size needs no better experiment.
_KNOWN = 0.1
#: A noise that is known less well than this [relative] is told with how well.
_VAGUE = 0.1


def told(study: Study, result: dict[str, Any], effects: dict[str, type[Effect]]) -> dict[str, str]:
    """One paragraph for each question that a reader has; empty ones are left out.

    Args:
        study: that was diagnosed.
        result: the JSON of the diagnosis.
        effects: classes by name.
    """
    parts = {
        "verdict": _verdict(result, effects),
        "small": small(result),
        "further": further(result),
        "rest": rest(result),
        "budget": budget(result),
        "elsewhere": elsewhere(result),
        "where": _where(result),
        "numerics": numerics(result),
        "unrepeatable": unrepeatable(result),
        "unchecked": _unchecked(result),
        "alternatives": _alternatives(result),
        "untried": untried(result),
        "invisible": invisible(result),
        "to_be_sure": _to_be_sure(study, result),
    }
    return {key: text for key, text in parts.items() if text}


def explain(result: dict[str, Any]) -> list[str]:
    """Paragraphs for people, the verdict first."""
    return list(result["told"].values())


def _verdict(result: dict[str, Any], effects: dict[str, type[Effect]]) -> str:
    error, verdict, named = result["error"], result["verdict"], result["effects"]
    fall = _fall(error)
    noise = f"noise {length(error['noise'], error['unit'])}"
    ratio = result["evidence"]["misfit"] ** 0.5
    rows = {c["name"]: c for c in result["candidates"]}
    if verdict == "named":
        symptoms = " and ".join(effects[n].symptom for n in named)
        together, them = " and ".join(named), "it" if len(named) == 1 else "them"
        return (
            f"Missing: {together}. The object {symptoms}; {together} "
            f"{'explains' if len(named) == 1 else 'together explain'} {100 * result['evidence']['explained']:.0f} % of "
            f"the excess misfit, {'; '.join(_coefficients(rows[n]) for n in named)}; {fall}, {noise}. Without {them} "
            f"the model is {ratio:.1f} times the noise off on the fitted recordings, with {them} "
            f"{result['evidence']['misfit_after'] ** 0.5:.2f} times."
        )
    if verdict == "tied":
        shares = "; ".join(
            f"{n} {100 * rows[n]['explained']:.0f} % of the excess, with {_coefficients(rows[n])}" for n in named
        )
        return (
            f"Tied: {' and '.join(named)}. The object {effects[named[0]].symptom}; each explains the misfit about as "
            f"well ({shares}), and these data cannot tell them apart. With "
            f"{' and '.join([named[0], *result['further']])}, {fall}, {noise}."
        )
    if verdict == "none":
        best = result["candidates"][0]
        return (
            f"The model misses something, but none of the candidates is it: the misfit is {ratio:.1f} times the noise, "
            f"and the best candidate, {best['name']}, explains {100 * best['explained']:.0f} % of the excess: "
            f"{_reason(best, result)}.{_in_part(best, error['unit'])}{_together(result['together'], best)}"
        )
    if verdict == "no-misfit":
        vague = error["noise_error"] > _VAGUE
        does = (
            f"and that is known to {100 * error['noise_error']:.0f} % only"
            if vague
            else "which is what noise alone does"
        )
        return (
            f"No misfit: the model differs from the measurement by {ratio:.2f} times the noise of "
            f"{length(error['noise'], error['unit'])}, {does}."
        )
    if result["unfinished"]:
        return (
            f"Cannot tell yet: the model misses something, {ratio:.1f} times the noise, but the budget ended after "
            f"{result['simulations']} simulations, before what promises most was refitted; the ranking is that of a "
            "rough search."
        )
    return (
        "Cannot tell: the model fits, but these data would fit as well if an effect of ordinary strength were missing."
    )


def _fall(error: dict[str, Any]) -> str:
    where = "held-out error" if error["held_out"] else "error on the fitted recordings"
    if np.isnan(error["before"]):
        return f"{where} not known (one of the two models cannot be simulated there)"
    return f"{where} {length(error['before'], error['unit'])} → {length(error['after'], error['unit'])}"


def _in_part(best: dict[str, Any], unit: str) -> str:
    """What a candidate is good for that is not the answer, where motions that it was not fitted to get better by it."""
    if not _is_a_part(best):
        return ""
    if np.isinf(best["held_out_before"]):
        return " It is a part of the answer at most: with it held-out motions can be simulated, and without it not."
    return (
        f" It is a part of the answer at most: with it the held-out error goes "
        f"{length(best['held_out_before'], unit)} → {length(best['held_out_after'], unit)}."
    )


def _together(two: dict[str, Any] | None, best: dict[str, Any]) -> str:
    """What two effects at once explain, where that is more than the best one does."""
    if two is None or two["explained"] < best["explained"] + _WORTH_TELLING:
        return ""
    but = "these data do not tell that it is these two"
    if two["explained"] < EXPLAINS:
        but = "not enough for a name"
    elif not two["judged"]:
        but = "the budget ended before it was known whether it is these two"
    others = [f"{' and '.join(p['effects'])} ({100 * p['explained']:.0f} %)" for p in two["alike"]]
    as_much = f": {', '.join(others[:3])} may be it as well" if others else ""
    told = f"{' and '.join(two['effects'])} explain {100 * two['explained']:.0f} %, which is more, but {but}"
    return f" Together {told}{as_much}."


def _is_a_part(best: dict[str, Any]) -> bool:
    before, after = best["held_out_before"], best["held_out_after"]
    return best["explained"] >= _WORTH_TELLING and before is not None and after < before


def _where(result: dict[str, Any]) -> str:
    where = result["where"]
    if where is None:
        return ""
    point = "" if where["point"] is None else f", most at point {where['point']}"
    return (
        f"Where: {100 * where['share']:.0f} % of the error that goes is in {where['recording']}, most of it from "
        f"{where['from']:.2f} to {where['to']:.2f} s{point}."
    )


def _unchecked(result: dict[str, Any]) -> str:
    """That no held-out motion speaks for what was found, where none would show it."""
    named = result["effects"]
    if not named or any(c["held_out_shows"] is not False for c in result["candidates"] if c["name"] in named):
        return ""
    return (
        f"Not checked: held-out motions are too gentle to show {' and '.join(named)} as strong as it is here, so what "
        "was not fitted says nothing for or against it; hold out a motion like those that were fitted."
    )


def _alternatives(result: dict[str, Any]) -> str:
    verdict, named = result["verdict"], result["effects"]
    about = named if named else [result["candidates"][0]["name"]]
    if verdict in ("no-misfit", "cannot-tell"):
        return ""
    rivals = [c for c in result["candidates"] if c["name"] not in (*about, *result["further"])]
    near = [c for c in rivals if c["explained"] > _WORTH_TELLING]
    if not near:
        visible = [c for c in rivals if c["objection"] != "invisible"]
        tried = [c for c in visible if c["tried"]]
        if not tried:
            return ""
        every = f"all {len(tried)} others that these data can show"
        if len(tried) < len(visible):
            every = f"{len(tried)} of {len(visible)} others that these data can show"
        return f"Ruled out: {every}; none explains a fifth of the misfit."
    said = "; ".join(f"{c['name']} ({100 * c['explained']:.0f} %: {_reason(c, result)})" for c in near[:4])
    rest = f"; and {len(near) - 4} more that explain less" if len(near) > 4 else ""
    return f"Ruled out: {said}{rest}."


def _reason(candidate: dict[str, Any], result: dict[str, Any]) -> str:
    why = candidate["objection"]
    if why == "chance":
        return "no more than chance gives"
    if why in ("zero", "invisible"):
        return "its coefficients may as well be zero"
    if why == "little":
        return f"at least {100 * EXPLAINS:.0f} % is asked"
    if why == "held-out":
        little = candidate["held_out_after"] < candidate["held_out_before"]
        return f"motions that it was not fitted to get {'better by too little' if little else 'no better'}"
    first = result["candidates"][0]["name"]
    if result["verdict"] == "named" and first not in result["effects"] and candidate["behind"] < MARGIN:
        named = result["effects"]
        return f"{' and '.join(named)} {'leaves' if len(named) == 1 else 'together leave'} far less"
    beside = result["further"] if result["verdict"] == "tied" else result["effects"][1:]
    if candidate["behind"] < MARGIN and beside:  # it was level by itself
        return f"behind with {' and '.join(beside)} in the model"
    return f"{candidate['behind']:.0f} behind {first} in -2 log likelihood"


def _whether_these_two(study: Study, result: dict[str, Any]) -> str:
    """What to do where the budget ended before a pair that explains enough was held against others."""
    two = result["together"]
    if two is None or two["judged"] or two["explained"] < EXPLAINS:
        return ""
    return (
        f"To be sure: [diagnose] simulations = {2 * result['simulations']}, twice as many, tells whether it is "
        f"{' and '.join(two['effects'])}; muslin add {','.join(two['effects'])} {study.path} makes that model now. "
    )


def _to_be_sure(study: Study, result: dict[str, Any]) -> str:
    verdict = result["verdict"]
    if verdict == "tied":
        return (
            "To be sure: a motion that excites them differently decides, faster, at another frequency, or held still; "
            f"muslin next {study.path} proposes one, and how sure you would be after it."
        )
    if verdict == "none" and study.problem.recordings[study.problem.fit_on[0]].series.unit == "px":
        learn = "To learn more: record points in metres; muslin unknown then estimates the missing force itself."
        return _whether_these_two(study, result) + learn
    if verdict == "none":
        best = result["candidates"][0]
        rest = f"; with muslin add {best['name']} {study.path} the rest may show" if _is_a_part(best) else ""
        return (
            f"{_whether_these_two(study, result)}To learn more: muslin unknown {study.path} estimates the missing "
            f"force itself, shows it on the object, and looks for a law{rest}."
        )
    if result["unfinished"]:
        return "To be sure: allow several times as many simulations ([diagnose] simulations), and diagnose again."
    if verdict == "cannot-tell":
        return f"To be sure: record a motion that excites the object more; muslin next {study.path} proposes one."
    if verdict == "named":
        rows = {c["name"]: c for c in result["candidates"]}
        vague = [
            f"{name} {k.replace('_', ' ')}"
            for name in result["effects"]
            for k, c in rows[name]["coefficients"].items()
            if c["sd"] > _KNOWN * abs(c["mean"])
        ]
        if vague:
            return f"Still vague: {', '.join(vague)} (known to no better than a tenth of its size)."
    return ""


def _coefficients(candidate: dict[str, Any]) -> str:
    parts = []
    for name, c in candidate["coefficients"].items():
        unit = "" if c["unit"] == "1" else f" {c['unit']}"
        parts.append(f"{name.replace('_', ' ')} {c['mean']:.3g} ± {c['sd']:.1g}{unit}")
    return ", ".join(parts)
