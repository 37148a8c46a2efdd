"""One effect after the other: forward while something is left, in pairs where one alone is not enough, and back."""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from ...core.arrays import FloatArray
from .candidate import Candidate
from .pairs import Pair, level_with_first, partners, promising_pairs
from .settle import settled
from .stage import Stage, run_stage
from .tournament import MORE_EVALUATIONS
from .verdict import (
    HELD_OUT_SHARE,
    HELD_OUT_SLACK,
    MARGIN,
    SHARE_LEFT,
    Decision,
    Evidence,
    Objection,
    Verdict,
    nothing_named,
    short_of_a_name,
)
from .work import Work

#: Effects that one diagnosis may name.
MOST_EFFECTS = 3
#: Beside the lead of a pair as many candidates are tried as second effects, those that promise most.
PARTNERS = 8


@dataclass(frozen=True)
class Doubt:
    """Why an effect that seemed to be the answer is not, seen where it fits.

    Args:
        effect: its name.
        explained: share of the excess misfit, by the numerics as they are there.
        objection: what it lacks.
    """

    effect: str
    explained: float
    objection: Objection


@dataclass(frozen=True, eq=False)
class Findings:
    """What all stages together say.

    Args:
        verdict: of them.
        effects: that it is about, in the order in which they were found.
        first: the first stage, with every candidate alone.
        last: the stage that the verdict comes from.
        after: the model with what was named; where nothing was, the candidate that came nearest.
        further: effects beside the named ones of which one is missing, too, and which is not to be told; beside tied
            ones, an effect that is missing whichever of them it is.
        rest: what was decided with the named ones in the model; None where that was not looked into.
        rivals: models, by their effects, that go with one of ``further`` each, or with one of the tied ones and that.
        together: where nothing was named, the two effects that left least, and others that the data cannot tell from
            them; none if no two were tried.
        unjudged: the budget ended before it was known whether it is these two.
        doubt: of the one effect that had a name before it was looked at where it fits.
    """

    verdict: Verdict
    effects: tuple[str, ...]
    first: Stage
    last: Stage
    after: Candidate
    further: tuple[str, ...] = ()
    rest: Decision | None = None
    rivals: tuple[tuple[tuple[str, ...], Candidate], ...] = ()
    together: tuple[Pair, ...] = ()
    unjudged: bool = False
    doubt: Doubt | None = None


def find(work: Work, names: list[str], start: FloatArray) -> Findings:
    """Find what is missing among candidates ``names``, the plain model's fit starting at ``start`` (unit cube)."""
    first = settled(work, run_stage(work, (), names, start))
    verdict = first.decision.verdict
    if verdict in ("no-misfit", "cannot-tell"):
        return Findings(verdict, (), first, first, _nearest(first))
    left = first.evidence.left(first.evidence.nearest) > 0.0
    pairs = promising_pairs(work, first) if left else []
    two = _pair(work, names, first, pairs) if verdict == "none" or _outdone(first, pairs) else None
    if isinstance(two, Findings):
        return two
    if verdict == "none":
        level = level_with_first(first, pairs)
        return Findings("none", (), first, first, _nearest(first), together=level, unjudged=two == "unjudged")
    found = Findings(verdict, first.decision.effects, first, first, first.chosen)
    if verdict == "tied":
        return _with_another(work, names, found, pairs) or found
    return _forward(work, names, found, pairs)


def confirmed(found: Findings, joint: Evidence) -> Findings:
    """No name for one effect that lacks something by the numerics as they are where it fits.

    The stage that named it knew those of the model without it, which was bent far off to make up for what is missing.
    """
    if found.verdict != "named" or len(found.effects) > 1:
        return found
    if (why := short_of_a_name(joint, joint.nearest)) is None:
        return found
    return _doubted(found, joint, why)


def borne_out(found: Findings, joint: Evidence, before: float, after: float) -> Findings:
    """No name for one effect with which a user's model is further off on held-out motions, if these would show it.

    Beside what numerics may be off by, one that only moves what a cloth does by chance may seem to lessen the error.

    Args:
        found: by the evidence.
        joint: the model as it was beside all that was found.
        before, after: root mean square errors on held-out recordings, fitted as a user does [unit].
    """
    if found.verdict != "named" or len(found.effects) > 1 or not joint.nearest.shown_held_out:
        return found
    worse = after**2 > (1.0 + HELD_OUT_SLACK) * before**2
    return _doubted(found, joint, "held-out") if worse else found


def _doubted(found: Findings, joint: Evidence, why: Objection) -> Findings:
    doubt = Doubt(found.after.name, joint.explained(joint.nearest), why)
    verdict = nothing_named(found.first.evidence)
    return Findings(verdict, (), found.first, found.first, found.after, doubt=doubt)


def _forward(work: Work, names: list[str], found: Findings, pairs: list[Pair]) -> Findings:
    """Add effects as long as one is named; whether there is a misfit left to look into, each stage says itself."""
    while len(found.effects) < MOST_EFFECTS and work.may_go_on():
        rest = [n for n in names if n not in found.effects]
        if not rest:
            return replace(found, rest=Decision("none", ()))
        stage = _stage(work, found.first, found.effects, rest, found.after.fit.unit, pairs)
        # the same model, fitted to the end, and its numerics looked at where it fits
        after = work.judged(replace(found.after, fit=stage.plain))
        found = replace(found, after=after, rest=stage.decision)
        if stage.decision.verdict == "tied":
            rivals = tuple(((*found.effects, n), stage.candidate(n)) for n in stage.decision.effects)
            return replace(found, further=stage.decision.effects, rivals=rivals)
        if stage.decision.verdict != "named":
            break
        effects = (*found.effects, stage.chosen.name)
        found = _without_idle(work, replace(found, effects=effects, last=stage, after=stage.chosen, rest=None))
        if len(found.effects) < len(effects):
            break  # one was dropped again: from here it would go in circles
    return found


def _stage(
    work: Work, first: Stage, effects: tuple[str, ...], names: list[str], start: FloatArray, pairs: list[Pair]
) -> Stage:
    """A later stage. Candidates start from where they were alone and in pairs: of thresholds no derivative tells."""
    at = dict(zip(work.space(effects).names, start, strict=True))
    points: dict[str, list[dict[str, float]]] = {}
    for pair in pairs:
        for name in set(pair.names).intersection(names):
            if set(pair.names) == {*effects, name}:
                points.setdefault(name, []).append(pair.values)
    for name in names:
        alone, look = first.candidate(name), first.looks[name]
        own, zero = alone.fit.unit[alone.base :], look.start[look.base :]
        if not np.array_equal(own, zero):
            points.setdefault(name, []).append(at | dict(zip(alone.space.names[alone.base :], own, strict=True)))
    hints = {}
    for name, values in points.items():
        order = work.space((*effects, name)).names
        hints[name] = np.array([[point[n] for n in order] for point in values])
    return settled(work, run_stage(work, effects, names, start, hints))


def _outdone(first: Stage, pairs: list[Pair]) -> bool:
    """Are two other effects together so much better than what is named that it does not take part in the answer?

    One may stand in for two: a camera that is off by some millimetres for a grasp that gives and a base that leans.
    """
    named = set(first.decision.effects)
    if not pairs or named & set(pairs[0].names):
        return False
    e, best = first.evidence, pairs[0].both
    rivals = [first.chosen, *(p.both for p in pairs if named & set(p.names))]
    return not any(e.level(rival, best) for rival in rivals)


def _pair(work: Work, names: list[str], first: Stage, pairs: list[Pair]) -> Findings | Literal["rejected", "unjudged"]:
    """Two effects of like strength hide each other: with one of them in the model, is another one named?"""
    if not pairs:
        return "rejected"
    if not work.may_go_on():
        return "unjudged"
    lead = pairs[0].lead
    likely = {*partners(first, lead.name, PARTNERS), *(n for p in pairs if lead.name in p.names for n in p.names)}
    rest = [n for n in names if n in likely - {lead.name}]
    stage = _stage(work, first, (lead.name,), rest, lead.fit.unit, pairs)
    if stage.decision.verdict != "named":
        return "unjudged" if stage.decision.unfinished else "rejected"
    joint = work.jointly(stage.chosen, first.plain)
    if short_of_a_name(joint, joint.nearest) is not None:
        return "rejected"
    named = Findings("named", (lead.name, stage.chosen.name), first, stage, stage.chosen)
    return _forward(work, names, _without_idle(work, named), pairs)


def _with_another(work: Work, names: list[str], found: Findings, pairs: list[Pair]) -> Findings | None:
    """A second effect beside those that are tied; with it in the model they may be told apart."""
    first = found.first
    rest = [n for n in names if n not in found.effects]
    if first.evidence.left(found.after) == 0.0 or not rest or not work.may_go_on():
        return None
    best = [n for n in (pairs[0].names if pairs else ()) if n in found.effects]
    lead = first.candidate(best[0]) if best else found.after
    stage = _stage(work, first, (lead.name,), rest, lead.fit.unit, pairs)
    if stage.decision.verdict != "named":
        return None
    second = stage.chosen
    others = [n for n in found.effects if n != lead.name]
    beside = {lead.name: second} | {n: _beside(work, first.candidate(n), second) for n in others}
    order = sorted(beside, key=lambda n: beside[n].rss)
    e, ahead = stage.evidence, beside[order[0]]
    # one that is behind where it was fitted, and not where it was not, is not ruled out; where both miss held-out
    # motions by much, the one that misses them by a little more may be the right one
    held_out = ahead.held_out_white + HELD_OUT_SHARE * max(0.0, ahead.held_out_white - 1.0)
    near = [n for n in order if e.level(beside[n], ahead) or beside[n].held_out_white <= held_out]
    if len(near) > 1:
        rivals = tuple(((n, second.name), beside[n]) for n in near)
        return Findings("tied", tuple(near), first, stage, ahead, further=(second.name,), rivals=rivals)
    named = Findings("named", (order[0], second.name), first, stage, ahead)
    return _forward(work, names, _without_idle(work, named), pairs)


def _beside(work: Work, rival: Candidate, second: Candidate) -> Candidate:
    """The model with a rival in place of the effect that ``second`` was found beside."""
    effects = (rival.name, second.name)
    space, values = work.space(effects), dict(zip(second.space.names, second.fit.unit, strict=True))
    values |= dict(zip(rival.space.names, rival.fit.unit, strict=True))
    fit = work.searched(effects, np.array([values[n] for n in space.names]), MORE_EVALUATIONS)
    return work.judged(replace(second, space=space, base=len(rival.space), fit=fit))


def _without_idle(work: Work, found: Findings) -> Findings:
    """Backward: drop an effect, named before the last one, that the others do without."""
    best = found.after
    left = found.last.evidence.left(best)
    for dropped in found.effects[:-1]:
        others = tuple(e for e in found.effects if e != dropped)
        space = work.space(others)
        kept = [best.space.names.index(name) for name in space.names]
        fit = work.searched(others, best.fit.unit[kept], MORE_EVALUATIONS)
        if fit.rss - best.rss < MARGIN + SHARE_LEFT * left:
            base = len(work.space(others[:-1]))
            after = replace(best, name=others[-1], space=space, base=base, fit=fit)
            return replace(found, effects=others, after=work.judged(after))
    return found


def _nearest(stage: Stage) -> Candidate:
    return min(stage.evidence.candidates, key=lambda c: c.rank)
