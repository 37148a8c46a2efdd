"""A sparse matrix as arrays that compiled functions can use."""

from typing import NamedTuple

import numpy as np

from ...core.arrays import FloatArray, IntArray


class Rows(NamedTuple):
    """Row r has ``values[start[r]:start[r + 1]]`` in the columns ``columns[start[r]:start[r + 1]]``."""

    start: IntArray
    columns: IntArray
    values: FloatArray


def rows_of(matrix: FloatArray) -> Rows:
    """The numbers of ``matrix (N, M)`` that are not zero."""
    row, column = np.nonzero(matrix)
    start = np.searchsorted(row, np.arange(len(matrix) + 1))
    return Rows(start.astype(np.int64), column.astype(np.int64), np.ascontiguousarray(matrix[row, column], np.float64))
