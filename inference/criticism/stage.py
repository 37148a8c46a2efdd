"""Every candidate beside the model so far: looked at, screened, polished, and what the evidence says."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from ...core.arrays import FloatArray
from ..polish import Polished
from .candidate import Candidate, best_starts, drop_z, screening_points
from .linear import Look, least_square, look_at
from .verdict import EXPLAINS, MARGIN, SIGNIFICANT, Decision, Evidence, Objection, decide, has_misfit, objection
from .work import Work

#: Least-squares evaluations for a candidate that passed the screening, for a contender on top, for the plain model at
#: first, from another start before it is given up, and to the end.
FIRST_EVALUATIONS, CONTENDER_EVALUATIONS, PLAIN_EVALUATIONS, START_EVALUATIONS, MORE_EVALUATIONS = 3, 4, 12, 12, 40
#: How far the first screening goes along where a linear model would, beside where that ends [of the prior range of the
#: coefficient that goes farthest]: across kinks, which hide from it what a small step away is worth.
LADDER = (0.2, 0.4, 0.8)
#: A response to the first look so much larger than the misfit is looked at on other scales, so many.
FAR_OFF, SCALES = 3.0, 3
#: How many candidates pass the screening, and the first polish: by what they reach, and as many by what they promise.
SCREENED, CONTENDERS = 5, 3
#: Share of what is left of the budget that goes to finding out who leads; the rest is for polishing these, without
#: which nothing is named.
LEADERS_SHARE = 0.7
#: The candidates that are polished to the end: the best; of so many, those that explain this share of what it does; and
#: all that explain this much of it.
FINALISTS, FAR_BEHIND, NEARLY = 2, 0.3, 0.75


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
    candidates = [_seen_only(look, plain) for look in looks.values()]
    evidence = work.evidence(effects, plain, candidates)
    if has_misfit(evidence) or any(_promises(look, plain, len(names)) for look in looks.values()):
        tournament = _Tournament(work, effects, plain, looks, hints)
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


def _seen_only(look: Look, plain: Polished) -> Candidate:
    """A candidate that was looked at and no more."""
    fit = look.as_fit(plain, look.start, plain.white)
    return Candidate(look.name, look.space, look.base, fit, promised=look.rss, tried=not look.responds)


def _promises(look: Look, plain: Polished, tried: int) -> bool:
    """Is what a linear model gains beyond chance? Without a misfit, effects are small, and linear models right."""
    return drop_z(max(0.0, plain.rss - look.rss), len(look.space) - look.base, tried) >= SIGNIFICANT


class _Tournament:
    """Rollouts for those candidates that may win."""

    def __init__(
        self,
        work: Work,
        effects: tuple[str, ...],
        plain: Polished,
        looks: dict[str, Look],
        hints: Mapping[str, FloatArray],
    ) -> None:
        self.work, self.effects, self.plain, self.looks, self.hints = work, effects, plain, looks, hints
        self.points = work.study.config.diagnose.draws
        self.until = work.count + LEADERS_SHARE * (work.limit - work.count)
        seed = work.study.config.study.seed
        # own stream for every candidate, whatever the others are
        self.rng = {name: np.random.default_rng([seed, 47, *name.encode()]) for name in looks}

    def run(self) -> list[Candidate]:
        found = {name: _seen_only(look, self.plain) for name, look in self.looks.items()}
        # the most promising first, in case the budget ends early
        acting = sorted((n for n, look in self.looks.items() if look.responds), key=lambda n: self.looks[n].rss)
        half = 0.5 * (self.work.count + self.until)
        for name in (n for n in self.hints if n in acting):
            if self.work.count < half:
                self.work.study.progress(f"trying {name}", 0, 0)
                found[name] = self.from_hints(found[name], self.hints[name])
        for k, name in enumerate(acting):
            self.work.study.progress(f"screening {name}", k + 1, len(acting))
            look = self.looks[name]
            there = self.moved(found[name], look.at[None])
            off = look.reach >= FAR_OFF  # then points farther away are wrong by as much
            found[name] = self.rescaled(there, look) if off else self.climbed(there, look)
        promise = {name: self.looks[name].rss for name in acting}
        for name in _leaders({n: found[n].rss for n in acting}, promise, SCREENED):
            if name not in self.in_reach(found, promise):
                continue
            self.work.study.progress(f"trying {name}", 0, 0)
            # what was tried alone began from there, and need not be sought again
            there = found[name] if name in self.hints else self.screened(found[name], self.points - len(LADDER))
            found[name] = self.approached(there, FIRST_EVALUATIONS)
        tried = {n: found[n] for n in self.in_reach(found, promise)}
        goals = {n: least_square(c.fit.unit, c.fit.white, c.fit.jacobian) for n, c in tried.items()}
        for name in _leaders({n: c.rss for n, c in tried.items()}, {n: g[1] for n, g in goals.items()}, CONTENDERS):
            self.work.study.progress(f"looking closer at {name}", 0, 0)
            # steps of a bounded search from near a bound are short; this looks at what lies behind them
            there = self.moved(found[name], goals[name][0][None])
            found[name] = self.approached(there, CONTENDER_EVALUATIONS)
        order = sorted(found.values(), key=lambda c: c.rank)
        most = self.plain.rss - order[0].rss
        for k, c in enumerate(order):
            near = self.plain.rss - c.rss > (FAR_BEHIND if k < FINALISTS else NEARLY) * most
            until = self.until_pairs(found[order[0].name]) if k else float("inf")
            if (k == 0 or near) and self.work.may_go_on(until):
                self.work.study.progress(f"refitting {c.name}", 0, 0)
                fit = self.work.polished((*self.effects, c.name), c.fit.unit, MORE_EVALUATIONS)
                found[c.name] = replace(c, fit=min(fit, c.fit, key=lambda p: p.rss), refitted=True, tried=True)
        return [found[name] for name in self.looks]

    def in_reach(self, found: Mapping[str, Candidate], promise: Mapping[str, float]) -> list[str]:
        """The names in ``promise`` that may still win.

        Beside one that explains as much as is asked for a name, before it is fitted, others that neither came near to
        what it does nor promise to are not gone into.
        """
        plain = self.plain.rss
        most = plain - min((found[n].rss for n in promise), default=plain)
        if most < EXPLAINS * (plain - self.plain.count):
            return list(promise)
        return [n for n, least in promise.items() if plain - min(least, found[n].rss) > FAR_BEHIND * most]

    def until_pairs(self, leader: Candidate) -> float:
        """Up to how many rollouts its rivals are refitted: one that cannot be named alone may be one of two."""
        enough = EXPLAINS * (self.plain.rss - self.plain.count)
        short = not self.effects and self.plain.rss - leader.rss < enough
        return self.work.before_pairs if short else float("inf")

    def rescaled(self, candidate: Candidate, look: Look) -> Candidate:
        """The best of the candidate and of points where the effect is about as large as the misfit.

        One with a threshold (a grasp that slips, a yield) does nothing below it and everything above, which no
        derivative tells.
        """
        objective = self.work.objective((*self.effects, candidate.name))
        smallest, largest = look.step / look.reach, look.step
        size = float(np.sqrt(smallest * largest))
        for _ in range(SCALES):
            if not self.work.may_go_on(self.until):
                break
            point = look.along(size)
            white = objective.many(point[None])[0]
            if white is not None and float(white @ white) < candidate.rss:
                candidate = replace(candidate, fit=look.as_fit(self.plain, point, white), approached=False)
            moved = np.inf if white is None else float(np.linalg.norm(white - self.plain.white))
            if moved > np.sqrt(self.plain.rss):
                largest = size
            else:
                smallest = size
            size = float(np.sqrt(smallest * largest))
        return candidate

    def climbed(self, candidate: Candidate, look: Look) -> Candidate:
        """The best of the candidate and of points that go farther and farther along the linear model's way."""
        return self.moved(candidate, np.stack([look.along(size) for size in LADDER]), made_up_for=True)

    def screened(self, candidate: Candidate, count: int) -> Candidate:
        """The best of the candidate and of ``count`` points that fill its prior."""
        base = len(self.plain.unit)
        starts = self.plain.unit[None]
        if not self.effects:
            starts = np.vstack([starts, self.work.starts])
        points = screening_points(candidate.space, base, starts, count, self.rng[candidate.name])
        return self.moved(candidate, points, made_up_for=True)

    def from_hints(self, candidate: Candidate, points: FloatArray) -> Candidate:
        """The better of the candidate and of a short approach from the best of ``points (K, D)``."""
        best = best_starts(self.work.objective((*self.effects, candidate.name)), points)
        if not best:
            return candidate
        there = self.looks[candidate.name].as_fit(self.plain, *best[0])
        hinted = self.approached(replace(candidate, fit=there, approached=False), FIRST_EVALUATIONS)
        return min(candidate, hinted, key=lambda c: c.rss)

    def moved(self, candidate: Candidate, points: FloatArray, *, made_up_for: bool = False) -> Candidate:
        """The best of the candidate and of ``points``, and of one of these whose effect the parameters make up for."""
        if not self.work.may_go_on(self.until):
            return candidate
        candidate = replace(candidate, tried=True)
        objective = self.work.objective((*self.effects, candidate.name))
        rows = best_starts(objective, points)
        if made_up_for and (point := self.made_up(rows)) is not None:
            rows += best_starts(objective, point[None])
        best, white = min(rows, key=lambda row: float(row[1] @ row[1]), default=(None, None))
        if best is None or white is None or float(white @ white) >= candidate.rss:
            return candidate
        return replace(candidate, fit=self.looks[candidate.name].as_fit(self.plain, best, white), approached=False)

    def made_up(self, rows: list[tuple[FloatArray, FloatArray]]) -> FloatArray | None:
        """Where a linear model of the parameters alone gets nearest from points of one effect or another ``(D,)``.

        An effect that makes a rope softer shows what it is worth only once the rope is stiffer.

        Args:
            rows: points and white residuals; of those, the points at the plain fit's parameters count.
        """
        base = len(self.plain.unit)
        at_plain = [(p, w) for p, w in rows if np.allclose(p[:base], self.plain.unit, atol=1e-9)]
        goals = [(p, *least_square(p[:base], w, self.plain.jacobian)) for p, w in at_plain]
        if not goals:
            return None
        point, parameters, _ = min(goals, key=lambda goal: goal[2])
        return np.concatenate([parameters, point[base:]])

    def approached(self, candidate: Candidate, evaluations: int) -> Candidate:
        """Some way towards the least square; derivatives are those of an earlier approach to the same point."""
        if not self.work.may_go_on(self.until):
            return candidate
        known = candidate.fit.jacobian if candidate.approached else None
        effects = (*self.effects, candidate.name)
        fit = self.work.roughly_polished(effects, candidate.fit.unit, evaluations, known)
        return candidate if candidate.rss <= fit.rss else replace(candidate, fit=fit, approached=True)


def _leaders(reached: dict[str, float], promised: dict[str, float], count: int) -> list[str]:
    """The names with the smallest numbers of either kind; what is reached comes first, as the budget may end."""
    order = sorted(reached, key=reached.__getitem__)
    leaders = {*order[:count], *sorted(promised, key=promised.__getitem__)[:count]}
    return [name for name in order if name in leaders]
