"""Where proposed motions are simulated: every model, every direction that its posterior leaves open, a finer step."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ....core.arrays import FloatArray
from ....core.motion import Motion
from ....core.rollout import Trajectory
from ....core.scenario import Scenario
from ....core.study import Problem, Study, Task
from ...noise import Noise
from ...residuals import Offsets
from ..numerics import STEP_ERROR, changes
from .rivals import Rival
from .shapes import Shape
from .telling import View


@dataclass(eq=False)
class Proposal:
    """One motion and what has been simulated of it so far.

    Args:
        shape: of it.
        motion: within the limits.
        points: what each model predicts ``(M, T, P, A)`` [m]; None before it was simulated.
        failed: it cannot be simulated with one of the models.
        views: of all models; empty before their sensitivities were simulated.
    """

    shape: Shape
    motion: Motion
    points: FloatArray | None = None
    failed: bool = False
    views: list[View] = field(default_factory=list)


class Bench:
    """Simulates proposals.

    Args:
        study: whose object is moved.
        problem: of it, knowing all effects of the models.
        scenario: of the fitted recordings, which gives the object and where it starts.
        times: of the observations, from 0 on ``(T,)`` [s].
        models: to be told apart.
        noise: of a recording.
        offsets: of a recording.
        shared: the first model's sensitivities stand for all: the others differ from it by a fixed change.
    """

    def __init__(
        self,
        study: Study,
        problem: Problem,
        scenario: Scenario,
        times: FloatArray,
        models: Sequence[Rival],
        noise: Noise,
        offsets: Offsets,
        shared: bool,
    ) -> None:
        self.study, self.problem, self.scenario, self.times = study, problem, scenario, times
        self.models, self.noise, self.offsets, self.shared = list(models), noise, offsets, shared
        self.count = 0

    @property
    def cost_of_points(self) -> int:
        """Rollouts for what the models predict of a motion."""
        return len(self.models)

    @property
    def cost_of_views(self) -> int:
        """Further rollouts for what their posteriors and their time step leave open."""
        finer = self.problem.simulator.finer() is not None
        return sum(len(m.unit) + finer for m in self._seen)

    @property
    def _seen(self) -> list[Rival]:
        """The models whose sensitivities are simulated."""
        return self.models[:1] if self.shared else self.models

    def predict(self, proposals: Sequence[Proposal]) -> None:
        """Fill in the points of all."""
        jobs = [(k, m.values()) for k in range(len(proposals)) for m in self.models]
        outcomes = iter(self._run(proposals, jobs, "simulating motions"))
        for proposal in proposals:
            points = [next(outcomes) for _ in self.models]
            whole = [p for p in points if p is not None]
            proposal.failed = len(whole) < len(points)
            proposal.points = None if proposal.failed else np.stack(whole)

    def look(self, proposals: Sequence[Proposal]) -> None:
        """Fill in the views of all that can be simulated."""
        able = [p for p in proposals if p.points is not None and not p.failed]
        moved = [m.steps() for m in self._seen]
        jobs = [
            (k, m.values(u))
            for k in range(len(able))
            for m, (units, _) in zip(self._seen, moved, strict=True)
            for u in units
        ]
        outcomes = iter(self._run(able, jobs, "simulating what the parameters change"))
        finer = iter(self._with_a_finer_step(able))
        for proposal in able:
            assert proposal.points is not None
            spreads = []
            for base, (units, weights) in zip(proposal.points, moved, strict=False):
                ends = [next(outcomes) for _ in units]
                proposal.failed |= any(e is None for e in ends)
                columns = [w * (e - base).ravel() for e, w in zip(ends, weights, strict=True) if e is not None]
                if (end := next(finer)) is not None:
                    columns += [STEP_ERROR * c.ravel() for c in changes(base, end)]
                spreads.append(self._white(np.column_stack([*columns, self._offsets(base)])))
            if proposal.failed:
                continue
            if self.shared:
                spreads = spreads * len(self.models)
            proposal.views = [View(self._white(p.ravel()), s) for p, s in zip(proposal.points, spreads, strict=True)]

    def _with_a_finer_step(self, proposals: Sequence[Proposal]) -> list[FloatArray | None]:
        """What every model whose sensitivities are simulated predicts with half its time step, by proposal."""
        finer = self.problem.simulator.finer()
        jobs = [(k, m.values()) for k in range(len(proposals)) for m in self._seen]
        if finer is None:
            return [None] * len(jobs)
        return self._run(proposals, jobs, "simulating smaller steps", replace(self.problem, simulator=finer))

    def _run(
        self,
        proposals: Sequence[Proposal],
        jobs: list[tuple[int, dict[str, float]]],
        title: str,
        problem: Problem | None = None,
    ) -> list[FloatArray | None]:
        """Points ``(T, P, A)`` of every job, None where it failed."""
        if not jobs:
            return []
        names = [f"motion {k}" for k in range(len(proposals))]
        still = replace(self.scenario, start_motion=None, earlier=None)  # a new recording starts at rest
        scenarios = {
            n: replace(still, motion=p.motion, times=self.times) for n, p in zip(names, proposals, strict=True)
        }
        problem = replace(problem or self.problem, scenarios=scenarios, fit_on=(names[0],), hold_out=(), recordings={})
        out: list[FloatArray | None] = []
        with self.study.pool(problem) as pool:
            for outcome in pool.map([Task(values, names[k]) for k, values in jobs]):
                out.append(outcome.series.points if isinstance(outcome, Trajectory) else None)
                self.study.progress(title, len(out), len(jobs))
        self.count += len(jobs)
        return out

    def _white(self, values: FloatArray) -> FloatArray:
        return np.asarray(values * (np.sqrt(self.noise.information) / self.noise.sd))

    def _offsets(self, points: FloatArray) -> FloatArray:
        """What the offsets of a recording may change ``(N, K)`` [m], one column for a standard deviation of each."""
        columns = []
        if self.offsets.clock > 0:
            columns.append(self.offsets.clock * np.gradient(points, self.times, axis=0).ravel())
        if self.offsets.constant > 0:
            for axis in np.eye(points.shape[2]):
                columns.append(self.offsets.constant * np.broadcast_to(axis, points.shape).ravel())
        return np.column_stack(columns) if columns else np.zeros((points.size, 0))
