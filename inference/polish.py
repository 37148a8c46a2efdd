"""Least squares from a good start: the best parameters and how far the data let them move."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import islice

import numpy as np

from ..core.arrays import BoolArray, FloatArray
from ..core.measurement import Recording
from ..core.parameters import ParameterSpace
from ..core.rollout import Trajectory
from ..core.study import SimulationPool, Task
from .descent import descend
from .discrepancy import NONE, Discrepancy
from .noise import Noise
from .residuals import Offsets, failed, residual
from .secants import CHANCE, LARGEST, LITTLE, Found, search

#: Least squares starts from another place while it leaves this times what noise leaves, this often at most, from
#: starts at least so far from places known in some coordinate of the unit cube. A wrong valley may leave little more.
MISFIT, STARTS, APART = 1.1, 4, 0.1
#: Evaluations of a search, and from each of these before they are given up.
EVALUATIONS, FEW_EVALUATIONS = 40, 10
#: A search ends where it promises less in -2 log likelihood.
TOLD_APART = 0.3
#: How far derivatives are trusted at first, and the smallest steps before they are taken.
NEARBY, COARSE = 0.02, 0.002

#: Information of the uniform prior: a unit interval has the variance 1/12.
PRIOR = 12.0


@dataclass(frozen=True, eq=False)
class Polished(Found):
    """The best fit found, in units of the noise.

    Args:
        covariance: of ``unit``, from the curvature at the best fit (Laplace), ``(D, D)``.
        count: independent numbers that the residuals are worth: what :attr:`rss` is when only noise is left.
        rested: the search ended by itself, so that more evaluations from here gain next to nothing.
        grown: the covariance is this many times what the curvature makes it, for the luck that a search finds.
        together: what is left counts as this many times the squares that noise leaves, as it goes together in time; 0
            where nobody asked.
    """

    covariance: FloatArray
    count: float
    rested: bool = False
    grown: float = 1.0
    together: float = 0.0

    @property
    def left(self) -> float:
        """Squares that are left, in parts of what noise leaves."""
        return self.rss / self.count

    @property
    def excess(self) -> float:
        """By how much less the data tell than noise alone would let them: what is left beyond noise counts as noise."""
        return max(1.0, self.left, self.together)

    @property
    def widened(self) -> FloatArray:
        """The covariance ``(D, D)`` to be told, with the excess counted as noise.

        Luck and what goes together are two reasons why the best fit may be elsewhere: the greater counts.
        """
        excess = max(1.0, self.left, self.together / self.grown)
        information = np.linalg.inv(self.covariance) + (excess - 1.0) * PRIOR * np.eye(len(self.unit))
        return np.asarray(excess * np.linalg.inv(information), float)


class Objective:
    """White residuals of all given recordings as a function of a point in the unit cube.

    Args:
        pool: where rollouts run.
        space: parameters, in the order of the unit vector.
        recordings: names.
        given: values of other parameters, by recording.
        discrepancy: how else than by noise a right model may be off; residuals are whitened by it too, and its step is
            that of derivatives.
        smooth: derivatives hold far enough to follow them.
    """

    def __init__(
        self,
        pool: SimulationPool,
        space: ParameterSpace,
        recordings: Sequence[str],
        noise: Noise,
        offsets: Offsets,
        given: Mapping[str, dict[str, float]] | None = None,
        discrepancy: Discrepancy = NONE,
        smooth: bool = False,
    ) -> None:
        self.pool, self.space, self.recordings = pool, space, list(recordings)
        self.discrepancy, self.smooth = discrepancy, smooth
        self.noise, self.offsets, self.given = noise, offsets, dict(given or {})
        self._last: tuple[FloatArray, FloatArray] | None = None

    def many(self, units: FloatArray) -> list[FloatArray | None]:
        """White residuals ``(N,)`` at every row of ``units (K, D)``; None where a rollout failed."""
        tasks = [
            Task({**self.given.get(r, {}), **self.space.as_dict(self.space.from_unit(u))}, r)
            for u in units
            for r in self.recordings
        ]
        outcomes = iter(self.pool.map(tasks))
        rows: list[FloatArray | None] = []
        for _ in units:
            pairs = [(self.pool.problem.recordings[name], next(outcomes)) for name in self.recordings]
            whole = [(r, o) for r, o in pairs if isinstance(o, Trajectory)]
            rows.append(np.concatenate([self._white(r, o) for r, o in whole]) if len(whole) == len(pairs) else None)
        return rows

    def _white(self, recording: Recording, predicted: Trajectory) -> FloatArray:
        white = residual(recording, predicted.series, self.noise, self.offsets).white
        return self.discrepancy.whitened(recording.name, white)

    def on(self, recordings: Sequence[str]) -> "Objective":
        """The same of other recordings."""
        given = self.given, self.discrepancy, self.smooth
        return Objective(self.pool, self.space, recordings, self.noise, self.offsets, *given)

    def part(self, found: Polished, some: "Objective") -> Polished:
        """A fit of this objective as one of ``some`` of its recordings."""
        rows = self.rows(some.recordings)
        white = found.white[rows]
        return replace(found, white=white, jacobian=found.jacobian[rows], count=some.count(white))

    def rows(self, recordings: Sequence[str]) -> BoolArray:
        """Which of the white residuals are of ``recordings``, some of those of this objective ``(N,)``."""
        sizes = [len(failed(self.pool.problem.recordings[name], self.offsets)) for name in self.recordings]
        return np.repeat([name in recordings for name in self.recordings], sizes)

    def count(self, white: FloatArray) -> float:
        """Independent numbers that white residuals ``(N,)`` are worth."""
        return self.noise.information * (len(white) - self.discrepancy.dropped(self.recordings))

    def one(self, unit: FloatArray) -> FloatArray:
        """White residuals ``(N,)`` at ``unit (D,)``; a failed rollout counts as far off everywhere."""
        if self._last is None or not np.array_equal(self._last[0], unit):
            row = self.many(unit[None])[0]
            if row is None:
                recordings = [self.pool.problem.recordings[name] for name in self.recordings]
                row = np.concatenate([failed(r, self.offsets) for r in recordings])
            self._last = (unit.copy(), row)
        return self._last[1]

    def jacobian(self, unit: FloatArray, white: FloatArray | None = None) -> FloatArray:
        """Derivative of the white residuals ``(N, D)`` by one-sided differences that stay in the cube.

        Where the neighbour cannot be simulated the other side is taken; where neither can, the
        derivative is unknown and zero, which leaves the prior's uncertainty to that parameter.

        Args:
            unit: where ``(D,)``.
            white: what :meth:`one` is there, if known.
        """
        base = self.one(unit) if white is None else white
        steps = np.where(unit + self.discrepancy.step <= 1.0, 1.0, -1.0) * self.discrepancy.step
        columns = np.zeros((len(base), len(unit)))
        missing = np.arange(len(unit))
        for sides in (steps, -steps):
            missing = missing[((unit + sides) >= 0.0)[missing] & ((unit + sides) <= 1.0)[missing]]
            if not len(missing):
                break
            rows = self.many(unit + np.diag(sides)[missing])
            for k, row in zip(missing, rows, strict=True):
                if row is not None:
                    columns[:, k] = (row - base) / sides[k]
            missing = np.array([k for k, row in zip(missing, rows, strict=True) if row is None], dtype=np.int64)
        return columns


def polish(
    objective: Objective,
    start: FloatArray,
    evaluations: int = EVALUATIONS,
    *,
    known: FloatArray | None = None,
    roughly: bool = False,
) -> Polished:
    """Bounded least squares from ``start`` in the unit cube, by derivatives where these hold; see :mod:`.descent`.

    Elsewhere it is by secants, see :mod:`.secants`. Where they come to rest on a kink it looks around farther off, be
    there a misfit or not: what is left may be no more than noise and the parameters wrong. Then it goes on by
    derivatives, which see a way down a narrow valley that wide differences do not; and so on, until that gains next to
    nothing.

    Args:
        objective: to make least.
        start: ``(D,)``.
        evaluations: at most, but for the first D and the derivatives at the end.
        known: Jacobian at ``start`` ``(N, D)``, if there is one already.
        roughly: for an unfinished search: it comes to rest once, and its curvature is not to be relied on.
    """
    start = np.clip(start, 0.0, 1.0)
    white = objective.one(start)
    count, least = objective.count(white), objective.discrepancy.step
    enough, coarse = TOLD_APART / count, max(least, COARSE)
    at = Found(start, white, np.zeros((len(white), len(start))) if known is None else known)
    seek = partial(search, objective.many, enough=enough, noise=count)
    used, from_there = 0, known is not None
    if objective.smooth and not roughly:
        follow = partial(descend, objective.many, objective.jacobian, enough=enough, noise=count)
        at, used, rested = follow(at, evaluations, least=coarse, known=from_there)
        if rested or used >= evaluations:
            return _told(at, count, rested)
        from_there = False  # derivatives are those of one side of a kink
    best, more, smooth = seek(at, evaluations - used, least=coarse, known=from_there)
    used += more
    rested = False
    while not rested:
        before = best.rss
        if used < evaluations and not (roughly or smooth):
            best, more, _ = seek(best, evaluations - used, least=coarse, radius=LARGEST)
            used += more + len(start)
        jacobian = best.jacobian if roughly else objective.jacobian(best.unit, best.white)
        if roughly or used >= evaluations:
            break
        at, left = replace(best, jacobian=jacobian), evaluations - used
        best, more, smooth = seek(at, left, least=least, radius=NEARBY, known=True)
        used += more + len(start)
        # so near that the derivatives hold, or so little beside what is left that it tells nothing
        rested = before - best.rss < max(CHANCE * enough * best.rss, LITTLE * (best.rss - count))
    return _told(replace(best, jacobian=jacobian), count, rested)


def _told(best: Found, count: float, rested: bool) -> Polished:
    """With how far the data let the parameters move; the prior bounds what they leave open."""
    information = best.jacobian.T @ best.jacobian + PRIOR * np.eye(len(best.unit))
    covariance = np.asarray(np.linalg.inv(information), float)
    return Polished(best.unit, best.white, best.jacobian, covariance, count, rested)


def searches(objective: Objective, starts: FloatArray, known: Sequence[FloatArray]) -> Iterator[Polished]:
    """Short searches from those of ``starts (N, D)`` that are not near ``known`` places, nor near where others led."""
    places = list(known)
    for start in starts:
        if min(np.abs(start - place).max() for place in places) > APART:
            found = polish(objective, start, FEW_EVALUATIONS, roughly=True)
            places += [start, found.unit]
            yield found


def polish_from(objective: Objective, starts: FloatArray, best: Polished | None = None) -> Polished:
    """The best of least squares from the first of ``starts (N, D)``, and while it leaves a misfit, from others.

    An object that may fall one way or another (a rope on a table, a fold) has valleys that no descent leaves. The
    others are the next that are not near one that was tried, nor near where that led. With ``best``, what least squares
    have led to before, all starts are others.
    """
    known = []
    if best is None:
        best, known = polish(objective, starts[0]), [starts[0]]
    others = islice(searches(objective, starts, [*known, best.unit]), STARTS - 1)
    while best.left >= MISFIT and (other := next(others, None)) is not None:
        if best.rss - other.rss > CHANCE * TOLD_APART * best.left:  # more than the same place again
            best = polish(objective, other.unit)
    return best
