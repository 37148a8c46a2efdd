"""Where a simulation cannot be repeated: how far next to nothing in the parameters moves the object.

A rope that is lowered onto a table buckles one way or the other, a fold tips over or does not. What a right model does
after that is chance as far as its parameters tell, and no fit should follow it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..core.arrays import FloatArray
from ..core.errors import MuslinError
from ..core.measurement import Recording
from ..core.parameters import ParameterSpace
from ..core.rollout import Trajectory
from ..core.study import SimulationPool, Task
from .discrepancy import LEAST_STEP, MOST_STEP, Discrepancy
from .noise import Noise
from .residuals import Offsets, by_residual

#: Places along the diagonal of the unit cube, the middle one first, then its nearest, then neighbours farther off.
_PLACES = np.array([0.0, -LEAST_STEP, LEAST_STEP, -2 * MOST_STEP, -MOST_STEP, MOST_STEP, 2 * MOST_STEP])
_LINE = [3, 4, 0, 5, 6]


@dataclass(frozen=True, eq=False)
class Roughness:
    """How the model answers to next to nothing, a frame ``(T,)``, by recording; root mean squares over coordinates.

    Args:
        sd: standard deviation of what no fit can follow [m or px].
        nearest: the same told by the nearest neighbours alone.
        bend: second derivative along the diagonal [m or px].
    """

    sd: Mapping[str, FloatArray]
    nearest: Mapping[str, FloatArray]
    bend: Mapping[str, FloatArray]

    def chance(self, recordings: Mapping[str, Recording], noise: Noise, offsets: Offsets) -> dict[str, FloatArray]:
        """What no fit can follow in white residuals, as variances ``(N_r,)`` [noise variances]."""
        return {name: by_residual(recordings[name], offsets, (sd / noise.sd) ** 2) for name, sd in self.sd.items()}

    def step(self, noise: Noise) -> float:
        """Step of one-sided differences in the unit cube that chance and curvature blur least, where frames count.

        References:
            Moré and Wild, *Estimating derivatives of noisy simulations*, 2012.
        """
        counts = {name: sd <= noise.sd for name, sd in self.sd.items()}
        off = np.concatenate([np.zeros(0), *(self.nearest[n][keep] for n, keep in counts.items())])
        bend = np.concatenate([np.zeros(0), *(self.bend[n][keep] for n, keep in counts.items())])
        if not len(off) or not bend.any():
            return MOST_STEP
        best = 8**0.25 * np.sqrt(np.linalg.norm(off) / np.linalg.norm(bend))
        return float(np.clip(best, LEAST_STEP, MOST_STEP))

    def discrepancy(
        self,
        recordings: Mapping[str, Recording],
        noise: Noise,
        offsets: Offsets,
        directions: Mapping[str, FloatArray] | None = None,
    ) -> Discrepancy:
        """What this, and ``directions`` if there are any, mean for residuals and their derivatives."""
        return Discrepancy(directions or {}, self.chance(recordings, noise, offsets), self.step(noise))


def roughness(pool: SimulationPool, space: ParameterSpace, unit: FloatArray, recordings: Sequence[str]) -> Roughness:
    """Look at neighbours of a point: a smooth model leaves nothing of a parabola through them, however much it bends.

    Args:
        pool: where rollouts run.
        space, unit: parameters, and where to look in their unit cube ``(D,)``.
        recordings: names; one that cannot be simulated there is left out.
    """
    span = np.abs(_PLACES).max()
    points = np.clip(unit, span, 1.0 - span) + _PLACES[:, None]
    powers = np.vander(_PLACES[_LINE] / MOST_STEP, 3)
    solve = np.linalg.pinv(powers)
    tasks = [Task(space.as_dict(space.from_unit(p)), name) for name in recordings for p in points]
    outcomes = iter(pool.map(tasks))
    sd, nearest, bend = {}, {}, {}
    for name in recordings:
        made = [next(outcomes) for _ in points]
        series = [o.series for o in made if isinstance(o, Trajectory)]
        if len(series) < len(points):
            continue
        positions = np.stack([s.points for s in series]).reshape(len(points), len(series[0].time), -1)
        beside = (positions[1] + positions[2] - 2 * positions[0]) ** 2 / 6
        fitted = np.tensordot(solve, positions[_LINE], axes=1)
        left = positions[_LINE] - np.tensordot(powers, fitted, axes=1)
        sd[name] = np.sqrt(np.nanmean((np.sum(left**2, axis=0) + beside) / (len(_LINE) - 2), axis=1))
        nearest[name] = np.sqrt(np.nanmean(beside, axis=1))
        bend[name] = np.sqrt(np.nanmean((2 * fitted[0] / MOST_STEP**2) ** 2, axis=1))
    return Roughness(sd, nearest, bend)


def check_repeatable(discrepancy: Discrepancy, recordings: Sequence[str]) -> None:
    """Raise :class:`MuslinError` where nothing of ``recordings`` counts, as chance decides all of it."""
    if discrepancy.nothing_counts(recordings):
        raise MuslinError(
            "nothing can be said of what the model lacks: in every frame of the fitted recordings next to nothing in "
            "the parameters moves it by more than the noise; fit on motions that can be repeated (in the air, "
            "trailing), or on the part before contact (muslin import --stop)"
        )


def unrepeatable(rough: Roughness, recordings: Mapping[str, Recording], noise: Noise) -> list[str]:
    """Where chance is more than the noise, in words, a recording each."""
    out = []
    for name, sd in rough.sd.items():
        frames = np.flatnonzero(sd > noise.sd)
        if len(frames):
            size = f"{1e3 * sd.max():.2g} mm" if noise.unit == "m" else f"{sd.max():.2g} px"
            since = recordings[name].series.time[frames[0]]
            out.append(f"{name} from {since:.2f} s on, by up to {size}")
    return out
