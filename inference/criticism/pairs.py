"""Two effects at once: a few pairs fitted jointly, as each of two may hide the other from a search one by one."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from ...core.arrays import FloatArray
from .candidate import Candidate, best_starts
from .linear import Look, least_square
from .stage import Stage
from .tournament import FIRST_EVALUATIONS
from .verdict import SIGNIFICANT
from .work import Work

#: A candidate leads if alone it explains at least this share of the misfit; so many leaders are paired with others, and
#: so many of these pairs are tried, those that promise most.
LEADING, LEADERS, TRIED = 0.2, 4, 10
#: Pairs that are looked at closer, and evaluations of each.
CLOSER, CLOSER_EVALUATIONS = 3, 8
#: Responses are alike if what tells them apart is less than this share of what they have in common [squares].
ALIKE = 1e-10


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
        starts = best_starts(work.quick((lead.name, other.name)), _starts(work, stage, lead, other))
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
    """The ``count`` candidates that promise most beside the lead; see :func:`_promise`."""
    first = stage.candidate(lead)
    others = [c for c in stage.evidence.candidates if c.name != lead and stage.looks[c.name].responds]
    promised = {c.name: _promise(stage, first, c) for c in others}
    return sorted(promised, key=promised.__getitem__)[:count]


def _left(pair: Pair) -> float:
    return pair.both.rss


def _fitted(work: Work, lead: Candidate, other: Candidate, start: FloatArray, evaluations: int) -> Pair:
    effects = (lead.name, other.name)
    fit = work.roughly_searched(effects, start, evaluations)
    return Pair(lead, replace(other, space=work.space(effects), base=len(lead.space), fit=fit))


def _chosen(stage: Stage) -> list[tuple[Candidate, Candidate]]:
    """Which pairs are tried, the most promising first, each with the candidate first that explains more."""
    e = stage.evidence
    order = sorted((c for c in e.candidates if stage.looks[c.name].responds), key=lambda c: c.rank)
    leaders = [c for c in order if e.explained(c) > LEADING and e.z(c) > SIGNIFICANT][:LEADERS]
    pairs = [(a, b) for a, b in combinations(order, 2) if a in leaders]
    promised = {(a, b): min(_promise(stage, *p) for p in ((a, b), (b, a))) for a, b in pairs}
    return sorted(pairs, key=promised.__getitem__)[:TRIED]


def _promise(stage: Stage, at: Candidate, other: Candidate) -> float:
    """Squares that are left if the other one's response is added where the first one is alone [noise variances].

    The response is what the other one did to the residuals where it was found, and its derivatives there and at the
    plain fit: of one with a threshold, a grasp that slips or a rope that yields, no derivative tells before it is
    passed. It may be of any size.
    """
    look = stage.looks[other.name]
    slopes = [at.fit.jacobian, other.fit.jacobian[:, other.base :], look.jacobian[:, look.base :]]
    along = np.hstack([*slopes, (other.fit.white - stage.plain.white)[:, None]])
    sizes = np.linalg.norm(along, axis=0)
    along = along[:, sizes > 0.0] / sizes[sizes > 0.0]
    squares, ways = np.linalg.eigh(along.T @ along)  # a dozen of them: of the residuals there may be a hundred thousand
    told = ways.T @ (along.T @ at.fit.white)
    apart = squares > ALIKE * squares.max(initial=0.0)
    return at.rss - float(np.sum(told[apart] ** 2 / squares[apart]))


def _starts(work: Work, stage: Stage, lead: Candidate, other: Candidate) -> FloatArray:
    """Where a joint fit may start ``(2, D)``: both where they are alone, and where a linear model would go."""
    names = work.space((lead.name, other.name)).names
    alone = dict(zip(other.space.names, other.fit.unit, strict=True))
    alone |= dict(zip(lead.space.names, lead.fit.unit, strict=True))
    return np.array([[alone[n] for n in names], _linear([stage.looks[c.name] for c in (lead, other)])])


def _linear(looks: Sequence[Look]) -> FloatArray:
    """Where a linear model with the effects of all ``looks`` has its least square ``(D,)``."""
    one, base = looks[0], looks[0].base
    start = np.concatenate([one.start[:base], *(look.start[base:] for look in looks)])
    jacobian = np.hstack([one.jacobian[:, :base], *(look.jacobian[:, base:] for look in looks)])
    return least_square(start, one.white, jacobian)[0]
