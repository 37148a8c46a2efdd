"""What was named, fitted to the end: what a fit in a side valley leaves is no second effect."""

from dataclasses import replace

import numpy as np
from scipy import stats

from .candidate import best_starts
from .stage import MORE_EVALUATIONS, Stage
from .work import Work

#: Points of the parameters' prior that are looked at (a power of two), and how many of the best are fitted from.
PLACES, RESTARTS = 16, 2


def settled(work: Work, stage: Stage) -> Stage:
    """The stage with what it named polished further, and where that leaves a misfit, from other parameters too.

    A missing effect drives the parameters far away, and with it in the model they start from there. Only once the
    verdict stands: of all candidates the leader alone would have it easier than its rivals.
    """
    c = stage.chosen
    effects = (*stage.effects, c.name)
    if stage.evidence.left(c) > 0.0 and work.may_go_on():
        fit = work.polished(effects, c.fit.unit, MORE_EVALUATIONS)
        c = replace(c, fit=min(fit, c.fit, key=lambda p: p.rss))
    if stage.evidence.left(c) > 0.0 and work.may_go_on():
        rng = np.random.default_rng([work.study.config.study.seed, 53, *c.name.encode()])
        points = np.repeat(c.fit.unit[None], PLACES, axis=0)
        points[:, : c.base] = stats.qmc.Sobol(c.base, rng=rng).random(PLACES)
        starts = best_starts(work.objective(effects), points)[:RESTARTS]
        fits = [c.fit, *(work.polished(effects, unit, MORE_EVALUATIONS) for unit, _ in starts)]
        c = replace(c, fit=min(fits, key=lambda p: p.rss))
    better = work.judged(c)
    candidates = tuple(better if other.name == c.name else other for other in stage.evidence.candidates)
    return replace(stage, evidence=replace(stage.evidence, candidates=candidates))
