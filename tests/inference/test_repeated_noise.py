"""Two takes of one motion tell the noise, and two that only share its name do not."""

from types import SimpleNamespace

import numpy as np
import pytest

from muslin.core.arrays import FloatArray
from muslin.core.measurement import Recording
from muslin.core.motion import Motion
from muslin.core.series import PointSeries
from muslin.inference.noise import estimate_noise
from muslin.inference.repeated_noise import noise_of_repeats


@pytest.mark.parametrize("rate", [30.0, 100.0])
@pytest.mark.parametrize("offset", [0.0, 0.4, 1.0])
@pytest.mark.parametrize("moving", [False, True])
def test_white_noise_of_repeats_is_found_whatever_the_clock_offset(rate: float, offset: float, moving: bool) -> None:
    """The offset is in frames; interpolation between frames must not pass for less noise."""
    rng, sd = np.random.default_rng(5), 0.003
    time = np.arange(0, 3, 1 / rate)

    def take(name: str, shift: float) -> Recording:
        t = time[:, None] + shift
        phase = np.linspace(0, 2, 8)
        clean = np.stack([np.sin(5 * t + phase), np.cos(4 * t + phase), 0 * t + phase], axis=-1) * 0.05 * moving
        return Recording(name, PointSeries(time, clean + rng.normal(0, sd, clean.shape)), motion="same")

    found = noise_of_repeats(take("a", 0.0), take("b", offset / rate))
    assert found is not None
    assert np.sqrt(found.variance) == pytest.approx(sd, rel=0.04)
    assert abs(found.ar1) < 0.06


def test_correlated_noise_of_repeats_is_found() -> None:
    rng, time = np.random.default_rng(6), np.arange(0, 20, 0.01)

    def take(name: str) -> Recording:
        x = np.zeros((len(time), 6, 3))
        for t in range(1, len(x)):
            x[t] = 0.7 * x[t - 1] + 0.001 * rng.normal(size=(6, 3))
        return Recording(name, PointSeries(time, x), motion="same")

    found = noise_of_repeats(take("a"), take("b"))
    assert found is not None
    assert found.ar1 == pytest.approx(0.7, abs=0.08)


def test_repeats_that_are_too_short_tell_nothing() -> None:
    time = np.arange(0, 0.09, 0.01)
    a, b = (Recording(n, PointSeries(time, np.ones((9, 2, 3))), motion="same") for n in "ab")
    assert noise_of_repeats(a, b) is None


TIME = np.arange(0, 3, 0.02)


def carried(name: str, gripper: FloatArray, turn: FloatArray, rng: np.random.Generator, told: float) -> Recording:
    """Markers 3 mm of noise below a gripper at ``(T, 3)`` that turns by so much about y; its pose has noise, too."""
    below = 0.1 * np.arange(1, 6)
    swung = np.stack([np.sin(turn), 0 * turn, -np.cos(turn)], axis=1)
    points = gripper[:, None] + below[:, None] * swung[:, None]
    turns = np.stack([np.cos(turn / 2), 0 * turn, -np.sin(turn / 2), 0 * turn], axis=1)
    poses = np.concatenate([gripper + rng.normal(0, told, gripper.shape), turns], axis=1)[:, None]
    points = points + rng.normal(0, 0.003, points.shape)
    return Recording(name, PointSeries(TIME, points), Motion(TIME, poses), motion="swing")


def path(size: float) -> FloatArray:
    return np.stack([size * np.sin(5 * TIME), 0 * TIME, 1 + 0 * TIME], axis=1)


@pytest.mark.parametrize("told", [0.0, 0.0005, 0.002])
@pytest.mark.parametrize(("size", "turned", "alike"), [(0.1, 0.3, True), (0.13, 0.3, False), (0.1, 0.4, False)])
def test_takes_of_one_name_are_repeats_if_grippers_moved_alike(
    told: float, size: float, turned: float, alike: bool
) -> None:
    rng = np.random.default_rng(8)
    turn = np.sin(4 * TIME)
    one = carried("a", path(0.1), 0.3 * turn, rng, told)
    found = noise_of_repeats(one, carried("b", path(size), turned * turn, rng, told))
    assert found is not None and found.moved_alike == alike
    assert (np.sqrt(found.variance) == pytest.approx(0.003, rel=0.05)) == alike


def test_a_study_takes_takes_that_only_share_a_name_for_no_repeats() -> None:
    """Their roughness tells the noise then, and the fit says why; a third take that is a repeat is one."""
    rng, turn = np.random.default_rng(9), 0.3 * np.sin(4 * TIME)
    one, other, again = (carried(n, path(s), turn, rng, 0.0) for n, s in (("a", 0.1), ("b", 0.13), ("c", 0.1)))
    for takes, said in (([one, other], "a and b are of one motion by their names"), ([one, other, again], "2 takes")):
        problem = SimpleNamespace(recordings={r.name: r for r in takes}, clouds=[])
        noise = estimate_noise(problem, None)  # type: ignore[arg-type]
        assert said in noise.source
        assert noise.sd == pytest.approx(0.003, rel=0.1)
