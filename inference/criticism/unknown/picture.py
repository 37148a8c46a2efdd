"""The estimated force as arrays for the store: on every vertex, in newton, with its uncertainty."""

from typing import Any

import numpy as np

from ....core.arrays import FloatArray, IntArray
from ....core.study import Problem
from .estimate import Estimate
from .library import scene_of

#: Data, dimensions and unit.
Stored = tuple[Any, list[str], str]


def force_arrays(estimate: Estimate, problem: Problem) -> dict[str, dict[str, Stored]]:
    """For every recording: force and its standard deviation, and the path that it makes."""
    u, covariance = estimate.unknowns, estimate.covariance()
    out: dict[str, dict[str, Stored]] = {}
    for r, name in enumerate(u.recordings):
        basis, times = u.bases[r], problem.scenarios[name].times
        scene, masses = scene_of(problem, name, u, estimate.point)
        force = masses[:, None] * basis.accelerations(times, u.force(estimate.point, r))
        force[:, scene.held] = 0.0  # what a gripper holds feels none
        part = covariance[u.starts[r] : u.starts[r + 1], u.starts[r] : u.starts[r + 1]]
        spread = masses[:, None] * _deviation(basis.cosines(times), basis.modes, basis.pairs, part)
        spread[:, scene.held] = 0.0
        out[name] = {
            "time": (times, ["time"], "s"),
            "force": (force, ["time", "vertex", "axis"], "N"),
            "force_sd": (spread, ["time", "vertex", "axis"], "N"),
            "vertices": (estimate.paths[r], ["time", "vertex", "axis"], "m"),
            "triangles": (problem.scenarios[name].body.triangles, ["triangle", "corner"], "1"),
        }
    return out


def worst_frame(force: FloatArray) -> int:
    """The frame of ``force (T, V, 3)`` in which it is largest, in the mean square over the vertices."""
    return int(np.argmax(np.sum(force**2, axis=(1, 2))))


def _deviation(cosines: FloatArray, modes: FloatArray, pairs: IntArray, covariance: FloatArray) -> FloatArray:
    """Standard deviations ``(T, V, 3)`` [m/s2] of a field, from the covariance of its coefficients."""
    out = np.empty((len(cosines), len(modes), 3))
    blocks = covariance.reshape(len(pairs), 3, len(pairs), 3)
    for axis in range(3):
        root = np.linalg.cholesky(blocks[:, axis, :, axis])
        for t, now in enumerate(cosines):
            shares = modes[:, pairs[:, 0]] * now[pairs[:, 1]]
            out[t, :, axis] = np.linalg.norm(shares @ root, axis=1)
    return out
