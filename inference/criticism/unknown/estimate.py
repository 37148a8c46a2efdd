"""What is not known, parameters and forces together: their residuals, sensitivities, and what became of them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ....core.arrays import FloatArray
from ....core.measurement import Recording
from ....core.parameters import ParameterSpace
from ....core.rollout import Trajectory
from ....core.study import Outcome, SimulationPool, Task
from ...discrepancy import Discrepancy
from ...noise import Noise
from ...residuals import Offsets, residual
from .basis import Basis
from .field import PULL
from .follow import named

#: Step of the finite differences by a function of mean square one [m/s2].
FORCE_STEP = 0.1
#: Parameters stay so far from the bounds of their prior [of its width].
INSIDE = 0.005


@dataclass(frozen=True, eq=False)
class Unknowns:
    """What is estimated together: the parameters of the model and the force in every recording.

    Args:
        space: parameters.
        recordings: names.
        effects: names of the force in each.
        bases: of each.
        pulls: towards what was measured, in each [rad/s]. A force that is learned from a model left to itself must
            fight all that its errors have grown into, which in cloth is chaos; held by an observer, a model
            answers nearly linearly, and what the observer still has to do is the misfit (Ljung 1999, "System
            Identification", the prediction-error method).
    """

    space: ParameterSpace
    recordings: tuple[str, ...]
    effects: tuple[str, ...]
    bases: tuple[Basis, ...]
    pulls: tuple[float, ...]

    @property
    def starts(self) -> list[int]:
        """Where the force of each recording begins in a vector of all unknowns, and where that ends."""
        return [int(n) for n in np.cumsum([len(self.space), *(len(b) for b in self.bases)])]

    def force(self, point: FloatArray, number: int) -> FloatArray:
        """The coefficients ``(K,)`` [m/s2] of one recording."""
        return point[self.starts[number] : self.starts[number + 1]]

    def values(self, point: FloatArray, number: int) -> dict[str, float]:
        """Of one rollout."""
        unit = np.clip(point[: len(self.space)], INSIDE, 1 - INSIDE)
        told = self.space.as_dict(self.space.from_unit(unit))
        effect = self.effects[number]
        return {**told, **named(effect, self.force(point, number)), f"{effect}.{PULL}": self.pulls[number]}

    def precisions(self, smooth: float) -> FloatArray:
        """Diagonal of the prior's precision: of parameters that of the prior, of forces rising with roughness."""
        rough = [np.repeat((1.0 + b.roughness) ** 2, 3) for b in self.bases]
        return np.concatenate([np.full(len(self.space), 12.0), smooth * np.concatenate(rough)])


@dataclass(frozen=True, eq=False)
class Estimate:
    """What was found.

    Args:
        unknowns: what the point is made of.
        point: parameters in the unit cube and coefficients ``(D + sum K,)``.
        centre: where the prior of the parameters sits ``(D,)``.
        white: residuals there, one array a recording.
        slopes: their derivatives by all unknowns, one ``(N, D + sum K)`` a recording.
        smooth: precision of the smoothest functions [s4/m2].
        paths: of the vertices ``(T, V, 3)`` [m], one a recording.
        count: independent numbers that the residuals are worth.
        rss_without: residual sum of squares without the force, the parameters as they were fitted.
    """

    unknowns: Unknowns
    point: FloatArray
    centre: FloatArray
    white: list[FloatArray]
    slopes: list[FloatArray]
    smooth: float
    paths: list[FloatArray]
    count: float
    rss_without: float

    @property
    def rss(self) -> float:
        return float(sum(w @ w for w in self.white))

    @property
    def explained(self) -> float:
        """Share of the excess misfit that goes away with the force, 0 to 1."""
        return float(np.clip((self.rss_without - self.rss) / max(self.rss_without - self.count, 1e-9), 0.0, 1.0))

    def covariance(self) -> FloatArray:
        """Of the point (Laplace), ``(D + sum K,) * 2``."""
        return np.asarray(np.linalg.inv(self._information() + np.diag(self.unknowns.precisions(self.smooth))))

    def degrees(self) -> float:
        """How many free numbers the data have given the force."""
        information = self._information()
        share = np.linalg.solve(information + np.diag(self.unknowns.precisions(self.smooth)), information)
        return float(np.trace(share))

    def _information(self) -> FloatArray:
        """Of the data, as they were weighed against the prior: misfit that is left makes them tell less."""
        scale = max(1.0, self.rss / max(self.count, 1.0))
        return np.asarray(sum(s.T @ s for s in self.slopes) / scale)


class ForceObjective:
    """White residuals of some recordings as a function of parameters and forces.

    Args:
        pool, unknowns: where rollouts run, and what they are a function of.
        noise, offsets: of the measurement.
        discrepancy: what the model cannot repeat, which no force should explain.
        progress: told of rollouts done, and of how many there are, of the sensitivities of one recording.
    """

    def __init__(
        self,
        pool: SimulationPool,
        unknowns: Unknowns,
        noise: Noise,
        offsets: Offsets,
        discrepancy: Discrepancy,
        progress: Callable[[int, int], None],
    ) -> None:
        self.pool, self.unknowns, self.noise, self.offsets = pool, unknowns, noise, offsets
        self.discrepancy, self.progress = discrepancy, progress
        self.recordings = [pool.problem.recordings[n] for n in unknowns.recordings]

    def look(self, points: Sequence[FloatArray]) -> list[tuple[list[FloatArray], list[FloatArray]] | None]:
        """Residuals and paths at every point; None where a rollout failed."""
        u = self.unknowns
        tasks = [Task(u.values(p, r), name) for p in points for r, name in enumerate(u.recordings)]
        made = list(self.pool.map(tasks))
        out: list[tuple[list[FloatArray], list[FloatArray]] | None] = []
        for k in range(len(points)):
            mine = made[k * len(u.recordings) : (k + 1) * len(u.recordings)]
            whole = [m for m in mine if isinstance(m, Trajectory)]
            pairs = zip(self.recordings, whole, strict=False)
            white = [self._white(recording, m) for recording, m in pairs]
            out.append((white, [m.vertices for m in whole]) if len(whole) == len(mine) else None)
        return out

    def slopes(self, point: FloatArray, white: list[FloatArray]) -> list[FloatArray]:
        """Derivatives by all unknowns, one-sided; where the neighbour fails the other side, else unknown and zero."""
        u = self.unknowns
        out = []
        for r, name in enumerate(u.recordings):
            own = [*range(len(u.space)), *range(u.starts[r], u.starts[r + 1])]
            matrix = np.zeros((len(white[r]), len(point)))
            for side in (1.0, -1.0):
                steps = {}
                for k in own:
                    step = np.zeros(len(point))
                    step[k] = side * (self._inward(point[k]) if k < len(u.space) else FORCE_STEP)
                    steps[k] = step
                made = self.pool.map([Task(u.values(point + s, r), name) for s in steps.values()])
                failed = []
                for done, (k, m) in enumerate(zip(own, made, strict=True)):
                    self.progress(done + 1, len(own))
                    moved = self._or_none(self.recordings[r], m)
                    if moved is None:
                        failed.append(k)
                    else:
                        matrix[:, k] = (moved - white[r]) / steps[k][k]
                own = failed
                if not own:
                    break
            out.append(matrix)
        return out

    def count(self, white: Sequence[FloatArray]) -> float:
        """Independent numbers that residuals, an array a recording, are worth."""
        dropped = self.discrepancy.dropped(self.unknowns.recordings)
        return self.noise.information * (sum(len(w) for w in white) - dropped)

    def derivatives(self, estimate: Estimate, number: int, steps: dict[str, float]) -> list[FloatArray]:
        """Derivatives ``(N,)`` of one recording's residuals by further values, from zero; zero where one fails."""
        u = self.unknowns
        known, base = u.values(estimate.point, number), estimate.white[number]
        made = self.pool.map([Task({**known, n: step}, u.recordings[number]) for n, step in steps.items()])
        moved = [self._or_none(self.recordings[number], m) for m in made]
        return [
            np.zeros(len(base)) if m is None else (m - base) / step
            for m, step in zip(moved, steps.values(), strict=True)
        ]

    def _white(self, recording: Recording, made: Trajectory) -> FloatArray:
        white = residual(recording, made.series, self.noise, self.offsets).white
        return self.discrepancy.whitened(recording.name, white)

    def _or_none(self, recording: Recording, made: Outcome) -> FloatArray | None:
        return self._white(recording, made) if isinstance(made, Trajectory) else None

    def _inward(self, unit: float) -> float:
        """A step of a parameter that stays inside its prior."""
        step = self.discrepancy.step
        return step if unit + step <= 1 - INSIDE else -step
