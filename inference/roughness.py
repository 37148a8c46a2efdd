"""Where a simulation cannot be repeated: how far next to nothing in the parameters moves the object.

A rope that is lowered onto a table buckles one way or the other, a fold tips over or does not. What a right model does
after that is chance as far as its parameters tell, and no fit should follow it.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from ..core.arrays import FloatArray
from ..core.measurement import Recording
from ..core.parameters import ParameterSpace
from ..core.rollout import Trajectory
from ..core.study import SimulationPool, Task
from .noise import Noise
from .polish import STEP
from .residuals import Offsets, by_residual

#: Directions in the unit cube, each tried on both sides.
_DIRECTIONS = 3


def roughness(
    pool: SimulationPool, space: ParameterSpace, unit: FloatArray, recordings: Sequence[str]
) -> dict[str, FloatArray]:
    """Standard deviation in every frame ``(T,)`` [m or px] of what no fit can follow, by recording.

    From second differences of the predictions at the step of :mod:`.polish`: a smooth model has next to none, and where
    neighbours lie anywhere each has the variance of one rollout six times over. All points of a frame count as one.

    Args:
        pool: where rollouts run.
        space, unit: parameters, and where to look in their unit cube ``(D,)``.
        recordings: names; one that cannot be simulated there is left out.
    """
    rng = np.random.default_rng(59)
    middle = np.clip(unit, STEP, 1.0 - STEP)
    sides = STEP * rng.choice([-1.0, 1.0], size=(_DIRECTIONS, len(unit)))
    points = np.vstack([middle, middle + sides, middle - sides])
    tasks = [Task(space.as_dict(space.from_unit(p)), name) for name in recordings for p in points]
    outcomes = iter(pool.map(tasks))
    found = {}
    for name in recordings:
        made = [next(outcomes) for _ in points]
        series = [o.series for o in made if isinstance(o, Trajectory)]
        if len(series) < len(points):
            continue
        positions = np.stack([s.points for s in series])
        second = positions[1 : _DIRECTIONS + 1] + positions[_DIRECTIONS + 1 :] - 2 * positions[0]
        found[name] = np.sqrt(np.nanmean(second**2, axis=(0, 2, 3)) / 6)
    return found


def chance_of(
    rough: Mapping[str, FloatArray], recordings: Mapping[str, Recording], noise: Noise, offsets: Offsets
) -> dict[str, FloatArray]:
    """The same for the white residuals of ``recordings``, as variances ``(N_r,)`` [noise variances]."""
    return {name: by_residual(recordings[name], offsets, (sd / noise.sd) ** 2) for name, sd in rough.items()}


def unrepeatable(rough: Mapping[str, FloatArray], recordings: Mapping[str, Recording], noise: Noise) -> list[str]:
    """Where chance is more than the noise, in words, a recording each."""
    out = []
    for name, sd in rough.items():
        frames = np.flatnonzero(sd > noise.sd)
        if len(frames):
            size = f"{1e3 * sd.max():.0f} mm" if noise.unit == "m" else f"{sd.max():.0f} px"
            since = recordings[name].series.time[frames[0]]
            out.append(f"{name} from {since:.2f} s on, by up to {size}")
    return out
