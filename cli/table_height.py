"""How high the table is that a cloth lies on, by the markers or the cloud of it."""

from collections.abc import Sequence

import numpy as np

from ..core.measurement import Recording
from ..core.obstacles import Table
from ..core.scenarios.laid import before_it_moves, on_a_line
from ..core.scenarios.preset import Preset

#: A cloth lies on a table if its points spread upwards by less than this share of what they do sideways.
_LEVEL = 0.05
#: A table that is nearer to the built-in one than this is that one [m].
_SAME = 0.003
#: So far apart heights in several takes may be [m].
_AGREE = 0.005


def seen_table(base: Preset, recordings: Sequence[Recording]) -> Table | None:
    """The table of a scenario at the height at which all takes start flat on it.

    None if the scenario has none, the object is not seen to lie flat, or the built-in height is right.
    """
    if len(base.obstacles) != 1 or not isinstance(table := base.obstacles[0], Table):
        return None
    heights = [lies_at(r) for r in recordings]
    if None in heights or not heights:
        return None
    found = np.array(heights, float)
    height = float(np.median(found))
    if np.ptp(found) > _AGREE or abs(height - table.height) <= _SAME:
        return None
    return Table(round(height, 3), table.friction)


def lies_at(recording: Recording) -> float | None:
    """The height at which a cloth lies flat and level before a gripper moves [m]; None if it does not."""
    series = recording.series
    if series.unit != "m" or series.points.shape[2] != 3:
        return None
    first = before_it_moves(recording)[0] if series.correspondence else series.points[0]
    first = first[np.isfinite(first).all(axis=1)]
    if len(first) < 3 or on_a_line(first):
        return None
    sideways = np.sqrt(np.sum(np.var(first[:, :2], axis=0)))
    return float(np.mean(first[:, 2])) if np.std(first[:, 2]) < _LEVEL * sideways else None
