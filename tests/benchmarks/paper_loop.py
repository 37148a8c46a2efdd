"""One method on one scenario: rounds of draws, training, and how far its posterior is from what really happened."""

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from paper_scene import Reality, Setting
from paper_seen import Detector, Space

from muslin.core.arrays import BoolArray, FloatArray
from muslin.core.camera import Camera
from muslin.core.estimator import Posterior, PosteriorEstimator
from muslin.core.registry import REGISTRY
from muslin.core.renderer import find_renderer
from muslin.core.rollout import Trajectory
from muslin.core.study import SimulationPool, Task
from muslin.inference.sequential.proposals import Kind, Proposals
from muslin.perception.chamfer import mask_chamfer, masks

#: Methods that are trained once, on a batch of draws from the prior; the others in rounds.
BULK = ("nn-bulk", "gp-bulk")
#: Of the frames that keypoints are seen in, every so many are drawn to compare masks.
DRAWN_EVERY = 2
#: Hidden parameters lie at least this far from the bounds of the prior, in the unit cube.
MARGIN = 0.15
# what a seed is for
_TRUTH, _PRIOR, _REAL, _DRAW, _SCORE = range(5)


class Cell(NamedTuple):
    """What is run: one method, on one scenario, once."""

    scenario: str
    reality: Reality
    keypoints: int
    seed: int
    method: str


@dataclass(frozen=True)
class Plan:
    """Sizes of a run.

    Args:
        iterations, per_iteration: rounds, and draws of each; bulk methods get as many in one.
        evaluations: trajectories behind a distance.
        proposals: kind of the later rounds' proposals.
        preset: of the estimators.
        space: of the keypoints.
    """

    iterations: int
    per_iteration: int
    evaluations: int
    proposals: Kind
    preset: str
    space: Space

    @property
    def bulk(self) -> int:
        """Draws of a bulk method."""
        return self.iterations * self.per_iteration


@dataclass
class Score:
    """Of one posterior.

    Args:
        draws: that it was trained on, failed ones included.
        distance, deviation: mean and standard deviation over the evaluation trajectories [px].
        log_prob: at the hidden parameters, on the unit cube; the prior has 0.
        mean, sd: of the posterior ``(D,)``, on the unit cube.
        failed: evaluation trajectories that could not be simulated.
        training: seconds of it.
    """

    draws: int
    distance: float
    deviation: float
    log_prob: float = 0.0
    mean: list[float] = field(default_factory=list)
    sd: list[float] = field(default_factory=list)
    failed: int = 0
    training: float = 0.0


class Stage:
    """One scenario with its pool of workers; what all methods share is simulated once.

    Args:
        setting: of the scenario.
        plan: of the run.
        workers: processes.
    """

    def __init__(self, setting: Setting, plan: Plan, workers: int | None) -> None:
        self.setting, self.plan = setting, plan
        self.space = setting.space
        self.camera: Camera = setting.camera()
        self.pool = SimulationPool(setting.problem(), workers)
        self._scene = setting.scene()
        self._renderer = find_renderer("auto")
        self._prior: dict[int, list[FloatArray | None]] = {}
        self._real: dict[tuple[Reality, int], tuple[FloatArray, BoolArray]] = {}

    @property
    def renderer(self) -> str:
        """What draws the masks."""
        return self._renderer.name

    def truth(self, seed: int) -> FloatArray:
        """Hidden parameters ``(D,)`` in the unit cube."""
        return np.random.default_rng([seed, _TRUTH]).uniform(MARGIN, 1.0 - MARGIN, len(self.space))

    def prior_units(self, seed: int, count: int) -> FloatArray:
        """``(count, D)`` draws from the prior; more of them begin with the same."""
        return np.random.default_rng([seed, _PRIOR]).random((count, len(self.space)))

    def prior(self, seed: int, count: int) -> list[FloatArray | None]:
        """Vertices of those draws, None for failed ones; simulated once for all methods."""
        known = self._prior.setdefault(seed, [])
        if len(known) < count:
            known.extend(self.simulate(self.prior_units(seed, count)[len(known) :]))
        return known[:count]

    def simulate(self, units: FloatArray) -> list[FloatArray | None]:
        """Vertices ``(T, V, 3)`` [m] of draws ``(N, D)``, None for failed ones."""
        tasks = [Task(self.space.as_dict(v), self.setting.name) for v in self.space.from_unit(units)]
        return [o.vertices.astype(np.float32) if isinstance(o, Trajectory) else None for o in self.pool.map(tasks)]

    def real(self, reality: Reality, seed: int) -> tuple[FloatArray, BoolArray]:
        """Vertices ``(T, V, 3)`` [m] and drawn masks ``(T', H, W)`` of what really happened."""
        if (reality, seed) not in self._real:
            vertices = self.setting.real(self.truth(seed), reality).vertices
            shown = masks(self._renderer, self.setting.scene(reality), self.camera, vertices[::DRAWN_EVERY])
            self._real[reality, seed] = vertices, shown
        return self._real[reality, seed]

    def distance(self, units: FloatArray, reality: Reality, seed: int) -> Score:
        """How far trajectories of ``units (N, D)`` are from the real one."""
        _, real = self.real(reality, seed)
        found = [v for v in self.simulate(units) if v is not None]
        apart = [
            mask_chamfer(masks(self._renderer, self._scene, self.camera, v[::DRAWN_EVERY].astype(float)), real).mean()
            for v in found
        ]
        failed = len(units) - len(found)
        if not apart:
            return Score(0, float("nan"), float("nan"), failed=failed)
        return Score(0, float(np.mean(apart)), float(np.std(apart)), failed=failed)

    def measured(self, cell: Cell) -> list[FloatArray]:
        """The real keypoints, one recording ``(1, T, K, A)``."""
        detector = Detector(self.setting.scene(cell.reality), self.camera, cell.keypoints, self.plan.space)
        rng = np.random.default_rng([cell.seed, _REAL, cell.keypoints])
        return [detector(self.real(cell.reality, cell.seed)[0], rng)]

    def observed(self, cell: Cell, vertices: Sequence[FloatArray | None], first: int) -> FloatArray:
        """Keypoints of the whole draws ``(N, T, K, A)``; ``first`` is the number of the first draw."""
        detector = Detector(self._scene, self.camera, cell.keypoints, self.plan.space)
        rngs = (np.random.default_rng([cell.seed, _DRAW, first + k]) for k in range(len(vertices)))
        made = [detector(v.astype(float), rng) for v, rng in zip(vertices, rngs, strict=True) if v is not None]
        return np.stack(made)

    def close(self) -> None:
        """End the workers."""
        self.pool.__exit__(None, None, None)


def bounds(stage: Stage, reality: Reality, seed: int) -> dict[str, Score]:
    """What any method lies between: draws from the prior, and the model with the hidden parameters themselves."""
    prior = stage.prior_units(seed, stage.plan.evaluations)
    return {
        "prior": stage.distance(prior, reality, seed),
        "truth": stage.distance(stage.truth(seed)[None], reality, seed),
    }


def run(stage: Stage, cell: Cell, progress: Callable[[str], None]) -> Iterator[Score]:
    """Scores of a method, after every round; one for a bulk method."""
    plan, seen = stage.plan, stage.measured(cell)
    if cell.method in BULK:
        units = stage.prior_units(cell.seed, plan.bulk)
        vertices = stage.prior(cell.seed, plan.bulk)
        whole = np.array([v is not None for v in vertices])
        posterior, seconds = _trained(cell, plan, units[whole], stage.observed(cell, vertices, 0), None, seen, 0)
        yield _scored(stage, cell, posterior, seconds, 0, plan.bulk)
        return
    proposals = Proposals(plan.proposals, len(stage.space), cell.seed)
    units = stage.prior_units(cell.seed, plan.per_iteration)
    vertices = stage.prior(cell.seed, plan.per_iteration)
    tried, whole, x = units, np.array([v is not None for v in vertices]), stage.observed(cell, vertices, 0)
    for k in range(plan.iterations):
        posterior, seconds = _learned(cell, plan, proposals, tried[whole], x, seen, k)
        score = _scored(stage, cell, posterior, seconds, k, len(tried))
        progress(f"round {k + 1} of {plan.iterations}: {score.distance:.2f} px")
        yield score
        if k + 1 == plan.iterations:
            return
        proposals.add(posterior, tried, ~whole)
        units = proposals.draw(plan.per_iteration)
        vertices = stage.simulate(units)
        x = np.concatenate([x, stage.observed(cell, vertices, len(tried))])
        tried = np.concatenate([tried, units])
        whole = np.concatenate([whole, [v is not None for v in vertices]])


def _learned(
    cell: Cell, plan: Plan, proposals: Proposals, theta: FloatArray, x: FloatArray, seen: list[FloatArray], k: int
) -> tuple[Posterior, float]:
    """The posterior of a round, corrected for where its draws come from."""
    learned, seconds = _trained(cell, plan, theta, x, proposals.log_weights(theta), seen, k)
    posterior = proposals.corrected(learned)
    if posterior is not None:
        return posterior, seconds
    weights = proposals.log_weights(theta, under_prior=True)
    again, more = _trained(cell, plan, theta, x, weights, seen, k)
    return again, seconds + more


def _trained(
    cell: Cell,
    plan: Plan,
    theta: FloatArray,
    x: FloatArray,
    log_weights: FloatArray | None,
    seen: list[FloatArray],
    k: int,
) -> tuple[Posterior, float]:
    began = time.perf_counter()
    estimator: PosteriorEstimator = REGISTRY.get("estimator", cell.method)(correspondence=False, preset=plan.preset)
    estimator.fit(theta, [x], log_weights=log_weights, seed=cell.seed + k)
    return estimator.posterior(seen), time.perf_counter() - began


def _scored(stage: Stage, cell: Cell, posterior: Posterior, seconds: float, k: int, draws: int) -> Score:
    samples = posterior.sample(1000, np.random.default_rng([cell.seed, _SCORE, k]))
    score = stage.distance(samples[: stage.plan.evaluations], cell.reality, cell.seed)
    score.draws, score.training = draws, round(seconds, 2)
    score.log_prob = float(posterior.log_prob(stage.truth(cell.seed)[None])[0])
    score.mean, score.sd = samples.mean(axis=0).round(4).tolist(), samples.std(axis=0).round(4).tolist()
    return score
