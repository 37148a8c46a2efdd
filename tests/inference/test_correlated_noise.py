"""Slow noise is told from one take, by what markers do not share; white noise, and what a model misses, are not it."""

import numpy as np
import pytest

from muslin.core.arrays import FloatArray
from muslin.core.measurement import Recording
from muslin.core.series import PointSeries
from muslin.inference.correlated_noise import _expected, correlated_noise
from muslin.inference.noise import Noise
from muslin.inference.repeated_noise import noise_of_repeats

#: As roughness tells noise of 3 mm with a correlation of 0.8.
TOLD = Noise(0.00107, 0.0, "roughness in time", "m", 0.02)


def ar1_noise(sd: float, ar1: float, seed: int, frames: int = 60, markers: int = 16) -> FloatArray:
    rng = np.random.default_rng(seed)
    made = rng.normal(size=(frames, markers, 3))
    for t in range(1, frames):
        made[t] = ar1 * made[t - 1] + np.sqrt(1 - ar1**2) * made[t]
    return np.asarray(sd * made)


def waves(frames: int = 60, markers: int = 16) -> FloatArray:
    """Three standing waves of a hanging rope, of one millimetre together, as a missing effect leaves them."""
    s, t = np.linspace(0, 1, markers), np.linspace(0, 2, frames)
    shapes = np.stack([np.sin((k + 0.5) * np.pi * s) for k in range(3)])
    paths = np.stack([np.exp(-t) * np.sin((2 + 3 * k) * t + k) / (1 + k) for k in range(3)])
    moved = np.einsum("kt,kp,ka->tpa", paths, shapes, np.array([[1.0, 0.2, 0.1], [0.3, 1.0, 0.0], [0.0, 0.5, 1.0]]))
    return np.asarray(moved / np.sqrt(np.mean(moved**2)) * 1e-3)


@pytest.mark.parametrize(("sd", "ar1"), [(0.003, 0.8), (0.003, 0.6), (0.001, 0.9)])
@pytest.mark.parametrize("misfit", [0.0, 1.0, 5.0])
def test_it_is_found_beside_a_misfit(sd: float, ar1: float, misfit: float) -> None:
    residuals = [ar1_noise(sd, ar1, seed) + misfit * waves() for seed in (0, 1)]
    residuals[0][np.random.default_rng(2).random((60, 16)) < 0.1] = np.nan
    found = correlated_noise(TOLD, residuals)
    assert found.sd == pytest.approx(sd, rel=0.25)
    assert found.ar1 == pytest.approx(ar1, abs=0.12)
    assert found.relative_error > TOLD.relative_error


@pytest.mark.parametrize("misfit", [0.0, 1.0, 5.0, 20.0])
def test_white_noise_stays_as_it_was_told(misfit: float) -> None:
    residuals = [ar1_noise(0.003, 0.0, seed) + misfit * waves() for seed in range(3)]
    assert correlated_noise(TOLD, residuals) is TOLD


def test_what_a_model_misses_is_no_noise() -> None:
    """Nothing but a misfit, and hardly any noise."""
    assert correlated_noise(TOLD, [5 * waves() + ar1_noise(1e-5, 0.0, 0)]) is TOLD


def test_what_repeats_tell_stays() -> None:
    told = Noise(0.003, 0.5, "2 takes that are repeats", "m", 0.05)
    assert correlated_noise(told, [ar1_noise(0.003, 0.9, 0)]) is told


def test_what_a_person_says_keeps_its_size() -> None:
    told = Noise(0.003, 0.0, "given in the study", "m", 0.02)
    found = correlated_noise(told, [ar1_noise(0.003, 0.8, 0)])
    assert found.sd == told.sd and found.ar1 == pytest.approx(0.8, abs=0.1)
    assert correlated_noise(told, [ar1_noise(0.006, 0.8, 0)]) is told  # a misfit of a kind, not this noise


@pytest.mark.parametrize("ar1", [0.0, 0.6, 0.95])
@pytest.mark.parametrize("shared", [0, 1, 7])
def test_what_is_expected_of_noise_is_what_its_correlations_say(ar1: float, shared: int) -> None:
    """Against the matrix of all correlations, with the directions taken off on both sides."""
    off = np.linalg.qr(np.random.default_rng(3).normal(size=(25, shared)))[0]
    frames = np.arange(25)
    keep = np.eye(25) - off @ off.T
    left = keep @ ar1 ** np.abs(frames[:, None] - frames) @ keep
    own, squares = np.diag(left), np.trace(left)
    lag = np.diag(left, 1).sum() / np.sqrt(own[1:].sum() * own[:-1].sum())
    np.testing.assert_allclose(_expected(off, ar1), [squares, lag], rtol=1e-9, atol=1e-12)


def test_too_few_numbers_tell_nothing() -> None:
    for residual in (ar1_noise(0.003, 0.8, 0, frames=12), ar1_noise(0.003, 0.8, 0, markers=3)):
        assert correlated_noise(TOLD, [residual]) is TOLD


@pytest.mark.parametrize("ar1", [0.0, 0.5, 0.8])
def test_repeats_tell_slow_noise_as_large_as_it_is(ar1: float) -> None:
    """The constant offset between takes is taken out, and with it some of the slowest noise."""
    time, found = np.arange(60) / 30, []
    for seed in range(6):
        points = [ar1_noise(0.003, ar1, 10 * seed + k) for k in (0, 1)]
        a, b = (Recording(str(k), PointSeries(time, p)) for k, p in enumerate(points))
        told = noise_of_repeats(a, b)
        assert told is not None
        found.append((told.variance, told.ar1))
    variance, lag = np.mean(found, axis=0)
    assert np.sqrt(variance) == pytest.approx(0.003, rel=0.06)
    assert lag == pytest.approx(ar1, abs=0.03)
