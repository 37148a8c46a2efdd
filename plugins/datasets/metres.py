"""Whether the numbers of a set are metres, as they are to be."""

from pathlib import Path

import numpy as np

from ...core.arrays import FloatArray
from ...core.errors import InputError
from ...core.importing.units import LARGEST_SPAN


def check_metres(points: FloatArray, name: str, path: Path) -> None:
    """Raise :class:`InputError` if ``points (..., 3)`` lie farther apart than anything in metres does.

    A hundredth at either end does not count, as trackers put a point anywhere now and then.
    """
    seen = points[np.isfinite(points).all(axis=-1)]
    if not len(seen):
        return
    low, high = np.quantile(seen, (0.01, 0.99), axis=0)
    if (span := float(np.max(high - low))) > LARGEST_SPAN:
        raise InputError(
            f"{path}: {name} reach over {span:.4g} m, while this set is in metres; if they are in millimetres, divide "
            "all positions in the file by 1000"
        )
