"""What the tests of the command line share."""

import subprocess
from collections.abc import Callable

import numpy as np

from muslin.core.measurement import Measurement, Recording
from muslin.core.motion import Motion
from muslin.core.scenarios import preset
from muslin.core.series import PointSeries

Done = subprocess.CompletedProcess[str]
Muslin = Callable[..., Done]


def cloth_measurement(vertices: tuple[int, int] = (3, 3), seed: int = 0) -> Measurement:
    """Two recordings of a sheet that hangs from its gripper, 3 mm of noise."""
    rng = np.random.default_rng(seed)
    base = preset("fling")
    rest = base.body(vertices=vertices).vertices
    time = np.linspace(0.0, 0.2, 5)
    motion = Motion.from_positions(np.array([0.0, 0.2]), np.array([[[0.0, 0, 1.0]], [[0, 0.02, 1.0]]]))
    takes = []
    for name in ("one", "two"):
        points = rest + motion.at(time)[:, 0, None, :3] + rng.normal(0, 0.003, (5, len(rest), 3))
        takes.append(Recording(name, PointSeries(time, points), motion, "fling"))
    return Measurement(tuple(takes))
