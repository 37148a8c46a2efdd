"""The verdict: one sentence that a reader takes away, and one that qualifies it."""

from dataclasses import dataclass
from pathlib import Path

from ...core.errors import MuslinError
from ...core.study.objects import object_of
from ..console import add_command
from .findings import Findings, number
from .words import errors, fall, length, sentence, words


@dataclass(frozen=True)
class Verdict:
    """What is said on top.

    Args:
        label: a word or two, for the tag above the sentence.
        tone: ``"good"``, ``"bad"`` or ``"open"``.
        headline: one big sentence.
        detail: what qualifies it.
        next_step: command that would tell more, or "".
    """

    label: str
    tone: str
    headline: str
    detail: str = ""
    next_step: str = ""


def thing(found: Findings) -> str:
    """What is being looked at, in one word."""
    try:
        kind = object_of(found.study.config.scenario, found.study.path.parent).kind
    except MuslinError:
        return "object"
    return kind if kind in ("cloth", "rope") else "object"


def verdict(found: Findings) -> Verdict:
    """What the study says as far as it has come."""
    file = found.study.path.name
    if found.diagnose is not None:
        return _diagnosed(found)
    if found.compare is None:
        count = len(found.fit.names)
        return Verdict(
            "fitted",
            "open",
            f"{count} parameter{'s' * (count != 1)} fitted; whether the model is right has not been checked yet.",
            next_step=f"muslin compare {file}",
        )
    e = errors(found)
    numbers = f"{length(e['before'], e['unit'])} on the {e['on']} recordings, noise {length(e['noise'], e['unit'])}"
    detail = (str(found.compare.get("text") or "").splitlines() or [""])[-1]  # a table comes before it
    if found.compare.get("adequate") and found.compare.get("elsewhere"):
        fitted = "The fitted model explains the recordings that it was fitted to, but not all that were held out"
        return Verdict("adequate where fitted", "open", f"{fitted}: error {numbers}.", detail)
    if found.compare.get("adequate"):
        return Verdict("adequate", "good", f"The fitted model explains the recordings: error {numbers}.", detail)
    return Verdict(
        "misfit",
        "bad",
        f"The fitted model does not explain the recordings: error {numbers}.",
        detail,
        f"muslin diagnose {file}",
    )


def _diagnosed(found: Findings) -> Verdict:
    assert found.diagnose is not None
    result, e, file = found.diagnose, errors(found), found.study.path.name
    before, noise = (length(e[k], e["unit"]) for k in ("before", "noise"))
    effects = [str(n) for n in result.get("effects") or []]
    named = " and ".join(words(n) for n in effects)
    best = next((c for n in effects for c in found.candidates if c["name"] == n), None)
    detail = " ".join(found.paragraphs[:1])
    if best is not None and result["verdict"] == "named":
        detail = sentence(best, e["unit"], e["noise"], thing(found), errors=False)
    floor = f"noise {noise}"
    both = number(e["before"]), number(e["after"])
    became = f"is {before}" if both[0] is None or both[1] is None else fall(both[0], both[1], e["unit"])
    if result["verdict"] == "named":
        drop = f"the {e['on']} error {became} ({floor})"
        add = "" if found.after_inferred else add_command(Path(file), effects)
        verb, it = ("are", "them") if len(effects) > 1 else ("is", "it")
        within = _after(found, effects)
        told = _cap(f"{named} {verb} missing from the model; with {it if within == named else within}, {drop}.")
        return Verdict("named", "good", told, detail, add)
    if result["verdict"] == "tied":
        rivals = " or ".join(words(n) for n in effects)
        beside = [str(n) for n in result.get("further") or []]
        drop = f"The {e['on']} error is {before}, {floor}."
        if effects and number(e["after"]) is not None:
            within = _after(found, [effects[0], *beside])
            drop = f"With {within}, the {e['on']} error {became} ({floor})."
        add = "" if found.after_inferred or not effects else add_command(Path(file), [effects[0], *beside])
        missing = f"{_cap(rivals)} is missing from the model; these recordings cannot tell which."
        if beside:
            missing += f" Whichever it is, {' and '.join(words(n) for n in beside)} is missing, too."
        return Verdict("tied", "open", f"{missing} {drop}", detail, add)
    text = {
        "none": f"The model misses the measurement by {before} where noise is {noise}, and no candidate explains it.",
        "cannot-tell": f"The error is {before} at {floor}; these recordings cannot show what is missing.",
        "no-misfit": f"Nothing is seen to be missing: the {e['on']} error is {before}, {floor}.",
    }.get(str(result["verdict"]), f"Verdict: {result['verdict']}.")
    if result.get("unfinished"):
        text = f"The error is {before} at {floor}; the budget ended before what promises most was refitted."
    elsewhere = result["verdict"] == "no-misfit" and (result.get("told") or {}).get("elsewhere")
    if elsewhere:
        text = f"Nothing is seen to be missing where it was fitted, but the {e['on']} error is {before}, {floor}."
    tone = {"none": "bad", "no-misfit": "open" if elsewhere else "good"}.get(str(result["verdict"]), "open")
    return Verdict(words(str(result["verdict"])), tone, text, detail)


def _after(found: Findings, named: list[str]) -> str:
    """What the model has whose error is told as after: the added study's effects, or those of the diagnosis."""
    return " and ".join(words(n) for n in (found.after_name.split(", ") if found.after_inferred else named))


def _cap(text: str) -> str:
    return text[:1].upper() + text[1:]
