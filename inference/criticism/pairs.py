"""Two effects at once: a few pairs fitted jointly, as each of two may hide the other from a search one by one."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from ...core.arrays import FloatArray
from .candidate import Candidate, best_starts
from .linear import Look, least_square
from .stage import FIRST_EVALUATIONS, Stage
from .verdict import SIGNIFICANT
from .work import Work

#: A candidate leads if alone it explains at least this share of the misfit; so many leaders are paired with each other,
LEADING, LEADERS = 0.2, 4
#: and so many pairs more are tried that promise most in a linear model.
PROMISING = 4
#: Pairs that are looked at closer, and evaluations of each.
CLOSER, CLOSER_EVALUATIONS = 3, 8


@dataclass(frozen=True, eq=False)
class Pair:
    """Two effects together in the model.

    Args:
        lead: the candidate that explains more alone.
        both: the other one beside it in the model, roughly fitted.
    """

    lead: Candidate
    both: Candidate

    @property
    def names(self) -> tuple[str, str]:
        return self.lead.name, self.both.name

    @property
    def values(self) -> dict[str, float]:
        """Where the fit is in the unit cube, by name of the parameter or coefficient."""
        return dict(zip(self.both.space.names, self.both.fit.unit, strict=True))


def promising_pairs(work: Work, stage: Stage) -> list[Pair]:
    """Pairs of the candidates of a stage, roughly fitted, the one that leaves least first.

    A fit with both starts from what each reached alone, which derivatives at the fit without them do not know of: a
    grasp that slips or a rope that yields does nothing below a threshold. That is some twenty simulations a pair. One
    that leaves nothing but noise ends the search, unless the stage passes another effect, which its pairs may defend.
    """
    found, passing = list[Pair](), set(stage.decision.effects)
    for lead, other in _chosen(stage):
        if not work.may_go_on():
            break
        work.study.progress(f"trying {lead.name} with {other.name}", 0, 0)
        starts = best_starts(work.objective((lead.name, other.name)), _starts(work, stage, lead, other))
        if starts:
            found.append(_fitted(work, lead, other, starts[0][0], FIRST_EVALUATIONS))
            if stage.evidence.left(found[-1].both) == 0.0 and (not passing or passing & set(found[-1].names)):
                return sorted(found, key=_left)
    found.sort(key=_left)
    for k, pair in enumerate(found[:CLOSER]):
        if work.may_go_on():
            work.study.progress("looking closer at {} with {}".format(*pair.names), 0, 0)
            closer = _fitted(work, pair.lead, pair.both, pair.both.fit.unit, CLOSER_EVALUATIONS)
            found[k] = min(pair, closer, key=_left)
    return sorted(found, key=_left)


def level_with_first(stage: Stage, pairs: Sequence[Pair]) -> tuple[Pair, ...]:
    """The first of ``pairs``, and those that the data cannot tell from it."""
    return tuple(p for p in pairs if p is pairs[0] or stage.evidence.level(p.both, pairs[0].both))


def partners(stage: Stage, lead: str, count: int) -> list[str]:
    """The ``count`` candidates that promise most beside the lead in a linear model of what is left without both."""
    look = stage.looks[lead]
    promised = {n: _promise([look, other])[1] for n, other in stage.looks.items() if n != lead and other.responds}
    return sorted(promised, key=promised.__getitem__)[:count]


def _left(pair: Pair) -> float:
    return pair.both.rss


def _fitted(work: Work, lead: Candidate, other: Candidate, start: FloatArray, evaluations: int) -> Pair:
    effects = (lead.name, other.name)
    fit = work.roughly_polished(effects, start, evaluations, None)
    return Pair(lead, replace(other, space=work.space(effects), base=len(lead.space), fit=fit))


def _chosen(stage: Stage) -> list[tuple[Candidate, Candidate]]:
    """Which pairs are tried, each with the candidate first that explains more."""
    e = stage.evidence
    order = sorted((c for c in e.candidates if stage.looks[c.name].responds), key=lambda c: c.rank)
    leaders = [c for c in order if e.explained(c) > LEADING and e.z(c) > SIGNIFICANT][:LEADERS]
    pairs = list(combinations(leaders, 2))
    others = [(a, b) for a, b in combinations(order, 2) if a in leaders and b not in leaders]
    promised = {pair: _promise([stage.looks[c.name] for c in pair])[1] for pair in others}
    return pairs + sorted(others, key=promised.__getitem__)[:PROMISING]


def _promise(looks: Sequence[Look]) -> tuple[FloatArray, float]:
    """Where a linear model with the effects of all ``looks`` has its least square, and that square."""
    one, base = looks[0], looks[0].base
    start = np.concatenate([one.start[:base], *(look.start[base:] for look in looks)])
    jacobian = np.hstack([one.jacobian[:, :base], *(look.jacobian[:, base:] for look in looks)])
    return least_square(start, one.white, jacobian)


def _starts(work: Work, stage: Stage, lead: Candidate, other: Candidate) -> FloatArray:
    """Where a joint fit may start ``(2, D)``: both where they are alone, and where a linear model would go."""
    names = work.space((lead.name, other.name)).names
    alone = dict(zip(other.space.names, other.fit.unit, strict=True))
    alone |= dict(zip(lead.space.names, lead.fit.unit, strict=True))
    linear, _ = _promise([stage.looks[c.name] for c in (lead, other)])
    return np.array([[alone[n] for n in names], linear])
