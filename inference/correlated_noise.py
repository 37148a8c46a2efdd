"""Noise that is correlated in time, told from one take: it is what markers do not share.

Slow noise passes for motion in every difference over time, so that roughness makes it too small, and a right model
would show a misfit. But noise is each marker's own, while what a model misses moves neighbours together: once the
leading singular directions are taken off the residuals, as many as stand out of independent noise (parallel analysis:
Horn 1965, with AR(1) noise as the reference), noise is what is left.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import lfilter

from ..core.arrays import FloatArray
from ..core.differences import fourth_differences, robust_sd
from .noise import Noise
from .noise_draws import ar1_noise

#: Below this correlation from frame to frame noise is taken for white, which roughness tells better.
WHITE = 0.4
#: A recording needs as many frames, and coordinates of markers, to tell.
_FRAMES, _COLUMNS = 20, 12
#: Correlations that are tried.
_GRID = np.array([0.0, 0.2, 0.4, 0.6, 0.7, 0.8, 0.9, 0.95])
#: Simulated noise to compare with, and the quantile of its leading direction that stands out.
_REPLICATES, _QUANTILE = 60, 0.99
#: How far the spread of what is left may be off from what the roughness of the same residuals says, and from what a
#: person has said [relative].
_AGREE, _AGREE_TOLD = 0.2, 0.25
#: Directions that are taken off beyond those that stand out: slow noise hides slow misfit.
_MORE = 2
#: No standard deviation is known better, as slow noise and a slow misfit look alike [relative].
_ERROR = 0.1


@dataclass(frozen=True)
class _Own:
    """What markers do not share in one recording: standard deviation, correlation, and how many numbers told it."""

    sd: float
    ar1: float
    count: int


def correlated_noise(noise: Noise, residuals: Sequence[FloatArray]) -> Noise:
    """``noise``, or what is left in the residuals if that is correlated in time.

    Args:
        noise: so far; one that repeats have told stays.
        residuals: of the best fit, ``(T, P, A)`` a recording with correspondence [unit]; NaN = not seen.
    """
    if noise.ar1 > 0 or noise.source.endswith("repeats"):
        return noise
    rng = np.random.default_rng(67)
    found = [own for own in (_own(r, rng) for r in residuals) if own is not None]
    if not found:
        return noise
    weights = [own.count for own in found]
    sd = float(np.sqrt(np.average([own.sd**2 for own in found], weights=weights)))
    ar1 = float(np.average([own.ar1 for own in found], weights=weights))
    told = not noise.source.startswith("roughness")
    if ar1 < WHITE or (told and abs(sd / noise.sd - 1) > _AGREE_TOLD):
        return noise
    source = f"{noise.source}, and what markers do not share: correlated, {ar1:.2f} from frame to frame"
    if told:
        return replace(noise, ar1=ar1, source=source)
    independent = sum(weights) * (1 - ar1) / (1 + ar1)
    return replace(noise, sd=sd, ar1=ar1, source=source, relative_error=float(np.hypot(_ERROR, independent**-0.5)))


def _own(residual: FloatArray, rng: np.random.Generator) -> _Own | None:
    """None if nothing that is left looks like independent noise."""
    x = _filled(residual)
    if x.shape[0] < _FRAMES or x.shape[1] < _COLUMNS:
        return None
    rough = robust_sd(fourth_differences(x))
    u, s, vt = np.linalg.svd(x, full_matrices=False)
    enough = None
    for shared in range(len(s) // 2):
        off = (u[:, :shared], vt[:shared])
        left = (u[:, shared:] * s[shared:]) @ vt[shared:]
        lags = [_expected(off[0], a)[1] for a in _GRID]
        if _lag(left) > lags[-1]:
            continue  # too slow for noise
        ar1 = float(np.interp(_lag(left), lags, _GRID))
        total = float(np.sum(left**2))
        sd = float(np.sqrt(total / (_expected(off[0], ar1)[0] * (x.shape[1] - shared))))
        if enough is None and abs(sd * _roughness_of(ar1) / rough - 1) < _AGREE:
            leading = [_leading(_noise(x.shape, ar1, off, rng)) for _ in range(_REPLICATES)]
            enough = shared if s[shared] ** 2 / total <= np.quantile(leading, _QUANTILE) else None
        if enough is not None and shared >= enough + _MORE:
            return _Own(sd, ar1, int(np.isfinite(residual).sum()))
    return None


def _expected(off: FloatArray, ar1: float) -> tuple[float, float]:
    """Of a column of AR(1) noise of unit variance without the directions ``off (T, K)``: mean square sum, and lag.

    With R the noise's correlations and P what takes the directions off, these are the trace of P R P and the sum beside
    its diagonal over that. R times a direction is what the noise's filter makes of it forwards and backwards.
    """
    ahead, back = (lfilter([1.0], [1.0, -ar1], d, axis=0) for d in (off, off[::-1]))
    seen = ahead + back[::-1] - off
    inner = off @ (off.T @ seen)
    squares = 1.0 + np.sum(off * (inner - 2.0 * seen), axis=1)
    beside = ar1 + np.sum(off[:-1] * (inner - seen)[1:] - seen[:-1] * off[1:], axis=1)
    lag = np.sum(beside) / np.sqrt(np.sum(squares[1:]) * np.sum(squares[:-1]))
    return float(np.sum(squares)), float(lag)


def _leading(x: FloatArray) -> float:
    """The share of the square sum of ``x (T, C)`` that its leading singular direction has."""
    products = x @ x.T if x.shape[0] < x.shape[1] else x.T @ x
    return float(np.linalg.eigvalsh(products)[-1] / np.trace(products))


def _filled(residual: FloatArray) -> FloatArray:
    """Coordinates as columns ``(T, C)``; gaps are bridged, what is seen less than half of the time is left out."""
    x = residual.reshape(len(residual), -1)
    frames = np.arange(len(x))
    columns = []
    for column in x.T:
        seen = np.isfinite(column)
        if 2 * seen.sum() > len(x):
            columns.append(np.interp(frames, frames[seen], column[seen]))
    return np.array(columns).T if columns else np.zeros((len(x), 0))


def _noise(
    shape: tuple[int, ...], ar1: float, off: tuple[FloatArray, FloatArray], rng: np.random.Generator
) -> FloatArray:
    """AR(1) noise of unit variance without the directions ``off`` in time ``(T, K)`` and over columns ``(K, C)``."""
    made = ar1_noise(shape, ar1, rng)
    made -= off[0] @ (off[0].T @ made)
    return np.asarray(made - (made @ off[1].T) @ off[1])


def _lag(x: FloatArray) -> float:
    """Correlation from frame to frame."""
    return float(np.sum(x[1:] * x[:-1]) / np.sqrt(np.sum(x[1:] ** 2) * np.sum(x[:-1] ** 2)))


def _roughness_of(ar1: float) -> float:
    """Standardised fourth difference of AR(1) noise of unit variance."""
    weights = np.correlate([1.0, -4.0, 6.0, -4.0, 1.0], [1.0, -4.0, 6.0, -4.0, 1.0], "full")
    return float(np.sqrt(np.sum(weights * ar1 ** np.abs(np.arange(-4, 5))) / 70.0))
