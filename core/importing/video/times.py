"""When frames were taken, where a file beside them says so."""

from pathlib import Path

import numpy as np

from ...arrays import FloatArray
from ...errors import InputError

#: Files beside pictures that hold their times.
NAMES = ("time.csv", "times.csv", "timestamps.csv", "timestamp.csv", "times.txt", "timestamps.txt")
#: A time above this counts from 1970, not from the start of something [s].
EPOCH = 1e6


def read_times(path: Path) -> FloatArray:
    """Times ``(T,)`` [s]: one a line, first column, perhaps below a heading.

    Raises:
        InputError: a line holds no number, or times cannot be in seconds.
    """
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except UnicodeDecodeError as error:
        raise InputError(f"{path} is no text; it must hold one time in s a line") from error
    found: list[float] = []
    for number, line in enumerate(lines, 1):
        cell = line.replace(";", ",").replace("\t", ",").split(",")[0].strip()
        if not cell:
            continue
        try:
            found.append(float(cell))
        except ValueError as error:
            if not found and number == 1:
                continue  # a heading
            raise InputError(f"{path}, line {number}: {cell!r} is no time in s") from error
    times = np.array(found)
    if len(times) > 1 and float(np.median(np.abs(np.diff(times)))) > 5.0:
        raise InputError(
            f"{path}: times are {float(np.median(np.abs(np.diff(times)))):g} apart in the middle; they must be in "
            "seconds, are they in milliseconds or nanoseconds?"
        )
    return times


def since_first(times: FloatArray) -> tuple[FloatArray, float]:
    """Times that count from 1970 as times since the first, and what that was; others as they are, and 0."""
    origin = float(times[0]) if len(times) and times[0] > EPOCH else 0.0
    return times - origin, origin
