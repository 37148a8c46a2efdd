"""One effect after the other: forward while something is left, in pairs where one alone is not enough, and back."""

from dataclasses import dataclass, replace

import numpy as np

from ...core.arrays import FloatArray
from .candidate import Candidate
from .settle import settled
from .stage import MORE_EVALUATIONS, Stage, run_stage
from .verdict import MARGIN, SHARE_LEFT, SIGNIFICANT, Decision, Verdict
from .work import Work

#: Effects that one diagnosis may name.
MOST_EFFECTS = 3
#: Where no effect alone is enough, pairs are tried with this many that explain at least this share of the misfit.
LEADS, LEADING = 2, 0.2


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
    """

    verdict: Verdict
    effects: tuple[str, ...]
    first: Stage
    last: Stage
    after: Candidate
    further: tuple[str, ...] = ()
    rest: Decision | None = None


def find(work: Work, names: list[str], start: FloatArray) -> Findings:
    """Find what is missing among candidates ``names``, the plain model's fit starting at ``start`` (unit cube)."""
    first = settled(work, run_stage(work, (), names, start))
    verdict = first.decision.verdict
    if verdict == "none":
        return _pair(work, names, first) or Findings("none", (), first, first, _nearest(first))
    if verdict == "tied":
        tied = Findings("tied", first.decision.effects, first, first, first.chosen)
        return _with_another(work, names, tied) or tied
    if verdict != "named":
        return Findings(verdict, (), first, first, _nearest(first))
    return _forward(work, names, Findings("named", first.decision.effects, first, first, first.chosen))


def _forward(work: Work, names: list[str], found: Findings) -> Findings:
    """Add effects as long as one is named; whether there is a misfit left to look into, each stage says itself."""
    while len(found.effects) < MOST_EFFECTS and work.may_go_on():
        rest = [n for n in names if n not in found.effects]
        if not rest:
            break
        stage = settled(work, run_stage(work, found.effects, rest, found.after.fit.unit))
        # the same model, fitted to the end, and its numerics looked at where it fits
        after = work.judged(replace(found.after, fit=stage.plain))
        found = replace(found, after=after, rest=stage.decision)
        if stage.decision.verdict == "tied":
            return replace(found, further=stage.decision.effects)
        if stage.decision.verdict != "named":
            break
        effects = (*found.effects, stage.chosen.name)
        found = _without_idle(work, replace(found, effects=effects, last=stage, after=stage.chosen, rest=None))
        if len(found.effects) < len(effects):
            break  # one was dropped again: from here it would go in circles
    return found


def _pair(work: Work, names: list[str], first: Stage) -> Findings | None:
    """Two effects of like strength hide each other: with one of them in the model, is another one named?"""
    e = first.evidence
    leads = [c for c in sorted(e.candidates, key=lambda c: c.rank) if e.explained(c) > LEADING and e.z(c) > SIGNIFICANT]
    for lead in leads[:LEADS]:
        rest = [n for n in names if n != lead.name]
        if not work.may_go_on() or not rest:
            return None
        stage = settled(work, run_stage(work, (lead.name,), rest, lead.fit.unit))
        if stage.decision.verdict == "named" and work.jointly(stage.chosen, first.plain).accounted(stage.chosen):
            pair = Findings("named", (lead.name, stage.chosen.name), first, stage, stage.chosen)
            return _forward(work, names, _without_idle(work, pair))
    return None


def _with_another(work: Work, names: list[str], found: Findings) -> Findings | None:
    """A second effect beside those that are tied; with it in the model they may be told apart."""
    first, lead = found.first, found.after
    others = [n for n in names if n not in found.effects]
    if first.evidence.left(lead) == 0.0 or not others or not work.may_go_on():
        return None
    stage = settled(work, run_stage(work, (lead.name,), others, lead.fit.unit))
    if stage.decision.verdict != "named":
        return None
    second = stage.chosen
    pairs = {lead.name: second} | {n: _beside(work, first.candidate(n), second) for n in found.effects[1:]}
    order = sorted(pairs, key=lambda n: pairs[n].rss)
    e, best, ahead = stage.evidence, order[0], pairs[order[0]]
    margin = MARGIN + SHARE_LEFT * e.left(ahead)
    # one that is behind where it was fitted, and ahead where it was not, is not ruled out
    near = [
        n for n in order
        if e.behind(pairs[n], ahead) < margin or pairs[n].held_out_white <= ahead.held_out_white
    ]  # fmt: skip
    if len(near) > 1:
        return Findings("tied", tuple(near), first, stage, ahead, further=(second.name,))
    named = Findings("named", (best, second.name), first, stage, ahead)
    return _forward(work, names, _without_idle(work, named))


def _beside(work: Work, rival: Candidate, second: Candidate) -> Candidate:
    """The model with a rival in place of the effect that ``second`` was found beside."""
    effects = (rival.name, second.name)
    space, values = work.space(effects), dict(zip(second.space.names, second.fit.unit, strict=True))
    values |= dict(zip(rival.space.names, rival.fit.unit, strict=True))
    fit = work.polished(effects, np.array([values[n] for n in space.names]), MORE_EVALUATIONS)
    return work.judged(replace(second, space=space, base=len(rival.space), fit=fit))


def _without_idle(work: Work, found: Findings) -> Findings:
    """Backward: drop an effect, named before the last one, that the others do without."""
    best = found.after
    left = found.last.evidence.left(best)
    for dropped in found.effects[:-1]:
        others = tuple(e for e in found.effects if e != dropped)
        space = work.space(others)
        kept = [best.space.names.index(name) for name in space.names]
        fit = work.polished(others, best.fit.unit[kept], MORE_EVALUATIONS)
        if fit.rss - best.rss < MARGIN + SHARE_LEFT * left:
            base = len(work.space(others[:-1]))
            after = replace(best, name=others[-1], space=space, base=base, fit=fit)
            return replace(found, effects=others, after=work.judged(after))
    return found


def _nearest(stage: Stage) -> Candidate:
    return min(stage.evidence.candidates, key=lambda c: c.rank)
