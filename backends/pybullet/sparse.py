"""A sparse matrix times vectors, without any library for it."""

from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from ...core.arrays import FloatArray, IntArray

#: Maps ``(columns, 3)`` to a new array ``(rows, 3)``.
Operator: TypeAlias = Callable[[FloatArray], FloatArray]
#: A dense product of no more multiplications than this beats gathering.
_DENSE = 60_000


def operator(rows: IntArray, columns: IntArray, values: FloatArray, shape: tuple[int, int]) -> Operator:
    """The matrix with ``values`` at ``rows`` and ``columns`` (added where they coincide), ready to be applied."""
    if shape[0] * shape[1] <= _DENSE:
        dense = np.zeros(shape)
        np.add.at(dense, (rows, columns), values)
        return dense.__matmul__
    flat = np.ravel(rows).astype(np.int64) * shape[1] + np.ravel(columns)
    key, where = np.unique(flat, return_inverse=True)
    entries = np.bincount(where.ravel(), np.ravel(values))
    row, column = key // shape[1], key % shape[1]
    start = np.searchsorted(row, np.arange(shape[0]))
    place = np.arange(len(row)) - start[row]
    width = int(place.max()) + 1
    # One padded list of neighbours a row, kept as columns: a step takes one neighbour of every row.
    index = np.zeros((width, shape[0]), dtype=np.int64)
    weight = np.zeros((width, shape[0], 1))
    index[place, row], weight[place, row, 0] = column, entries
    gathered = np.empty((width, shape[0], 3))

    def apply(vectors: FloatArray) -> FloatArray:
        np.take(vectors, index, axis=0, out=gathered, mode="clip")
        np.multiply(gathered, weight, out=gathered)
        return np.asarray(gathered.sum(axis=0))

    return apply


def from_dense(matrix: FloatArray) -> Operator:
    """The same for a matrix ``(V, V)`` with many zeros."""
    rows, columns = np.nonzero(matrix)
    return operator(rows, columns, matrix[rows, columns], (matrix.shape[0], matrix.shape[1]))
