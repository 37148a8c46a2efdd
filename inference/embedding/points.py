"""Point series to standardised points: the statistics come from the training draws, once."""

from dataclasses import dataclass

import numpy as np

from ...core.arrays import BoolArray, FloatArray
from ...core.errors import InputError

# Standardised coordinates beyond this are pulled back to it, so that one exploded draw rules no mean or basis.
_LIMIT = 12.0


@dataclass(frozen=True, eq=False)
class PointScaler:
    """Standardises the points of one recording.

    The centre of each frame, over draws and points, is taken off: the motion that all draws share is no news. One
    scale for all frames and axes keeps the geometry isotropic and the noise as large in one frame as in the next.

    Args:
        center: ``(T, 1, A)`` [unit of the points].
        scale: root mean square of what is left, winsorised at the 99th percentile [unit of the points].
        points: P when the points correspond, else None: any number of points will do.
    """

    center: FloatArray
    scale: float
    points: int | None

    @classmethod
    def fit(cls, x: FloatArray, correspondence: bool) -> "PointScaler":
        """Statistics of ``(N, T, P, A)`` draws, NaN = not seen."""
        seen = np.asarray(np.isfinite(x).all(axis=3))
        axes = (0, 2)
        count = seen.sum(axis=axes, keepdims=True)[..., None]
        total = np.where(seen[..., None], x, 0.0).sum(axis=axes, keepdims=True)
        center = (total / np.maximum(count, 1))[0]
        left = np.abs((x - center)[seen])
        spread = float(np.sqrt(np.mean(np.minimum(left, np.quantile(left, 0.99)) ** 2))) if left.size else 0.0
        size = float(np.abs(x[seen]).max()) if left.size else 0.0
        # Draws that differ by rounding only are constant; a scale of one then leaves zeros, not noise blown up.
        return cls(center, spread if spread > 1e-10 * max(size, 1e-30) else 1.0, x.shape[2] if correspondence else None)

    def transform(self, x: FloatArray) -> tuple[FloatArray, BoolArray]:
        """``(N, T, P, A)`` to standardised points, 0 where not seen, and the mask ``(N, T, P)`` of those seen.

        Raises:
            InputError: the frames, axes or corresponding points are not those of the training draws.
        """
        frames, _, axes = self.center.shape
        wanted = f"(T = {frames}, P = {'any' if self.points is None else self.points}, A = {axes})"
        fits = x.shape[1] == frames and x.shape[3] == axes and self.points in (None, x.shape[2])
        if not fits:
            raise InputError(f"a recording has shape {x.shape[1:]}, but training had {wanted}; resample it to match")
        seen = np.asarray(np.isfinite(x).all(axis=3))
        z = np.clip((np.where(seen[..., None], x, 0.0) - self.center) / self.scale, -_LIMIT, _LIMIT)
        z = np.where(seen[..., None], z, 0.0)
        return canonical(z, seen) if self.points is None else (z, seen)


def canonical(z: FloatArray, seen: BoolArray) -> tuple[FloatArray, BoolArray]:
    """The points of every frame in lexicographic order, unseen ones last.

    A sum of floating-point numbers depends on their order in the last bits; sorted, the embedding of a set is the
    same to the bit in whatever order its points came.
    """
    keys = (*(z[..., a] for a in range(z.shape[3] - 1, -1, -1)), ~seen)
    order = np.lexsort(keys, axis=-1)
    return np.take_along_axis(z, order[..., None], axis=2), np.take_along_axis(seen, order, axis=2)
