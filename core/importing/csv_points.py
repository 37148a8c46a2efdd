"""Points from a long-form CSV: ``time,point,x,y[,z]``, and ``recording`` where there are several takes."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ..arrays import FloatArray
from ..errors import InputError
from .raw import RawTake
from .table import Row, Table, read_table

#: A table with more empty places than this a row, and more than a million, mixed up its columns.
_LARGEST_EMPTINESS = 1000


def read_csv(path: Path) -> list[RawTake]:
    """One take for every name in the column ``recording``, or one unnamed take; all have the points of the whole file.

    A point that has no row at a time was not seen then.

    Raises:
        InputError: see :func:`~.table.read_table`; also two rows of one point at one time, and time
            going backwards from one row of a point to its next.
    """
    table = read_table(path, ("time", "point", "x", "y"), ("z", "recording"))
    groups: dict[str, list[Row]] = {}
    for row in table.rows:
        groups.setdefault(row.cells.get("recording", "").strip(), []).append(row)
    if "recording" in table.columns and "" in groups:
        raise InputError(f"{path}, line {groups[''][0].line}: recording is empty; give every row the name of its take")
    # one order for all takes: the point that a take shows first may be another in each
    points = _ordered(list(dict.fromkeys(row.cells["point"].strip() for row in table.rows)))
    return [_take(table, rows, name or None, points) for name, rows in groups.items()]


def _take(table: Table, rows: Sequence[Row], name: str | None, names: Sequence[str]) -> RawTake:
    axes = ("x", "y", "z") if "z" in table.columns else ("x", "y")
    times = [table.number(row, "time") for row in rows]
    last: dict[str, tuple[float, int]] = {}
    for row, time in zip(rows, times, strict=True):
        point = row.cells["point"].strip()
        if not point:
            raise InputError(f"{table.path}, line {row.line}: point is empty; give every row the name of its point")
        before, line = last.get(point, (-np.inf, 0))
        if time <= before:
            raise InputError(
                f"{table.path}, line {row.line}: time of point {point!r} must rise, but {time:g} s follows "
                f"{before:g} s of line {line}; sort the rows, and give each take its own name in a column 'recording'"
            )
        last[point] = (time, row.line)
    order = {point: k for k, point in enumerate(names)}
    clock, frame = np.unique(times, return_inverse=True)
    size = len(clock) * len(order)
    if size > 1_000_000 and size > _LARGEST_EMPTINESS * len(rows):
        raise InputError(
            f"{table.path}: {len(order)} points at {len(clock)} times, but only {len(rows)} rows; "
            "are the columns time and point mixed up?"
        )
    points: FloatArray = np.full((len(clock), len(order), len(axes)), np.nan)
    for row, k in zip(rows, frame, strict=True):
        points[k, order[row.cells["point"].strip()]] = [table.number(row, axis, gap=True) for axis in axes]
    return RawTake(clock, points, name=name, labels=tuple(names))


def _ordered(names: list[str]) -> list[str]:
    """Numbers by value; anything else in the order of the file."""
    return sorted(names, key=int) if all(n.isdecimal() for n in names) else names
