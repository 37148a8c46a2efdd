"""Residuals of a fitted model on the recordings that it was not fitted to."""

from ...core.arrays import FloatArray
from ...core.parameters import ParameterSpace
from ...core.rollout import Trajectory
from ...core.study import Problem, SimulationPool, Task
from ..noise import Noise
from ..residuals import Offsets, Residual, residual


def held_out_residuals(
    pool: SimulationPool, problem: Problem, space: ParameterSpace, unit: FloatArray, noise: Noise, offsets: Offsets
) -> dict[str, Residual | None]:
    """By held-out recording; None where it cannot be simulated.

    Args:
        pool: where rollouts run.
        problem: whose recordings.
        space, unit: parameters, and the point ``(D,)`` of their unit cube.
        noise, offsets: of the measurement.
    """
    values, names = space.as_dict(space.from_unit(unit)), problem.hold_out
    made = pool.map([Task(values, n) for n in names])
    return {
        name: residual(problem.recordings[name], o.series, noise, offsets) if isinstance(o, Trajectory) else None
        for name, o in zip(names, made, strict=True)
    }
