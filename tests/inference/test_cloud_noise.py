"""Neighbours of a cloud that are off together are told from each being off by itself, and count as the few they are."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from muslin.core.arrays import FloatArray
from muslin.core.measurement import Recording
from muslin.core.series import PointSeries
from muslin.inference.cloud_noise import Cloud, cloud_noise
from muslin.inference.criticism.comparing.replicates import NoiseDraws
from muslin.inference.noise import Noise, SharedNoise
from muslin.inference.noise_draws import smooth_noise
from muslin.inference.observe import Observer
from muslin.inference.patches import patch_noise
from muslin.inference.residuals import Offsets, nearest

SD = 0.01
TOLD = Noise(SD, 0.0, "given in the study", "m", 0.02)
TIME = np.arange(16) * 0.1


def sheet(places: FloatArray, height: float = 0.03) -> FloatArray:
    """``(T, P, 3)`` [m] of places ``(T, P, 2)`` on a bumpy sheet that waves."""
    a, b = places[..., 0], places[..., 1]
    lift = height * np.sin(15 * a + 3 * TIME[:, None]) + 0.02 * np.cos(20 * b)
    return np.stack([a, b, lift], axis=-1)


def seen(noise: Noise, seed: int, count: int = 500) -> Cloud:
    """A cloud of other points in every frame, gaps among them, held against the sheet that it is of."""
    rng = np.random.default_rng(seed)
    true = sheet(rng.uniform(0, 0.3, (len(TIME), count, 2)))
    points = true + noise.sd * noise.draw(true, rng)
    points[rng.random(points.shape[:2]) < 0.1] = np.nan
    side = np.linspace(0, 0.3, 45)
    lattice = np.stack(np.meshgrid(side, side), axis=-1).reshape(1, -1, 2)
    return Cloud(points, points - nearest(points, sheet(np.repeat(lattice, len(TIME), axis=0)))[0])


def shared(share: float, reach: float, ar1: float) -> Noise:
    return Noise(SD, 0.0, "test", "m", 0.02, shared=SharedNoise(share, reach, ar1, 1.0))


@pytest.mark.parametrize(("share", "reach", "ar1"), [(0.9, 0.05, 0.95), (0.9, 0.03, 0.7), (0.6, 0.05, 0.9)])
def test_what_neighbours_share_is_found(share: float, reach: float, ar1: float) -> None:
    found = cloud_noise(TOLD, [seen(shared(share, reach, ar1), k) for k in range(3)])
    assert found.shared is not None and found.sd == SD
    # where patches are as wide as the reach, a part of what they share passes for their own
    assert share - (0.2 if reach < 0.05 else 0.1) < found.shared.share < min(share + 0.1, 1.0)
    assert found.shared.reach == pytest.approx(reach, rel=0.35)
    assert found.shared.ar1 == pytest.approx(ar1, abs=0.15)


@pytest.mark.parametrize("sd", [0.001, 0.003, 0.01])
@pytest.mark.parametrize("misfit", [0.0, 0.01, 0.05])
def test_points_that_are_off_by_themselves_stay_so_whatever_the_model_misses(misfit: float, sd: float) -> None:
    white = replace(TOLD, sd=sd)
    wave, clouds = np.array([0.0, 0.0, misfit]), [seen(white, k) for k in range(2)]
    off = [Cloud(c.points, c.off + wave * np.sin(8 * c.points[..., :1])) for c in clouds]
    assert cloud_noise(white, off) is white


def test_noise_that_is_told_too_large_is_not_shared() -> None:
    assert cloud_noise(TOLD, [seen(replace(TOLD, sd=0.6 * SD), k) for k in range(2)]) is TOLD


def test_a_few_points_say_nothing_of_their_neighbours() -> None:
    assert cloud_noise(TOLD, [seen(shared(0.9, 0.05, 0.9), 0, 5)]) is TOLD
    sparse = [seen(shared(0.9, 0.05, 0.9), k, 20) for k in range(80)]  # pairs enough, but no patch
    assert cloud_noise(TOLD, sparse) is TOLD
    flat = [Cloud(c.points[..., :2], c.off[..., :2]) for c in (seen(shared(0.9, 0.05, 0.9), k) for k in range(2))]
    assert cloud_noise(TOLD, flat) is TOLD  # in a picture
    nothing = seen(TOLD, 0)
    gone = np.full_like(nothing.points, np.nan)
    assert cloud_noise(TOLD, [Cloud(gone, gone)]) is TOLD


def test_a_parameter_is_told_as_well_as_is_said() -> None:
    """The sheet's height, by least squares from clouds whose neighbours are off together."""
    noise = shared(0.9, 0.05, 0.95)
    found = cloud_noise(TOLD, [seen(noise, k) for k in range(3)])
    rng, errors = np.random.default_rng(9), []
    for _ in range(60):
        places = rng.uniform(0, 0.3, (len(TIME), 300, 2))
        slope = (sheet(places, 1.0) - sheet(places, 0.0))[..., 2]
        off = noise.sd * noise.draw(sheet(places), rng)[..., 2]
        said = found.sd / np.sqrt(found.information * 500 / 300 * np.sum(slope**2))
        errors.append(np.sum(slope * off) / np.sum(slope**2) / said)
    assert 0.4 < np.sqrt(np.mean(np.square(errors))) < 1.6
    assert np.sqrt(found.information) < 0.05  # as if each were off by itself it would be twenty times too sure


@settings(max_examples=20)
@given(st.floats(0.02, 0.2), st.floats(0.0, 0.95))
def test_a_smooth_field_has_the_reach_and_the_colour_that_it_is_asked_for(reach: float, ar1: float) -> None:
    rng = np.random.default_rng(3)
    places = np.zeros((4, 2, 3))
    places[:, 1, 0] = reach
    made = np.stack([smooth_noise(places, reach, ar1, rng) for _ in range(1500)])
    assert np.mean(made**2) == pytest.approx(1.0, abs=0.06)
    assert np.mean(made[:, :, 0] * made[:, :, 1]) == pytest.approx(np.exp(-0.5), abs=0.08)
    assert np.mean(made[:, 1:] * made[:, :-1]) == pytest.approx(ar1, abs=0.08)


def test_replicates_share_what_the_measurement_shares() -> None:
    noise, rng = shared(0.8, 0.1, 0.9), np.random.default_rng(4)
    places = np.zeros((5, 3, 3))
    places[:, 1, 0] = 0.02
    places[2, 2] = np.nan
    made = NoiseDraws(noise, 800, rng).at(places, rng)
    assert made.shape == (800, 5, 3, 3) and np.std(made[:, :, 0]) == pytest.approx(1.0, abs=0.05)
    assert np.mean(made[:, :, 0] * made[:, :, 1]) == pytest.approx(0.8 * np.exp(-0.02), abs=0.06)


def test_noise_comes_back_as_it_was_kept() -> None:
    for noise in (TOLD, shared(0.9, 0.05, 0.95)):
        assert Noise.from_dict(noise.as_dict()) == noise
    assert Noise.from_dict({k: v for k, v in TOLD.as_dict().items() if k != "shared"}) == TOLD


def test_of_a_draw_only_what_the_measurement_shows_is_seen() -> None:
    """Half of the sheet is hidden: draws are seen as they would be, and the true one like the measurement."""
    side = np.linspace(0, 0.3, 40)
    lattice = np.repeat(np.stack(np.meshgrid(side, side), axis=-1).reshape(1, -1, 2), len(TIME), axis=0)
    true, lower = sheet(lattice), sheet(lattice, 0.0)
    points = np.where(true[..., :1] < 0.15, true, np.nan)[:, ::2]
    recording = Recording("half", PointSeries(TIME, points, "m", False))
    silent = Noise(1e-9, 0.0, "test", "m", 0.02)
    partly = Observer([recording], silent, Offsets(), ["half"])
    (same, other) = partly.observe([np.stack([true, lower])], np.arange(2), 0)[0]
    np.testing.assert_allclose(same, points, atol=1e-7)
    assert np.nanmax(other[..., 0]) < 0.2
    (whole,) = Observer([recording], silent, Offsets()).observe([true[None]], np.arange(1), 0)[0]
    assert whole.shape == true.shape and np.nanmax(whole[..., 0]) == pytest.approx(0.3, abs=1e-6)


def test_noise_may_be_stronger_than_it_is_taken_for() -> None:
    recording = Recording("r", PointSeries(TIME, np.zeros((len(TIME), 40, 3))))
    observer = Observer([recording], TOLD, Offsets())
    weak, strong = observer.observe([np.zeros((2, len(TIME), 40, 3))], np.arange(2), 0, np.array([0.5, 2.0]))[0]
    assert weak.std() == pytest.approx(0.5 * SD, rel=0.05) and strong.std() == pytest.approx(2.0 * SD, rel=0.05)


@pytest.mark.parametrize("sd", [0.003, 0.01])
def test_white_noise_of_clouds_is_told_by_how_patches_scatter(sd: float) -> None:
    clouds = [seen(replace(TOLD, sd=sd), k).points for k in range(2)]
    assert patch_noise(clouds) == pytest.approx(sd, rel=0.1)
    assert patch_noise([clouds[0][:, :15]]) == 0.0
    flat = np.zeros((3, 40, 3))
    flat[..., :2] = np.random.default_rng(0).random((3, 40, 2))
    assert patch_noise([flat]) < 1e-9
