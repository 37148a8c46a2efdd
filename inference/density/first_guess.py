"""The first guess that a density starts from: of two regressions the better one, parameter by parameter."""

from dataclasses import dataclass

import numpy as np

from ...core.arrays import BoolArray, FloatArray
from .sparse_regression import SparseRegression


@dataclass(frozen=True, eq=False)
class FirstGuess:
    """A sparse linear regression, or a prediction made elsewhere where its left-out errors are smaller.

    Args:
        line: the regression.
        elsewhere: ``(D,)``, where the other prediction is taken.
        residual: ``(N, D)`` left-out errors of the training draws.
    """

    line: SparseRegression
    elsewhere: BoolArray
    residual: FloatArray

    @classmethod
    def fit(cls, columns: FloatArray, z: FloatArray, weights: FloatArray, other: FloatArray | None) -> "FirstGuess":
        """Choose.

        Args:
            columns: ``(N, F)``; z: ``(N, D)`` targets; weights: ``(N,)``.
            other: ``(N, D)`` predictions of the targets, each made without its draw; None where there are none.
        """
        line = SparseRegression.fit(columns, z, weights)
        if other is None:
            return cls(line, np.zeros(z.shape[1], bool), line.residual)
        linear, left = ((weights[:, None] * e**2).sum(axis=0) for e in (line.residual, z - other))
        better = np.asarray(left < linear)
        return cls(line, better, np.where(better, z - other, line.residual))

    def mean(self, columns: FloatArray, other: FloatArray | None) -> FloatArray:
        """``(B, F)`` columns and ``(B, D)`` other predictions to ``(B, D)``."""
        mean = self.line.mean(columns)
        return mean if other is None else np.asarray(np.where(self.elsewhere, other, mean))
