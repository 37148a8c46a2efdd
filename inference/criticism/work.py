"""What all stages of a diagnosis share: rollouts and their budget, objectives, held-out errors."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...core.arrays import FloatArray
from ...core.parameters import ParameterSpace
from ...core.study import Problem, SimulationPool, Study
from ..discrepancy import Discrepancy
from ..polish import MISFIT, Objective, Polished, polish
from ..residuals import Residual
from ..rough_curvature import seen_past_chance
from ..roughness import Roughness, check_repeatable, roughness
from ..sequential.polishing import offsets_of
from ..sequential.result import FitResult
from ..sequential.together import told_together
from ..subset import on_all, on_some
from .candidate import Candidate, root_mean_square
from .held_out import HeldOut, held_out_residuals
from .numerics import numerics
from .verdict import Evidence

#: Share of the usual simulations that the search leaves: for what it has begun when they end, and for telling what it
#: found, which does not get less where the search gets fewer.
RESERVED = 0.15
#: Simulations of a diagnosis for every recording that is fitted, and at least, by kind of object; ropes are quick.
A_RECORDING = {"rope": 1250, "cloth": 440, "solid": 500}
AT_LEAST = {"rope": 1250, "cloth": 880, "solid": 1000}
#: So many times that for the fit and the diagnosis together: a fit that took more leaves less, down to this share.
TOGETHER, FEWEST = 1.62, 0.5
#: Share of what the search has that is kept for pairs, where no effect alone is the answer.
PAIRED = 0.15
#: Least-squares evaluations of the model that is told of, beside a user's own fit.
USER_EVALUATIONS = 8


def search_simulations(problem: Problem, fitted: int, asked: int | None = None) -> int:
    """How many simulations the search of a diagnosis may take.

    Args:
        problem: what is diagnosed.
        fitted: simulations that its fit took.
        asked: for the whole diagnosis, if the study says.
    """
    if asked is not None:
        return round((1.0 - RESERVED) * asked)
    name = problem.fit_on[0]
    kind = problem.scenarios[name].body.kind
    usual = max(AT_LEAST[kind], round(A_RECORDING[kind] * len(problem.fit_on) / problem.pieces))
    return round(min(usual, max(TOGETHER * usual - fitted, FEWEST * usual)) - RESERVED * usual)


class Work:
    """Rollouts of one diagnosis.

    Args:
        study, problem, pool, fit: the study, its problem with all candidates, where it is simulated, its fit.

    Attributes:
        discrepancy: how far the model's own numbers may be off, as last seen.
        rough: what it cannot repeat, as last seen.
        moved: how far its own numbers move the model as it is, see :class:`~.numerics.Numerics`.
        limit: of rollouts, see :attr:`simulations`.
        cut_short: whether something was left out for want of them.
    """

    def __init__(self, study: Study, problem: Problem, pool: SimulationPool, fit: FitResult) -> None:
        self.study, self.problem, self.pool, self.fit = study, problem, pool, fit
        self.offsets = offsets_of(study)
        self.starts = problem.space.to_unit(fit.samples)[: 4 * study.config.diagnose.draws]
        asked = study.config.diagnose.simulations
        self.limit = round(search_simulations(problem, fit.simulations, asked) * problem.pieces)
        self.cut_short = False
        self.discrepancy = Discrepancy(step=fit.derivative_step)
        self.rough = Roughness({}, {}, {})
        self.moved: dict[str, float] = {}
        self._elsewhere = 0  # rollouts of other engines and meshes
        self._as_fitted: dict[tuple[object, ...], FloatArray] = {}
        self._held_out: dict[tuple[tuple[str, float], ...], dict[str, Residual | None]] = {}

    @property
    def count(self) -> int:
        """Rollouts so far."""
        return self.pool.count + self._elsewhere

    @property
    def simulations(self) -> int:
        """What those are told as."""
        return self.problem.told_as(self.count)

    @property
    def before_pairs(self) -> float:
        """Rollouts after which nothing that can wait keeps pairs of effects from being tried."""
        return (1.0 - PAIRED) * self.limit

    def may_go_on(self, until: float = float("inf")) -> bool:
        """Is something left of the budget, ``until`` so many? That it was not is remembered: :attr:`cut_short`."""
        left = self.count < min(self.limit, until)
        self.cut_short |= not left
        return left

    def space(self, effects: tuple[str, ...]) -> ParameterSpace:
        return self.problem.with_effects(*effects).space

    def objective(self, effects: tuple[str, ...], recordings: Sequence[str] = ()) -> Objective:
        """White residuals of the model with ``effects``.

        Args:
            effects: beside those of the study.
            recordings: of those that are fitted; left out, all.
        """
        return Objective(
            self.pool, self.space(effects), recordings or self.problem.fit_on, self.fit.noise, self.offsets,
            discrepancy=self.discrepancy, smooth=self.problem.pieces > 1,
        )  # fmt: skip

    def quick(self, effects: tuple[str, ...]) -> Objective:
        """The same of as many recordings as are enough to search on."""
        return on_some(self.objective(effects))

    def see_numerics(self, effects: tuple[str, ...], unit: FloatArray) -> None:
        """Look at the model's own errors where it fits best so far, and at what it cannot repeat there."""
        space = self.space(effects)
        values = space.as_dict(space.from_unit(unit))
        found = numerics(self.pool, values, self.fit.noise, self.offsets)
        names = (*self.problem.fit_on, *self.problem.hold_out)
        self.rough = roughness(self.pool, space, unit, names)
        self.discrepancy = self.rough.discrepancy(
            self.problem.recordings, self.fit.noise, self.offsets, found.directions
        )
        check_repeatable(self.discrepancy, self.problem.fit_on)
        self._elsewhere += found.cost
        if not effects:
            self.moved = found.moved

    def polished(self, effects: tuple[str, ...], start: FloatArray, evaluations: int) -> Polished:
        """A least-squares fit of the model with ``effects``, of as many evaluations as the budget has left."""
        objective = self.objective(effects)
        return polish(objective, start, self._affordable(objective, evaluations))

    def searched(self, effects: tuple[str, ...], start: FloatArray, evaluations: int) -> Polished:
        """The same from where it may be far from: of many recordings some lead it nearer first."""
        objective = self.objective(effects)
        if (some := on_some(objective)) is objective:
            return self.polished(effects, start, evaluations)
        there = polish(some, start, self._affordable(some, evaluations))
        return on_all(objective, some, there, start, self._affordable(objective, evaluations))

    def _affordable(self, objective: Objective, evaluations: int) -> int:
        """So many, if the budget has them left; a search begins and ends with derivatives."""
        left = max(1, (self.limit - self.count) // len(objective.recordings) - 2 * len(objective.space))
        self.cut_short |= left < evaluations
        return min(evaluations, left)

    def as_a_user_fits(self, candidate: Candidate) -> FloatArray:
        """Where a fit of the model with the candidate ends that leaves nothing to numerics: as ``muslin fit`` does it.

        A diagnosis fits beside what a finer mesh or another engine would change, so its own fit may be far off the
        measurement along those directions, and its errors would not compare with those of the user's model.
        """
        if not self.discrepancy.directions:
            return candidate.fit.unit
        key = (*candidate.space.names, candidate.fit.unit.tobytes())
        if key not in self._as_fitted:
            objective = Objective(
                self.pool, candidate.space, self.problem.fit_on, self.fit.noise, self.offsets,
                discrepancy=replace(self.discrepancy, directions={}), smooth=self.problem.pieces > 1,
            )  # fmt: skip
            self._as_fitted[key] = polish(objective, candidate.fit.unit, USER_EVALUATIONS).unit
        return self._as_fitted[key]

    def roughly_polished(
        self,
        effects: tuple[str, ...],
        start: FloatArray,
        evaluations: int,
        known: FloatArray | None,
        recordings: Sequence[str] = (),
    ) -> Polished:
        """The same with few derivatives, see :func:`~..polish.polish`, and perhaps on some ``recordings`` only."""
        return polish(self.objective(effects, recordings), start, evaluations, known=known, roughly=True)

    def roughly_searched(self, effects: tuple[str, ...], start: FloatArray, evaluations: int) -> Polished:
        """The same, of many recordings to some: what it leaves is of all, its derivatives are of these."""
        objective = self.objective(effects)
        some = on_some(objective)
        found = polish(some, start, evaluations, roughly=True)
        return found if some is objective else self._again(effects, found)

    def evidence(self, effects: tuple[str, ...], plain: Polished, candidates: Sequence[Candidate]) -> Evidence:
        """Hold out, and put together what decides between candidates for the model that has ``effects``."""
        space = self.space(effects)
        held = self.held_out(space, plain.unit)
        return Evidence(
            rss_plain=plain.rss,
            count=max(plain.count - len(space), 1.0),
            held_out_plain=root_mean_square(list(held.errors.values())),
            held_out_white=held.mean_square,
            noise_sd=self.fit.noise.sd,
            noise_error=self.fit.noise.relative_error,
            candidates=tuple(self.judged(c, held) for c in candidates),
            unsure=self.fit.noise.information * self.discrepancy.left_to_chance(self.problem.fit_on),
        )

    def jointly(self, after: Candidate, *plain: Polished) -> Evidence:
        """The model as it was beside all that was found, both whitened by the numerics as last seen.

        Args:
            after: with all that was found.
            plain: fits of the model as it was, of which the nearest counts.
        """
        effects = self._effects_of(after)
        later = replace(after, fit=self._again(effects, after.fit))
        return self.evidence((), min((self._again((), fit) for fit in plain), key=lambda p: p.rss), [later])

    def _effects_of(self, candidate: Candidate) -> tuple[str, ...]:
        """All that a candidate's model has beyond the study's own, which are in every space already."""
        has = set(self.problem.space.names)
        return tuple(dict.fromkeys(n.split(".", 1)[0] for n in candidate.space.names if "." in n and n not in has))

    def told(self, candidate: Candidate) -> Candidate:
        """With what is known of its coefficients where chance moves them, and where a misfit stays.

        A misfit that stays counts as often as it goes together in time, as in a fit. Beside what numerics may be off by
        it is not like these, so what they take off may not be right either. How far the fit goes if they take off
        nothing counts as doubt, by the share of what is left that is no noise: a right model goes no farther than its
        covariance says (Hausman, *Specification tests*, 1978).
        """
        effects = self._effects_of(candidate)
        objective = self.objective(effects)
        seen = told_together(objective, seen_past_chance(objective, self._again(effects, candidate.fit)))
        told = replace(candidate.fit, covariance=seen.covariance, grown=seen.grown, together=seen.together)
        candidate = replace(candidate, fit=told)
        if candidate.fit.left < MISFIT:
            return candidate
        share = 1.0 - 1.0 / candidate.fit.left
        return replace(candidate, doubt=np.sqrt(share) * (self.as_a_user_fits(candidate) - candidate.fit.unit))

    def _again(self, effects: tuple[str, ...], fit: Polished) -> Polished:
        """The same point with residuals that are whitened as they are now."""
        objective = self.objective(effects)
        white = objective.one(fit.unit)
        return replace(fit, white=white, count=objective.count(white))

    def judged(self, candidate: Candidate, plain: HeldOut | None = None) -> Candidate:
        """With its held-out errors.

        Args:
            candidate: fitted.
            plain: the model without it on the held-out recordings; left out, these count as ones that would show it.
        """
        held = self.held_out(candidate.space, candidate.fit.unit)
        shift, gain = (float("inf"), 0.0) if plain is None else (held.shift(plain), held.gain(plain))
        return replace(
            candidate, held_out=held.errors, held_out_white=held.mean_square, held_out_shift=shift, held_out_gain=gain
        )

    def held_out(self, space: ParameterSpace, unit: FloatArray) -> HeldOut:
        """A point of a space on the held-out recordings. Each point is simulated once."""
        values = space.as_dict(space.from_unit(unit))
        # a coefficient of zero is as good as one that is not there
        key = tuple(sorted((name, value) for name, value in values.items() if value or "." not in name))
        if key not in self._held_out:
            self._held_out[key] = held_out_residuals(self.pool, self.problem, space, unit, self.fit.noise, self.offsets)
        found = self._held_out[key]
        errors = {name: float("inf") if r is None else r.rms for name, r in found.items()}
        white = [self.discrepancy.whitened(name, r.white) for name, r in found.items() if r is not None]
        every = np.concatenate(white) if white and len(white) == len(found) else None
        return HeldOut(errors, every, self.fit.noise.information, self.discrepancy.dropped(list(found)))
