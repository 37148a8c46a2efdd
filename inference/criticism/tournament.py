"""Rollouts for those candidates that may win."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ...core.arrays import FloatArray
from ..polish import Objective, Polished
from ..subset import some_of
from .candidate import Candidate, best_starts, screening_points
from .linear import Look, least_square
from .verdict import EXPLAINS
from .work import Work

#: Least-squares evaluations for a candidate that passed the screening, for a contender on top, and to the end.
FIRST_EVALUATIONS, CONTENDER_EVALUATIONS, MORE_EVALUATIONS = 3, 4, 40
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


def seen_only(look: Look, plain: Polished) -> Candidate:
    """A candidate that was looked at and no more."""
    fit = look.as_fit(plain, look.start, plain.white)
    return Candidate(look.name, look.space, look.base, fit, promised=look.rss, tried=not look.responds)


class Tournament:
    """Rollouts for those candidates that may win.

    Args:
        work: what they are counted in.
        effects: that the model has.
        plain: its best fit.
        looks: of all candidates.
        hints: other points to try them from ``(K, D)``, by name.
        recordings: that they are held against; all that are fitted if left out.
    """

    def __init__(
        self,
        work: Work,
        effects: tuple[str, ...],
        plain: Polished,
        looks: dict[str, Look],
        hints: Mapping[str, FloatArray],
        recordings: Sequence[str] = (),
    ) -> None:
        self.work, self.effects, self.plain, self.looks, self.hints = work, effects, plain, looks, hints
        self.recordings = recordings
        self.points = work.study.config.diagnose.draws
        self.until = work.count + LEADERS_SHARE * (work.limit - work.count)
        seed = work.study.config.study.seed
        # own stream for every candidate, whatever the others are
        self.rng = {name: np.random.default_rng([seed, 47, *name.encode()]) for name in looks}

    def run(self) -> list[Candidate]:
        """All candidates, those that lead fitted to the end."""
        some = some_of(self.work.problem.fit_on)
        found = self.led_on(some) if some else self.leading()
        order = sorted(found.values(), key=lambda c: c.rank)
        most = self.plain.rss - order[0].rss
        for k, c in enumerate(order):
            near = self.plain.rss - c.rss > (FAR_BEHIND if k < FINALISTS else NEARLY) * most
            until = self.until_pairs(found[order[0].name]) if k else float("inf")
            if (k == 0 or near) and self.work.may_go_on(until):
                self.work.study.progress(f"refitting {c.name}", 0, 0)
                fit = self.work.searched((*self.effects, c.name), c.fit.unit, MORE_EVALUATIONS)
                found[c.name] = replace(c, fit=min(fit, c.fit, key=lambda p: p.rss), refitted=True, tried=True)
        return [found[name] for name in self.looks]

    def on(self, recordings: Sequence[str]) -> "Tournament":
        """The same on some of the recordings."""
        objective, some = self.work.objective(self.effects), self.work.objective(self.effects, recordings)
        rows = objective.rows(recordings)
        looks = {name: look.on(rows) for name, look in self.looks.items()}
        return Tournament(self.work, self.effects, objective.part(self.plain, some), looks, self.hints, recordings)

    def led_on(self, recordings: Sequence[str]) -> dict[str, Candidate]:
        """All candidates, those that lead on some recordings gone into there; what acts on none of these, on all."""
        part = self.on(recordings)
        found = self.brought(part.leading())
        rare = {n: k for n, k in self.looks.items() if k.responds and not part.looks[n].responds}
        return found | (Tournament(self.work, self.effects, self.plain, rare, self.hints).leading() if rare else {})

    def brought(self, found: Mapping[str, Candidate]) -> dict[str, Candidate]:
        """Candidates that were ``found`` on some recordings as they are on all; the best first."""
        brought = {n: replace(seen_only(look, self.plain), tried=found[n].tried) for n, look in self.looks.items()}
        self.work.study.progress("holding all against the other recordings", 0, 0)
        for c in sorted(found.values(), key=lambda c: c.rank):
            if not np.array_equal(c.fit.unit, self.looks[c.name].start) and self.work.may_go_on():
                brought[c.name] = self.bettered(brought[c.name], best_starts(self.objective(c.name), c.fit.unit[None]))
        return brought

    def leading(self) -> dict[str, Candidate]:
        """All candidates, those that lead gone into."""
        found = {name: seen_only(look, self.plain) for name, look in self.looks.items()}
        # the most promising first, in case the budget ends early
        acting = sorted((n for n, look in self.looks.items() if look.responds), key=lambda n: self.looks[n].rss)
        half = 0.5 * (self.work.count + self.until)
        for name in (n for n in self.hints if n in acting):
            if self.work.count < half:
                self.work.study.progress(f"trying {name}", 0, 0)
                found[name] = self.from_hints(found[name], self.hints[name])
        for k, name in enumerate(acting):
            if not self.goes_on(f"screening {name}", k + 1, len(acting)):
                break
            look = self.looks[name]
            there = self.moved(found[name], look.at[None])
            off = look.reach >= FAR_OFF  # then points farther away are wrong by as much
            found[name] = self.rescaled(there, look) if off else self.climbed(there, look)
        promise = {name: self.looks[name].rss for name in acting}
        for name in _leaders({n: found[n].rss for n in acting}, promise, SCREENED):
            if name not in self.in_reach(found, promise):
                continue
            if not self.goes_on(f"trying {name}"):
                break
            # what was tried alone began from there, and need not be sought again
            there = found[name] if name in self.hints else self.screened(found[name], self.points - len(LADDER))
            found[name] = self.approached(there, FIRST_EVALUATIONS)
        tried = {n: found[n] for n in self.in_reach(found, promise)}
        goals = {n: least_square(c.fit.unit, c.fit.white, c.fit.jacobian) for n, c in tried.items()}
        for name in _leaders({n: c.rss for n, c in tried.items()}, {n: g[1] for n, g in goals.items()}, CONTENDERS):
            if not self.goes_on(f"looking closer at {name}"):
                break
            # steps of a bounded search from near a bound are short; this looks at what lies behind them
            there = self.moved(found[name], goals[name][0][None])
            found[name] = self.approached(there, CONTENDER_EVALUATIONS)
        return found

    def goes_on(self, title: str, done: int = 0, of: int = 0) -> bool:
        """Is something left for this? Then it is what is said to be done."""
        left = self.work.may_go_on(self.until)
        if left:
            self.work.study.progress(title, done, of)
        return left

    def objective(self, name: str) -> Objective:
        """Of the model with one of the candidates."""
        return self.work.objective((*self.effects, name), self.recordings)

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
        objective = self.objective(candidate.name)
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
        best = best_starts(self.objective(candidate.name), points)
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
        objective = self.objective(candidate.name)
        rows = best_starts(objective, points)
        if made_up_for and (point := self.made_up(rows)) is not None:
            rows += best_starts(objective, point[None])
        return self.bettered(candidate, rows)

    def bettered(self, candidate: Candidate, rows: list[tuple[FloatArray, FloatArray]]) -> Candidate:
        """The best of the candidate and of points and their white residuals."""
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
        fit = self.work.roughly_polished(effects, candidate.fit.unit, evaluations, known, self.recordings)
        return candidate if candidate.rss <= fit.rss else replace(candidate, fit=fit, approached=True)


def _leaders(reached: dict[str, float], promised: dict[str, float], count: int) -> list[str]:
    """The names with the smallest numbers of either kind; what is reached comes first, as the budget may end."""
    order = sorted(reached, key=reached.__getitem__)
    leaders = {*order[:count], *sorted(promised, key=promised.__getitem__)[:count]}
    return [name for name in order if name in leaders]
