"""What draws span: of what is seen, the part that parameters can make."""

from collections.abc import Sequence

import numpy as np

from ...core.arrays import FloatArray
from .takes import Takes

#: Components by which clean draws differ by less than this are left out [noise standard deviations].
LEAST = 0.5
#: A measurement is as far off the best fit at most as flaws move this share of draws.
USUAL = 0.95


class Span:
    """Projects what is seen of points that correspond onto the principal components of clean draws.

    Recordings have thousands of numbers, and all that parameters do to them lies along a few directions: by far most
    of the noise, and of what no parameter can make, lies across. With a hundred draws an estimator cannot find these
    directions behind the noise where the draws are near each other, but without the noise they are plain. Unordered
    points are left as they are.

    Args:
        takes: what is seen of a draw, and what was measured; where that lacks something (NaN) nothing is done.
        points: draws as simulated ``(N, T, P, A)`` a group of takes.
        log_weights: of the draws ``(N,)``; None if all weigh the same.
    """

    def __init__(self, takes: Takes, points: Sequence[FloatArray], log_weights: FloatArray | None) -> None:
        rows = zip(takes.measured(), takes.correspondence, strict=True)
        self._seen = [np.isfinite(m) if corresponding else None for m, corresponding in rows]
        self._takes = takes
        self._basis: FloatArray | None = None
        draws = self._flat(takes.clean(points))
        if not draws.shape[1]:
            return
        weights = np.ones(len(draws)) if log_weights is None else np.exp(log_weights - log_weights.max())
        share = weights / weights.sum()
        self._mean = share @ draws
        # of few draws of many numbers; the other way round the matrix would be huge
        off = np.sqrt(share)[:, None] * (draws - self._mean)
        variances, vectors = np.linalg.eigh(off @ off.T)
        kept = variances > min((LEAST * takes.noise.sd) ** 2, 0.5 * variances[-1])
        self._basis = off.T @ (vectors[:, kept] / np.sqrt(variances[kept]))
        self._draws = (draws - self._mean) @ self._basis

    def __call__(self, seen: Sequence[FloatArray]) -> list[FloatArray]:
        """The same, one array ``(..., T, P, A)`` a group, with what lies across the span taken off."""
        return list(seen) if self._basis is None else self._at(self._coordinates(seen), seen)

    def measured(self, predicted: Sequence[FloatArray], flawed: Sequence[FloatArray]) -> list[FloatArray]:
        """The measurement, with no more of what the best fit leaves than flaws of a measurement would.

        An estimator knows nothing of models that are wrong: what it never saw of a draw takes it anywhere. What the
        best fit leaves lies across all that parameters do next to it, but not across the span, which bends.

        Args:
            predicted: by the best fit, ``(T, P, A)`` a group.
            flawed: the draws that make the span, as seen ``(N, T, P, A)``.
        """
        if self._basis is None:
            return self._takes.measured()
        best = self._coordinates(self._takes.clean(predicted))
        off = self._coordinates(self._takes.measured()) - best
        most = np.quantile(np.linalg.norm(self._coordinates(flawed) - self._draws, axis=-1), USUAL)
        if (far := float(np.linalg.norm(off))) > most:
            off *= most / far
        return self._at(best + off, self._takes.measured())

    def _coordinates(self, seen: Sequence[FloatArray]) -> FloatArray:
        return np.asarray((self._flat(seen) - self._mean) @ self._basis)

    def _at(self, coordinates: FloatArray, like: Sequence[FloatArray]) -> list[FloatArray]:
        """Points at ``coordinates (..., K)``; where these do not tell them they are as in ``like``."""
        assert self._basis is not None
        flat = self._mean + coordinates @ self._basis.T
        out, end = [np.array(a, dtype=np.float64) for a in like], 0
        for a, where in zip(out, self._seen, strict=True):
            if where is not None:
                begin, end = end, end + int(where.sum())
                a[..., where] = flat[..., begin:end]
        return out

    def _flat(self, points: Sequence[FloatArray]) -> FloatArray:
        """All that is seen of what corresponds, ``(..., M)``."""
        parts = [a[..., where] for a, where in zip(points, self._seen, strict=True) if where is not None]
        return np.concatenate(parts, axis=-1) if parts else np.zeros((len(points[0]), 0))
