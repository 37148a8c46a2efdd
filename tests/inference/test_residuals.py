"""Residuals and the noise: offsets are found, noise is estimated, repeats tell it."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import optimize

from muslin.core.differences import fourth_differences
from muslin.core.measurement import Recording
from muslin.core.series import PointSeries
from muslin.inference.noise import Noise
from muslin.inference.residuals import Offsets, failed, residual, rms_apart

TIME = np.arange(0, 2, 0.02)
NOISE = Noise(0.001, 0.0, "test", "m", 0.01)


def wave(shift: float = 0.0) -> np.ndarray:
    t = TIME[:, None] + shift
    phase = np.array([0.0, 0.7, 1.9])
    return np.stack([0.05 * np.sin(5 * t + phase), 0.02 * np.cos(9 * t + phase), 0.1 * t + 0 * phase], axis=-1)


def test_without_offsets_it_is_the_plain_difference_over_the_noise() -> None:
    recording = Recording("a", PointSeries(TIME, wave() + 0.002))
    r = residual(recording, PointSeries(TIME, wave()), NOISE, Offsets())
    np.testing.assert_allclose(r.difference, 0.002, atol=1e-12)
    np.testing.assert_allclose(r.white, 2.0, atol=1e-9)
    assert r.rms == pytest.approx(0.002)


def test_clock_and_constant_offsets_are_taken_out() -> None:
    recording = Recording("a", PointSeries(TIME, wave(0.013) + np.array([0.003, -0.001, 0.002])))
    r = residual(recording, PointSeries(TIME, wave()), NOISE, Offsets(clock=0.02, constant=0.01))
    assert r.clock == pytest.approx(0.013, abs=1e-3)
    assert r.rms < 0.0006


def test_a_prior_keeps_a_clock_offset_from_explaining_everything() -> None:
    recording = Recording("a", PointSeries(TIME, wave(0.2)))
    r = residual(recording, PointSeries(TIME, wave()), NOISE, Offsets(clock=0.005))
    assert abs(r.clock) <= 0.02
    assert r.rms > 0.005


def test_points_not_seen_do_not_count() -> None:
    points = wave() + 0.001
    points[10:20, 1] = np.nan
    recording = Recording("a", PointSeries(TIME, points))
    r = residual(recording, PointSeries(TIME, wave()), NOISE, Offsets())
    assert len(r.white) == points.size - 30
    assert len(failed(recording, Offsets(0.01, 0.01))) == len(r.white) + 4


def test_a_frame_that_is_far_off_counts_by_a_logarithm() -> None:
    heavy = replace(NOISE, tails=3.0)

    def counted(away: float, noise: Noise = heavy) -> float:
        points = wave()
        points[50] += away * NOISE.sd
        white = residual(Recording("a", PointSeries(TIME, points)), PointSeries(TIME, wave()), noise, Offsets()).white
        return float(white @ white) / points[50].size

    assert counted(0.0) == 0.0
    assert counted(1.0) == pytest.approx(1.0)  # what is off as noise is counts as noise does
    assert counted(0.01) == pytest.approx(0.01**2 / (9 * np.log1p(1 / 9)), rel=1e-4)
    assert counted(300.0) == pytest.approx(np.log1p(1e4) / np.log1p(1 / 9))
    assert np.all(np.diff([counted(away) for away in np.geomspace(0.1, 1000, 40)]) > 0)
    assert counted(300.0, heavy.normal) == pytest.approx(300.0**2)


def test_with_tails_one_take_that_goes_another_way_does_not_lead() -> None:
    rng = np.random.default_rng(3)
    takes = [Recording(str(k), PointSeries(TIME, wave() + NOISE.sd * rng.normal(size=wave().shape))) for k in range(5)]
    odd = replace(takes[0], series=replace(takes[0].series, points=takes[0].series.points + 50 * NOISE.sd))

    def best(noise: Noise) -> float:
        def cost(shift: float) -> float:
            moved = PointSeries(TIME, wave() + shift * NOISE.sd)
            whites = [residual(r, moved, noise, Offsets()).white for r in (odd, *takes[1:])]
            return sum(float(w @ w) for w in whites)

        return float(optimize.minimize_scalar(cost, bounds=(-5.0, 50.0), method="bounded").x)

    assert best(NOISE) == pytest.approx(10.0, abs=0.1)
    assert best(replace(NOISE, tails=3.0)) == pytest.approx(0.0, abs=0.3)


def test_without_correspondence_order_does_not_matter() -> None:
    points = wave()
    shuffled = points[:, [2, 0, 1]]
    recording = Recording("a", PointSeries(TIME, shuffled, correspondence=False))
    r = residual(recording, PointSeries(TIME, points, correspondence=False), NOISE, Offsets())
    assert r.rms < 1e-12


def test_correlated_noise_counts_less() -> None:
    recording = Recording("a", PointSeries(TIME, wave() + 0.002))
    white = residual(recording, PointSeries(TIME, wave()), NOISE, Offsets()).white
    red = residual(recording, PointSeries(TIME, wave()), replace(NOISE, ar1=0.8), Offsets()).white
    assert red @ red == pytest.approx(white @ white * 0.2 / 1.8)


@pytest.mark.parametrize("sd", [0.0005, 0.003])
def test_roughness_finds_the_noise_of_a_smooth_motion(sd: float) -> None:
    rng = np.random.default_rng(3)
    recording = Recording("a", PointSeries(TIME, wave() + rng.normal(0, sd, wave().shape)))
    d = fourth_differences(recording.series.points)
    assert 1.4826 * np.median(np.abs(d)) == pytest.approx(sd, rel=0.15)


def waving_sheet(time: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Places ``(T, P, 2)`` of a bumpy sheet that is carried along x and waves, ``(T, P, 3)`` [m]."""
    a, b = places[..., 0], places[..., 1]
    lift = 0.03 * np.sin(20 * a + 6 * time[:, None]) + 0.02 * np.cos(30 * b)
    return np.stack([a + 0.3 * np.sin(2 * time)[:, None], b, lift], axis=-1)


def test_a_cloud_finds_its_offsets_though_its_points_are_nobodys() -> None:
    time = np.arange(0, 1, 0.05)
    rng = np.random.default_rng(1)
    seen = waving_sheet(time + 0.04, rng.uniform(0, 0.2, (len(time), 150, 2)))  # other points in every frame
    away = np.array([0.012, -0.015, 0.008])
    recording = Recording("a", PointSeries(time, seen + away, correspondence=False))
    places = np.broadcast_to(rng.uniform(0, 0.2, (1, 4000, 2)), (len(time), 4000, 2))
    predicted = PointSeries(time, waving_sheet(time, places), correspondence=False)
    r = residual(recording, predicted, NOISE, Offsets(clock=0.1, constant=0.03))
    assert r.clock == pytest.approx(0.04, abs=5e-3)
    np.testing.assert_allclose(r.white[-3:] * 0.03, away, atol=1.5e-3)
    assert r.rms < 0.002 < 0.004 < residual(recording, predicted, NOISE, Offsets()).rms


def test_a_cloud_with_gaps_is_held_against_what_was_predicted() -> None:
    time = np.arange(0, 0.5, 0.05)
    places = np.random.default_rng(0).uniform(0, 0.2, (len(time), 441, 2))
    points, model = waving_sheet(time, places), waving_sheet(time, places)
    points[:, ::3] = np.nan
    model[:, 1::3] = np.nan
    points[2], model[4] = np.nan, np.nan
    recording = Recording("a", PointSeries(time, points, correspondence=False))
    r = residual(recording, PointSeries(time, model, correspondence=False), NOISE, Offsets())
    assert np.isnan(r.difference[:, ::3]).all() and np.isnan(r.difference[[2, 4]]).all()
    kept = np.delete(r.difference, [2, 4], axis=0)[:, 2::3]
    assert np.abs(kept).max() == 0.0


def test_points_are_as_far_apart_as_those_that_are_seen() -> None:
    base = np.zeros((4, 2, 3))
    moved = base + 0.003
    moved[1, 0] = np.nan
    assert rms_apart([(base, moved), (base, base - 0.003)]) == pytest.approx(0.003)
    assert rms_apart([(base, base * np.nan)]) == 0.0
    assert rms_apart([]) == 0.0
