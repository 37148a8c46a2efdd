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

#: Places along a line through the unit cube, in steps of :mod:`.polish`, and the degree of what a smooth model follows.
_PLACES, _DEGREE = np.arange(-3.0, 4.0), 2


def roughness(
    pool: SimulationPool, space: ParameterSpace, unit: FloatArray, recordings: Sequence[str]
) -> dict[str, FloatArray]:
    """Standard deviation in every frame ``(T,)`` [m or px] of what no fit can follow, by recording.

    What the predictions at neighbouring places leave of a parabola through them: a smooth model leaves next to nothing,
    however much it bends. All points of a frame count as one.

    Args:
        pool: where rollouts run.
        space, unit: parameters, and where to look in their unit cube ``(D,)``.
        recordings: names; one that cannot be simulated there is left out.
    """
    rng = np.random.default_rng(59)
    span = STEP * np.abs(_PLACES).max()
    line = STEP * rng.choice([-1.0, 1.0], size=len(unit))
    points = np.clip(unit, span, 1.0 - span) + _PLACES[:, None] * line
    basis, _ = np.linalg.qr(np.vander(_PLACES, _DEGREE + 1))
    tasks = [Task(space.as_dict(space.from_unit(p)), name) for name in recordings for p in points]
    outcomes = iter(pool.map(tasks))
    found = {}
    for name in recordings:
        made = [next(outcomes) for _ in points]
        series = [o.series for o in made if isinstance(o, Trajectory)]
        if len(series) < len(points):
            continue
        positions = np.stack([s.points for s in series]).reshape(len(points), len(series[0].time), -1)
        rest = positions - np.tensordot(basis @ basis.T, positions, axes=1)
        found[name] = np.sqrt(np.nanmean(np.sum(rest**2, axis=0), axis=1) / (len(points) - _DEGREE - 1))
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
