"""What may be named, fitted to the end: what a fit in a side valley leaves is no second effect, nor a rival's merit."""

from dataclasses import replace

import numpy as np
from scipy import stats

from .candidate import Candidate, best_starts
from .stage import START_EVALUATIONS, Stage, from_there_too
from .tournament import MORE_EVALUATIONS, NEARLY
from .verdict import EXPLAINS, MARGIN, Evidence, decide, objection
from .work import Work

#: Points of the parameters' prior that are looked at (a power of two), how many of the best are fitted from, and
#: evaluations of each before it is given up.
PLACES, RESTARTS = 16, 2
#: A leader that explains less than this share of the excess misfit is not fitted further: that would not make it the
#: answer.
HOPEFUL = 0.5


def settled(work: Work, stage: Stage) -> Stage:
    """The stage with its leader fitted further, and its rivals too unless the leader leaves nothing but noise.

    A missing effect drives the parameters far away, and with it in the model the fits start from there; the right
    effect may rest in a side valley and a look-alike not.
    """
    if not any(c.refitted for c in stage.evidence.candidates):
        return stage
    leader = min(_passing(stage.evidence) or stage.evidence.candidates, key=lambda c: c.rank)
    if stage.evidence.explained(leader) < HOPEFUL:
        return stage
    paired = not stage.effects and stage.evidence.explained(leader) < EXPLAINS
    until = work.before_pairs if paired else float("inf")
    evidence = _with(stage.evidence, _fitted_on(work, stage, leader, until))
    reached = evidence.explained(evidence.nearest)
    if evidence.left(evidence.nearest) > 0.0:
        near = [c for c in evidence.candidates if c.refitted and c.name != leader.name]
        for c in sorted(near, key=lambda c: c.rank):
            if evidence.explained(c) >= NEARLY * reached:
                evidence = _with(evidence, _fitted_on(work, stage, c, until))
    best, plain = evidence.nearest, stage.plain
    if best.rss < stage.evidence.nearest.rss:
        plain = from_there_too(work, stage.effects, plain, best)
    # what held-out motions say of a candidate, they say of it as it is now, beside the model without it
    evidence = work.evidence(stage.effects, plain, evidence.candidates)
    return replace(stage, plain=plain, evidence=evidence, decision=decide(evidence))


def _fitted_on(work: Work, stage: Stage, c: Candidate, until: float) -> Candidate:
    """Polished further, and where that leaves a misfit, from other parameters too; not after ``until`` rollouts."""
    effects = (*stage.effects, c.name)
    if (stage.evidence.left(c) > 0.0 or not c.refitted) and not c.fit.rested and work.may_go_on(until):
        fit = work.polished(effects, c.fit.unit, MORE_EVALUATIONS)
        c = replace(c, fit=min(fit, c.fit, key=lambda p: p.rss), refitted=True)
    if stage.evidence.left(c) > 0.0 and work.may_go_on(until):
        rng = np.random.default_rng([work.study.config.study.seed, 53, *c.name.encode()])
        points = np.repeat(c.fit.unit[None], PLACES, axis=0)
        points[:, : c.base] = stats.qmc.Sobol(c.base, rng=rng).random(PLACES)
        for unit, _ in best_starts(work.quick(effects), points)[:RESTARTS]:
            there = work.roughly_searched(effects, unit, START_EVALUATIONS)
            if c.rss - there.rss > MARGIN:  # more than the same place again
                c = replace(c, fit=work.polished(effects, there.unit, MORE_EVALUATIONS))
    return c


def _passing(evidence: Evidence) -> list[Candidate]:
    return [c for c in evidence.candidates if objection(evidence, c) is None]


def _with(evidence: Evidence, changed: Candidate) -> Evidence:
    return replace(evidence, candidates=tuple(changed if c.name == changed.name else c for c in evidence.candidates))
