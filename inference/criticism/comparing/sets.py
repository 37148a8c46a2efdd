"""Measured and predicted points of a frame as distributions: maximum mean discrepancy and its witness function."""

from copy import deepcopy
from dataclasses import dataclass

import numpy as np
import torch
from scipy.spatial.distance import pdist

from ....core.arrays import BoolArray, FloatArray, IntArray
from ...embedding.rkhs import RKHSEmbedding
from ...noise import Noise
from .held import Held
from .replicates import NoiseDraws
from .views import two_views

#: Random Fourier frequencies, replicates of the noise, and how rarely noise alone passes the threshold.
_FEATURES, _REPLICATES, _LEVEL = 256, 200, 0.05
#: Numbers that are embedded at a time: what stays in a processor's cache, which takes less than half the time.
_CHUNK = 1_000_000
#: Replicates of noise that is larger than this part of the bandwidth are embedded in single precision, which shows it.
_SEEN_SINGLE = 1e-4
#: Points of a frame that are compared, at most, and frames whose distances the bandwidth is the median of.
_MOST_POINTS, _MEDIAN_FRAMES = 200, 12
#: Places along each side of the grid that the witness is evaluated on, and by how much it reaches beyond the points.
_GRID, _MARGIN = 48, 0.15


@dataclass(frozen=True, eq=False)
class SetView:
    """One recording, its points taken as sets.

    Args:
        bandwidth: of the Gaussian kernel [unit], the median distance between measured points.
        mmd: between measured and predicted points of every frame ``(T,)`` [1]; NaN where nothing was seen.
        threshold: what it exceeds in any frame of one in twenty recordings under noise alone ``(T,)``.
        p_value: probability of a frame so far above its own mean under noise alone.
        worst: the frame that is farthest above it.
        views: right and up ``(W, 2, A)`` of the planes in which the witness is seen.
        witness: of the worst frame in each view ``(W, n, n)``, rows upwards; positive where more was measured.
        low, high: corners of the grid in each view ``(W, 2)`` [unit].
        witness_limit: what it exceeds anywhere in one of twenty such frames under noise alone ``(W,)``.
    """

    bandwidth: float
    mmd: FloatArray
    threshold: FloatArray
    p_value: float
    worst: int
    views: FloatArray
    witness: FloatArray
    low: FloatArray
    high: FloatArray
    witness_limit: FloatArray

    @property
    def beyond(self) -> float:
        """Share of the frames with points that are above the threshold."""
        known = np.isfinite(self.mmd)
        return float((self.mmd[known] > self.threshold[known]).mean())


def set_view(held: Held, noise: Noise, rng: np.random.Generator) -> SetView:
    """Compare the sets, frame by frame, with replicates of the best prediction seen under noise.

    A permutation of measured and predicted points would test whether both are samples of one density, and hardly ever
    object: here noise moves each point a little, so replicates are the prediction with that noise
    (Gretton et al., A kernel two-sample test, JMLR 13, 2012, for the statistic and the witness).
    """
    measured = held.recording.series.points.copy()
    unmeasured = ~np.isfinite(measured).any(axis=(0, 1))  # a coordinate that nobody measured agrees with any
    measured[..., unmeasured] = _matched(held)[..., unmeasured]
    columns = _spread(measured.shape[1], _MOST_POINTS)
    measured, origin = measured[:, columns], held.origin[:, columns]
    seen = np.asarray(np.isfinite(measured).all(axis=2))
    model = held.shown.series.points[:, _spread(held.shown.series.points.shape[1], _MOST_POINTS)]
    if held.paired:  # of points that correspond, those not seen say nothing about the others
        model = np.where(seen[..., None], model, np.nan)
    bandwidth = _median_distance(measured)
    embed = _Embedding(measured.shape[2], bandwidth, np.nanmean(measured, axis=(0, 1)))
    kind = torch.float32 if noise.sd > _SEEN_SINGLE * bandwidth else torch.float64
    predicted = embed(model[None])[0]
    mmd = np.linalg.norm(embed(measured[None])[0] - predicted, axis=1)
    draws = NoiseDraws(noise, _REPLICATES, rng)
    made = origin + draws.at(origin, rng) * noise.sd
    made[..., unmeasured] = origin[..., unmeasured]
    made[:, ~seen] = np.nan
    step = max(1, _CHUNK // (seen.size * _FEATURES))
    null = np.concatenate(
        [np.linalg.norm(embed(made[k : k + step], kind) - predicted, axis=2) for k in range(0, _REPLICATES, step)]
    )
    mean, spread = null.mean(axis=0), np.maximum(null.std(axis=0), 1e-12)
    empty = ~seen.any(axis=1)
    mmd[empty] = np.nan
    largest = np.where(empty, -np.inf, (null - mean) / spread).max(axis=1)
    own = np.where(empty, -np.inf, (mmd - mean) / spread)
    worst = int(own.argmax())
    p = float((1 + np.sum(largest >= own.max())) / (_REPLICATES + 1))
    threshold = mean + float(np.quantile(largest, 1 - _LEVEL)) * spread
    views = two_views(model[seen.any(axis=1)], held.recording.series.unit)
    flat = [_witness(measured[worst], model[worst], made[:, worst], rows, bandwidth) for rows in views]
    return SetView(
        bandwidth,
        mmd,
        np.where(empty, np.nan, threshold),
        p,
        worst,
        views,
        *(np.stack(x) for x in zip(*flat, strict=True)),
    )


def _matched(held: Held) -> FloatArray:
    return np.take_along_axis(held.shown.series.points, held.partner[..., None], axis=1)


class _Embedding:
    """Kernel means ``(N, T, 2 M)`` of point sets ``(N, T, P, A)``, NaN = not seen; of an unlearned RKHS layer.

    Args:
        axes: A.
        bandwidth: of the kernel.
        middle: that points are told from ``(A,)``, which takes nothing off a difference of means and much off rounding.
    """

    def __init__(self, axes: int, bandwidth: float, middle: FloatArray) -> None:
        generator = torch.Generator().manual_seed(0)
        layer = RKHSEmbedding(axes, _FEATURES, 1.0, generator, size=False)
        self.layers = {torch.float32: layer, torch.float64: deepcopy(layer).double()}
        self.bandwidth, self.middle = bandwidth, middle

    def __call__(self, points: FloatArray, kind: torch.dtype = torch.float64) -> FloatArray:
        seen: BoolArray = np.asarray(np.isfinite(points).all(axis=-1))
        z = torch.tensor(np.where(seen[..., None], points - self.middle, 0.0) / self.bandwidth, dtype=kind)
        with torch.no_grad():
            return np.asarray(self.layers[kind](z, torch.tensor(seen)).numpy(), np.float64)


def _witness(
    measured: FloatArray, model: FloatArray, made: FloatArray, rows: FloatArray, bandwidth: float
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Witness in a plane ``(n, n)``, corners of its grid, and its limit; the kernel is that of the plane."""
    one, two = (x[np.isfinite(x).all(axis=1)] @ rows.T for x in (measured, model))
    both = np.concatenate([one, two])
    reach = np.maximum(np.ptp(both, axis=0), 0.3 * np.ptp(both, axis=0).max() + 1e-12)
    middle = (both.min(axis=0) + both.max(axis=0)) / 2
    low, high = middle - (0.5 + _MARGIN) * reach, middle + (0.5 + _MARGIN) * reach
    x, y = (np.linspace(low[k], high[k], _GRID) for k in range(2))
    narrow = bandwidth / 4  # local enough to show which end of the object is off

    def factors(points: FloatArray) -> tuple[FloatArray, FloatArray]:
        kx, ky = (np.exp(-((g - points[..., k, None]) ** 2) / (2 * narrow**2)) for k, g in ((0, x), (1, y)))
        return kx, ky

    def mean(points: FloatArray) -> FloatArray:
        kx, ky = factors(points)
        return np.asarray(np.swapaxes(ky, -1, -2) @ kx / points.shape[-2])

    there = np.isfinite(made[0]).all(axis=1)
    null = np.abs(mean(made[:, there] @ rows.T) - mean(two)).max(axis=(1, 2))
    return mean(one) - mean(two), low, high, np.asarray(np.quantile(null, 1 - _LEVEL))


def _median_distance(points: FloatArray) -> float:
    """Median distance [unit] between two points of the same frame, of some frames, whatever their order."""
    frames = [points[t][np.isfinite(points[t]).all(axis=1)] for t in _spread(len(points), _MEDIAN_FRAMES)]
    gaps = np.concatenate([pdist(f) for f in frames])
    gaps = gaps[gaps > 0]
    return float(np.median(gaps)) if len(gaps) else 1.0


def _spread(count: int, most: int) -> IntArray:
    return np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(np.int64))
