"""How far points of a cloud lie off the surface that their neighbours make."""

from collections.abc import Sequence

import numpy as np
from scipy.spatial import cKDTree

from ..core.arrays import FloatArray, IntArray

#: Points that make a patch; frames of a recording that are looked at, at most.
_NEIGHBOURS, _FRAMES = 20, 40
#: Rounds in which the noise is found that scatters as much as is seen.
_ROUNDS = 4


def some_frames(count: int) -> IntArray:
    """Of so many frames those that are looked at."""
    return np.unique(np.linspace(0, count - 1, min(count, _FRAMES)).astype(int))


def scatter(clouds: Sequence[FloatArray], sd: float = 0.0, rng: np.random.Generator | None = None) -> float:
    """Variance of points about the plane through their neighbours, the median over all points [unit2].

    What a fold adds, or a second layer, is in few of them. Given ``rng``, not that of the clouds as they are, but laid
    flat patch by patch and with white noise ``sd`` of every coordinate.

    Args:
        clouds: ``(T, P, A)`` each [unit]; NaN = not seen.
        sd, rng: of noise that is put on flat patches.

    Returns:
        Zero if no frame has enough points, or they are in a picture, where a patch has no way off it.
    """
    found = []
    for points in clouds:
        for frame in points[some_frames(len(points))]:
            seen = frame[np.isfinite(frame).all(axis=1)]
            if len(seen) <= _NEIGHBOURS or seen.shape[1] < 3:
                continue
            variance, normal, middle = _planes(seen)
            if rng is not None:
                height = np.sum((seen - middle) * normal, axis=1)
                variance = _planes(seen - height[:, None] * normal + sd * rng.normal(size=seen.shape))[0]
            found.append(variance)
    return float(np.median(np.concatenate(found))) if found else 0.0


def patch_noise(clouds: Sequence[FloatArray]) -> float:
    """Standard deviation of white noise of every coordinate that makes patches scatter as they do [unit]; zero if none.

    As neighbours are chosen, and the plane is laid, by points that are off, scatter is less than the noise: what it is
    of flat patches with noise tells by how much.
    """
    seen = scatter(clouds)
    sd = float(np.sqrt(seen))
    for _ in range(_ROUNDS if seen > 0.0 else 0):
        sd *= float(np.sqrt(seen / max(scatter(clouds, sd, np.random.default_rng(73)), 1e-300)))
    return sd


def _planes(points: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Of the patch about every point ``(N, A)``: variance across its plane ``(N,)``, the plane's normal, the middle."""
    patches = points[cKDTree(points).query(points, _NEIGHBOURS)[1]]
    middle = patches.mean(axis=1)
    patches -= middle[:, None]
    variances, axes = np.linalg.eigh(np.swapaxes(patches, 1, 2) @ patches / _NEIGHBOURS)
    return variances[:, 0], axes[:, :, 0], middle
