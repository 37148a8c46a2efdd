"""Balls dropped from a bridge: heights from a video."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ...core.arrays import FloatArray
from ...core.dataset import about, chosen, note
from ...core.errors import MissingFileError
from ...core.importing.table import Row, Table, read_table
from ...core.measurement import Recording
from ...core.series import PointSeries

#: A ball has been let go once it is so far below where it was highest [m]: some standard deviations of its height.
FALLEN = 1.0
#: A free fall over :data:`FALLEN` takes 0.452 s; some light balls need a little longer.
BEFORE = 0.47


def read_balls(path: Path, takes: Sequence[str]) -> list[Recording]:
    """Drops of ``drops.csv``: columns ball, drop, time_s, height_m; a take is ``BALL-DROP``, as ``golf-ball-1``.

    The video tells heights only: x and y are NaN. The drops of a ball are repeats of one motion. The ball is held for
    some frames before it is let go; those are left out but for the last, so that the release comes less than a frame
    after the first: what is left is for a clock offset.

    References:
        de Silva, Higdon, Brunton and Kutz, *Discovery of physics from data: universal laws and discrepancies*,
        Frontiers in Artificial Intelligence 3 (2020); github.com/briandesilva/discovery-of-physics-from-data.
    """
    if not path.is_file():
        raise MissingFileError(f"there is no file {path}; name drops.csv")
    table = read_table(path, ("ball", "drop", "time_s", "height_m"), ())
    groups: dict[str, list[Row]] = {}
    for row in table.rows:
        groups.setdefault(f"{_slug(row.cells['ball'])}-{row.cells['drop'].strip()}", []).append(row)
    return [_recording(table, groups[name], name) for name in chosen(takes, list(groups), path)]


def _recording(table: Table, rows: Sequence[Row], name: str) -> Recording:
    time = np.array([table.number(row, "time_s") for row in rows])
    height = np.array([table.number(row, "height_m") for row in rows])
    points = np.full((len(time), 1, 3), np.nan)
    points[:, 0, 2] = height
    with about(f"{table.path}, take {name!r}"):
        PointSeries(time, points)  # two drops of one name must not pass for one that is held for long
        first = _first(time, height)
        if first:
            note(f"{name}: left out {first} of {len(time)} frames, in which the ball is still held")
        return Recording(name, PointSeries(time[first:], points[first:]), motion=name.rsplit("-", 1)[0])


def _first(time: FloatArray, height: FloatArray) -> int:
    """The last frame that is certainly not after the release, or 0."""
    level = height.max() - FALLEN
    below = int(np.argmax(height < level))
    if below == 0:  # it never falls, or has fallen already
        return 0
    a, b = height[below - 1], height[below]
    passed = time[below - 1] + (time[below] - time[below - 1]) * (a - level) / (a - b)
    return int(max(np.searchsorted(time, passed - BEFORE, side="right") - 1, 0))


def _slug(ball: str) -> str:
    return "-".join(ball.lower().split())
