"""A first force: pull the model along what was measured, and learn from the pull (iterative learning control)."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from scipy.interpolate import CubicSpline

from ....core.arrays import FloatArray
from ....core.measurement import Recording
from ....core.rollout import Trajectory
from ....core.scenario import Scenario
from ....core.study import SimulationPool, Task
from .basis import Basis
from .field import PULL, Aim, pulled

#: How fast the model is pulled [rad/s]: the slowest at which it stays with the recording.
PULLS = (5.0, 10.0, 20.0)
#: Rollouts from which the force is learned, one after the other.
LESSONS = 4
#: A model that is so near stays with the recording [standard deviations of the noise].
NEAR = 3.0
#: A marker must be seen in so many frames, and in half of all, to be followed.
FEWEST_FRAMES = 8


def make_aim(recording: Recording, scenario: Scenario, basis: Basis) -> Aim | None:
    """Where the model should go: through the markers as they were seen.

    Not smoothed: what smoothing takes off a fast motion would be a bias, while the noise of the markers averages out,
    as the pull is slower than the frames.

    None for points without correspondence, in pixels, or hardly ever seen: nothing says then where which vertex was.
    """
    series = recording.series
    if not series.correspondence or series.unit != "m" or series.points.shape[2] != 3:
        return None
    points = series.points
    if scenario.beside is not None:
        points = scenario.beside.axis(points, scenario.motion.at(series.time))
    seen = np.asarray(np.isfinite(points).all(axis=2))
    good = np.flatnonzero((seen.sum(axis=0) >= FEWEST_FRAMES) & (2 * seen.sum(axis=0) >= series.frames))
    if not len(good):
        return None
    times = np.linspace(series.time[0], series.time[-1], 4 * series.frames)
    places, speeds = np.empty((len(times), len(good), 3)), np.empty((len(times), len(good), 3))
    for k, marker in enumerate(good):
        when = series.time[seen[:, marker]]
        for axis in range(3):
            spline = CubicSpline(when, points[seen[:, marker], marker, axis])
            inside = np.clip(times, when[0], when[-1])
            places[:, k, axis] = spline(inside)
            speeds[:, k, axis] = np.where(inside == times, spline(inside, 1), 0.0)
    markers = scenario.markers[good]
    spread = np.asarray(np.linalg.pinv(markers @ basis.modes, rcond=0.1), np.float64)
    return Aim(times, places, speeds, markers, spread)


def velocities_of(times: FloatArray, vertices: FloatArray) -> FloatArray:
    """Velocities ``(T, V, 3)`` [m/s] of a path ``(T, V, 3)``, from a cubic spline through the frames."""
    return np.asarray(CubicSpline(times, vertices)(times, 1))


def follow(
    pool: SimulationPool,
    recording: str,
    effect: str,
    basis: Basis,
    aim: Aim,
    values: Mapping[str, float],
    noise: float,
    progress: Callable[[int, int], None],
) -> tuple[FloatArray, float]:
    """Learn the force along which the model follows one recording.

    In every lesson the model is simulated with the force so far and the pull towards the measurement; what the
    pull does, smoothed to the basis, is added to the force (Arimoto, Kawamura and Miyazaki 1984).

    Args:
        pool: whose problem has the force as ``effect``.
        recording: its name.
        effect: name of the force in the problem.
        basis, aim: of the force.
        values: of all other parameters.
        noise: standard deviation [m].
        progress: told of lessons done, and of how many there are at most.

    Returns:
        Coefficients ``(K,)`` [m/s2] and the pull [rad/s]; zeros if the model cannot be pulled.
    """
    best: tuple[float, FloatArray, float] = (np.inf, np.zeros(len(basis)), 0.0)
    for k, rate in enumerate(PULLS):
        force = np.zeros(len(basis))
        for lesson in range(LESSONS):
            progress(k * LESSONS + lesson, len(PULLS) * LESSONS)
            task = Task({**values, **named(effect, force), f"{effect}.{PULL}": rate}, recording)
            (made,) = pool.map([task])
            if not isinstance(made, Trajectory):
                break
            gap = pool.problem.recordings[recording].series.points - made.series.points
            away = float(np.sqrt(np.nanmean(gap**2)))
            if away < best[0]:
                best = (away, force, rate)
            force = force + basis.project(made.series.time, _pull(made, basis, aim, rate))
        if best[0] < NEAR * noise:
            break
    return best[1], best[2]


def named(effect: str, coefficients: Sequence[float] | FloatArray) -> dict[str, float]:
    """Coefficients ``(K,)`` as values of a rollout."""
    return {f"{effect}.{k}": float(c) for k, c in enumerate(coefficients)}


def _pull(made: Trajectory, basis: Basis, aim: Aim, rate: float) -> FloatArray:
    """Accelerations ``(T, V, 3)`` [m/s2] that the pull gave."""
    times, fast = made.series.time, velocities_of(made.series.time, made.vertices)
    modal = [pulled(aim, rate, t, x, v) for t, x, v in zip(times.tolist(), made.vertices, fast, strict=True)]
    return np.asarray(np.einsum("vp,tpx->tvx", basis.modes, np.array(modal)))
