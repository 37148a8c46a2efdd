"""The best fit of a study: found after the first round of draws, and anew where a later draw comes nearer."""

from dataclasses import replace

import numpy as np

from ...core.arrays import FloatArray
from ...core.rollout import Trajectory
from ...core.series import PointSeries
from ...core.study import Outcome, SimulationPool, Study, Task
from ..cloud_noise import Cloud, cloud_noise
from ..correlated_noise import correlated_noise
from ..discrepancy import NONE, Discrepancy
from ..noise import Noise
from ..observe import Observer
from ..polish import TOLD_APART, Objective, Polished, polish, polish_from
from ..residuals import Offsets, residual
from ..rough_curvature import seen_past_chance
from ..roughness import roughness
from ..secants import CHANCE
from ..subset import on_all, on_some
from .draws import DrawStore
from .ellipsoid import Ellipsoid
from .narrowing import narrowed
from .takes import Takes
from .together import told_together

#: A search that has not come to rest goes on so often at most, or many parameters are still far from where they fit.
GOES_ON = 3


def offsets_of(study: Study) -> Offsets:
    """Nuisance priors of a study."""
    return Offsets(study.config.nuisance.clock_offset, study.config.nuisance.constant_offset)


def takes_of(study: Study, noise: Noise, excess: float = 1.0) -> Takes:
    """The recordings that a study is fitted on, as an estimator sees them.

    Args:
        study: whose.
        noise: of the measurement.
        excess: of the best fit. Draws are given that much more noise, in squares (a power posterior: Miller and Dunson,
            *Robust Bayesian inference via coarsening*, 2019): a model that misses the data by much does not know its
            parameters by little.
    """
    problem = study.problem
    recordings = [problem.recordings[r] for r in problem.fit_on]
    larger = replace(noise, sd=noise.sd * excess**0.5)
    return Takes(Observer(recordings, larger, offsets_of(study), problem.clouds), problem.scenarios)


class Polishing:
    """Least squares from the draws of a fit, and the noise as the best fit shows it.

    Args:
        study: that is fitted.
        pool: where rollouts run.
        store: of the draws.
        noise: of the measurement, as it is known before.
    """

    def __init__(self, study: Study, pool: SimulationPool, store: DrawStore, noise: Noise) -> None:
        self._study, self._pool, self._store = study, pool, store
        self.noise, self.simulations = noise, 0
        self._found: tuple[Objective, Polished] | None = None
        self._outcomes: dict[str, Outcome] = {}  # of the best fit, by recording

    @property
    def best(self) -> Polished:
        """The best fit."""
        assert self._found is not None
        return self._found[1]

    @property
    def objective(self) -> Objective:
        """What that makes least."""
        assert self._found is not None
        return self._found[0]

    @property
    def takes(self) -> Takes:
        """As an estimator is to see them after all that was found."""
        return takes_of(self._study, self.noise, self.best.excess)

    @property
    def predicted(self) -> list[FloatArray]:
        """By the best fit, ``(T, P, A)`` for every group of :attr:`takes`; none if one cannot be simulated again."""
        outcomes = [self._outcomes[name] for name in self._store.recordings]
        found = [o.series.points for o in outcomes if isinstance(o, Trajectory)]
        return found if len(found) == len(outcomes) else []

    def look(self, upto: int) -> None:
        """Find the best fit with the first ``upto`` draws."""
        before = self._pool.count
        if self._found is None:
            self._polish(upto, self._in_order(upto, NONE)[0][0])
        else:
            draws, least = self._in_order(upto, self.objective.discrepancy)
            if self.best.rss - least > CHANCE * TOLD_APART * self.best.excess:
                self._polish(upto, draws[0])
        truer = self._truer()
        if truer is not self.noise:
            self._study.progress(f"polishing again: the noise is not what it was taken for ({truer.source})", 0, 0)
            self.noise = truer
            self._polish(upto, self.best.unit)
        self.simulations += self._pool.count - before

    def look_from(self, guesses: FloatArray) -> None:
        """Search from ``guesses (G, D)``, too, those that come nearest first, while the best fit leaves a misfit."""
        before = self._pool.count
        some = on_some(self.objective)
        whites, known = some.many(guesses), self.objective.part(self.best, some)
        nearest = np.argsort([np.inf if w is None else float(w @ w) for w in whites], kind="stable")
        best = polish_from(some, guesses[nearest], known)
        if best is not known and (best := on_all(self.objective, some, best)).rss < self.best.rss:
            self._study.progress("the estimator has found a better place than the draws", 0, 0)
            self._rest(self.objective, best)
        self.simulations += self._pool.count - before

    def narrowed(self, upto: int, rng: np.random.Generator) -> Ellipsoid | None:
        """Where the posterior is, as the first ``upto`` draws tell; see :func:`~.narrowing.narrowed`."""
        before = self._pool.count
        draws = self._in_order(upto, self.objective.discrepancy)[0]
        found = narrowed(self.objective, self.best, draws, rng)
        self.simulations += self._pool.count - before
        return found

    def _polish(self, upto: int, near: FloatArray) -> None:
        """From ``near (D,)``, and where that leaves a misfit from the nearest draws."""
        problem, offsets = self._study.problem, offsets_of(self._study)
        space, names = problem.space, problem.fit_on
        # what cannot be repeated there must not lead the fit
        discrepancy = roughness(self._pool, space, near, names).discrepancy(problem.recordings, self.noise, offsets)
        if discrepancy.nothing_counts(names):  # then the nearest is as good as it gets; doubts say that it is chance
            discrepancy = NONE
        smooth = problem.pieces > 1
        objective = Objective(self._pool, space, names, self.noise, offsets, None, discrepancy, smooth)
        some = on_some(objective)
        best = polish_from(some, np.concatenate([near[None], self._in_order(upto, discrepancy)[0]]))
        self._rest(objective, on_all(objective, some, best, near))

    def _rest(self, objective: Objective, best: Polished) -> None:
        """Go on from what a search has led to until it rests, and keep that."""
        space, names = objective.space, objective.recordings
        for _ in range(GOES_ON):
            if best.rested:
                break
            best = polish(objective, best.unit, known=best.jacobian)
        self._found = objective, told_together(objective, seen_past_chance(objective, best))
        values = space.as_dict(space.from_unit(best.unit))
        self._outcomes = dict(zip(names, self._pool.map([Task(values, name) for name in names]), strict=True))

    def _truer(self) -> Noise:
        """The noise as the best fit shows it: slow, or shared by neighbours; the same as before if it is neither."""
        problem, offsets = self._study.problem, offsets_of(self._study)
        differences, clouds = [], []
        for name, outcome in self._outcomes.items():
            recording = problem.recordings[name]
            if not isinstance(outcome, Trajectory):
                continue
            off = residual(recording, outcome.series, self.noise, offsets).difference
            if recording.series.correspondence:
                differences.append(off)
            elif recording.name in problem.clouds:
                clouds.append(Cloud(recording.series.points, off))
        if differences or not clouds:
            return correlated_noise(self.noise, differences)
        return cloud_noise(self.noise, clouds)

    def _in_order(self, upto: int, discrepancy: Discrepancy) -> tuple[FloatArray, float]:
        """Whole draws ``(N, D)`` in the unit cube, the nearest first, and its residual sum of squares."""
        problem, offsets = self._study.problem, offsets_of(self._study)
        takes = takes_of(self._study, self.noise)
        theta, points, _ = self._store.read(upto)
        total = np.zeros(len(theta))
        for name in problem.fit_on:
            recording = problem.recordings[name]
            for k, p in enumerate(points[self._store.recordings.index(takes.of(name))]):
                series = PointSeries(recording.series.time, p, recording.series.unit, recording.series.correspondence)
                white = discrepancy.whitened(name, residual(recording, series, self.noise, offsets).white)
                total[k] += float(white @ white)
        order = np.argsort(total, kind="stable")
        return np.asarray(theta[order]), float(total[order[0]])
