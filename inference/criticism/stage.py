"""Every candidate beside the model so far: looked at, screened, polished, and what the evidence says."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from ...core.arrays import FloatArray
from ..polish import Polished
from .candidate import Candidate, drop_z
from .linear import Look, least_square, look_at
from .tournament import MORE_EVALUATIONS, Tournament, seen_only
from .verdict import MARGIN, SIGNIFICANT, Decision, Evidence, Objection, decide, has_misfit, objection
from .work import Work

#: Least-squares evaluations for the plain model at first, and from another start before it is given up.
PLAIN_EVALUATIONS, START_EVALUATIONS = 12, 12


@dataclass(frozen=True, eq=False)
class Stage:
    """The model so far, its best fit, and every candidate beside it.

    Args:
        effects: that the model has already.
        plain: its best fit.
        looks: of all candidates.
        evidence, decision: what they say.
    """

    effects: tuple[str, ...]
    plain: Polished
    looks: dict[str, Look]
    evidence: Evidence
    decision: Decision

    def candidate(self, name: str) -> Candidate:
        return next(c for c in self.evidence.candidates if c.name == name)

    @property
    def chosen(self) -> Candidate:
        """The candidate that the verdict puts first."""
        return self.candidate(self.decision.effects[0])

    def objection(self, candidate: Candidate) -> Objection | None:
        """What speaks against a candidate; not what is asked of a name, where it is level with one that has it."""
        return None if candidate.name in self.decision.effects else objection(self.evidence, candidate)


def run_stage(
    work: Work,
    effects: tuple[str, ...],
    names: list[str],
    start: FloatArray,
    hints: Mapping[str, FloatArray] = MappingProxyType({}),
) -> Stage:
    """Hold every candidate of ``names`` against the model with ``effects``, whose fit starts at ``start``.

    Candidates are tried from ``hints``, too, points ``(K, D)`` of the unit cube by name, whatever these leave.
    """
    work.study.progress("refitting the model as it is", 0, 0)
    work.see_numerics(effects, start)
    plain = work.polished(effects, start, PLAIN_EVALUATIONS)
    looks = {}
    for k, name in enumerate(names):
        work.study.progress(f"looking at {name}", k + 1, len(names))
        looks[name] = look_at(name, work.objective((*effects, name)), plain)
    candidates = [seen_only(look, plain) for look in looks.values()]
    evidence = work.evidence(effects, plain, candidates)
    if has_misfit(evidence) or any(_promises(look, plain, len(names)) for look in looks.values()):
        tournament = Tournament(work, effects, plain, looks, hints)
        candidates = tournament.run()
        best = min(candidates, key=lambda c: c.rss)
        if best.rss < plain.rss:
            plain = from_there_too(work, effects, plain, best)
        evidence = work.evidence(effects, plain, candidates)
    return Stage(effects, plain, looks, evidence, decide(evidence))


def from_there_too(work: Work, effects: tuple[str, ...], plain: Polished, best: Candidate) -> Polished:
    """The plain fit or one from the best candidate's parameters: no better start passes for an effect.

    A first approach that comes to the same place again, or of which even a linear model promises no better, is left.
    """
    there = work.roughly_polished(effects, best.fit.unit[: len(plain.unit)], START_EVALUATIONS, None)
    if plain.rss - least_square(there.unit, there.white, there.jacobian)[1] > MARGIN:
        there = work.polished(effects, there.unit, MORE_EVALUATIONS)
    return min(plain, there, key=lambda p: p.rss)


def _promises(look: Look, plain: Polished, tried: int) -> bool:
    """Is what a linear model gains beyond chance? Without a misfit, effects are small, and linear models right."""
    return drop_z(max(0.0, plain.rss - look.rss), len(look.space) - look.base, tried) >= SIGNIFICANT
