"""A comparison in the results store."""

from typing import Any

import numpy as np
import zarr

from ....core.arrays import IntArray
from ....core.store import put
from .held import Held
from .parts import distances
from .phases import MOTION
from .sets import SetView


def write_take(group: zarr.Group, held: Held, sets: SetView, motion: IntArray) -> None:
    """One recording: what was measured, what is predicted, how far both are apart, and pictures' numbers."""
    unit = held.recording.series.unit
    scatter = np.std(held.draws, axis=0) if len(held.draws) > 1 else np.zeros_like(held.shown.series.points)
    arrays: list[tuple[str, Any, list[str], str]] = [
        ("time", held.recording.series.time, ["time"], "s"),
        ("error", held.residual.by_time, ["time"], unit),
        ("scatter", np.sqrt(np.mean(scatter**2, axis=(1, 2))), ["time"], unit),
        ("point_error", held.residual.by_point, ["point"], unit),
        ("difference", held.residual.difference, ["time", "point", "axis"], unit),
        ("measured", held.recording.series.points, ["time", "point", "axis"], unit),
        ("predicted", held.shown.series.points, ["time", "predicted_point", "axis"], unit),
        ("vertices", held.shown.vertices, ["time", "vertex", "axis"], "m"),
        ("triangles", held.scenario.body.triangles, ["triangle", "corner"], "1"),
        ("motion_phase", motion, ["time"], "1"),
        ("mmd", sets.mmd, ["time"], "1"),
        ("mmd_threshold", sets.threshold, ["time"], "1"),
        ("views", sets.views, ["view", "direction", "axis"], "1"),
        ("witness", sets.witness, ["view", "grid_row", "grid_column"], "1"),
        ("witness_low", sets.low, ["view", "direction"], unit),
        ("witness_high", sets.high, ["view", "direction"], unit),
        ("witness_limit", sets.witness_limit, ["view"], "1"),
    ]
    for name, data, dims, its_unit in arrays:
        put(group, name, data, dims, its_unit)
    along = distances(held.scenario)
    if along is not None:
        put(group, "distance_from_grasp", along[held.usual_vertex], ["predicted_point"], "m", "along the object")
    if len(held.draws):
        put(group, "draws", held.draws.astype(np.float32), ["draw", "time", "predicted_point", "axis"], unit)
    group.attrs.update(
        {
            "clock_offset_s": held.residual.clock,
            "correspondence": held.paired,
            "kernel_bandwidth": sets.bandwidth,
            "sets_worst_frame": sets.worst,
            "motion_phases": list(MOTION),
        }
    )
