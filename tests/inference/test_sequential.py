"""The sequential loop: when it ends, what takes of one motion add up to, and what is said about bounds."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from small import TRUTH, small_measurement, write_study

from muslin.core.estimator import Posterior, PosteriorEstimator
from muslin.core.measurement import Measurement, Recording
from muslin.core.parameters import Parameter, ParameterSpace
from muslin.core.registry import REGISTRY
from muslin.core.study import Study
from muslin.inference.noise import Noise
from muslin.inference.observe import Observer
from muslin.inference.posterior.mixture import MixturePosterior
from muslin.inference.residuals import Offsets
from muslin.inference.sequential.bounds import AtBound, at_bounds, bound_notes, cut_off
from muslin.inference.sequential.result import FitResult
from muslin.inference.sequential.stopping import Stopping, movement
from muslin.inference.sequential.takes import Takes


def gaussian(mean: float, sd: float) -> MixturePosterior:
    return MixturePosterior(np.ones(1), np.array([[mean, 0.0]]), np.diag([sd, sd])[None])


@pytest.mark.parametrize("shift", [0.1, 0.3, 1.0, 2.0])
def test_movement_is_in_standard_deviations(shift: float) -> None:
    moved = movement(gaussian(0.0, 0.2), gaussian(0.2 * shift, 0.2), np.random.default_rng(0))
    assert moved == pytest.approx(shift, rel=0.1, abs=0.02)


def test_a_change_of_width_alone_is_movement_and_none_is_none() -> None:
    rng = np.random.default_rng(0)
    assert movement(gaussian(0.0, 0.2), gaussian(0.0, 0.4), rng) > 0.8
    assert movement(gaussian(0.0, 0.2), gaussian(0.0, 0.2), rng) < 1e-6
    assert 4.0 < movement(gaussian(-3.0, 0.01), gaussian(3.0, 0.01), rng) <= 5.0


def test_rounds_end_after_two_small_movements_in_a_row() -> None:
    means = [0.0, 0.5, 0.51, 0.8, 0.81, 0.815]
    stopping = Stopping(0.2, 0)
    ended = [stopping.after(gaussian(m, 0.2)) for m in means]
    assert ended == [False, False, False, False, False, True]
    assert "stopped moving" in stopping.text(9)
    assert "settled" in stopping.text(6)
    never = Stopping(0.0, 0)
    assert not any(never.after(gaussian(0.0, 0.2)) for _ in range(5))


class Settled(PosteriorEstimator):
    """Knows the answer from the start."""

    name = "settled"

    def fit(
        self, theta: np.ndarray, x: list[np.ndarray], *, log_weights: np.ndarray | None = None, seed: int = 0
    ) -> None: ...

    def posterior(self, x: list[np.ndarray]) -> Posterior:
        return gaussian(0.0, 0.3)


@pytest.fixture
def settled() -> Iterator[None]:
    REGISTRY.add("estimator", "settled", Settled)
    yield
    del REGISTRY._objects["estimator", "settled"]


def test_a_fit_ends_early_says_so_and_draws_no_more(settled: None, tmp_path: Path) -> None:
    study = Study.load(write_study(tmp_path, small_measurement()), workers=0)
    study.config.estimator = study.config.estimator.model_validate({"name": "settled", "rounds": 6, "draws": 10})
    result = study.fit()
    assert result.rounds == 4  # it moves once, from the best fit's neighbourhood
    assert "stopped moving" in result.ended
    assert result.ended in result.text()
    assert (study.step_results("fit")["draws/status"][...] == 1).sum() == 40


def takes_of(measurement: Measurement, count: int, noise: float) -> Measurement:
    """The first recording taken ``count`` times, and the second once."""
    rng = np.random.default_rng(5)
    near, far = measurement.recordings[:2]
    clean = near.series.points
    repeated = [
        Recording(
            f"near{i}", replace(near.series, points=clean + rng.normal(0, noise, clean.shape)), near.gripper, "near"
        )
        for i in range(count)
    ]
    return Measurement((*repeated, far))


@pytest.mark.slow
def test_takes_of_one_motion_are_simulated_once_and_all_of_them_count(tmp_path: Path) -> None:
    measurement = takes_of(small_measurement(noise=0.0), 3, 0.001)
    study = Study.load(write_study(tmp_path, measurement, hold_out=[]), workers=0)
    study.config.estimator.rounds = 1
    result = study.fit()
    draws = study.step_results("fit")["draws"]
    assert sorted(k for k in draws if k.startswith("points_")) == ["points_far", "points_near0"]
    assert result.values()["stretch_stiffness"] == pytest.approx(TRUTH.stretch_stiffness, rel=0.1)


def together(measurement: Measurement, study: Study) -> Takes:
    observer = Observer(list(measurement.recordings), Noise(0.001, 0.0, "test", "m", 0.01), Offsets())
    return Takes(observer, study.problem.scenarios)


def test_noise_falls_with_the_root_of_the_takes_and_gaps_are_filled_by_other_takes(tmp_path: Path) -> None:
    clean = small_measurement(noise=0.0)
    measurement = takes_of(clean, 4, 0.001)
    measurement.recordings[1].series.points[3, 2] = np.nan
    for r in measurement.recordings[:4]:
        r.series.points[5, 7] = np.nan
    study = Study.load(write_study(tmp_path, measurement, hold_out=[]), workers=0)
    takes = together(measurement, study)
    assert takes.simulated == ["near0", "far"]
    assert takes.of("near2") == "near0"
    seen = takes.measured()[0]
    assert np.isfinite(seen[3, 2]).all()
    assert np.isnan(seen[5, 7]).all()
    assert np.nanstd(seen - clean.recordings[0].series.points) == pytest.approx(0.0005, rel=0.1)
    zeros = [np.zeros((70, *r.series.points.shape)) for r in (measurement.recordings[0], measurement.recordings[4])]
    flawed = takes.observe(zeros, np.arange(70), 0)
    assert np.nanstd(flawed[0]) == pytest.approx(0.0005, rel=0.02)
    assert np.nanstd(flawed[1]) == pytest.approx(0.001, rel=0.02)
    assert (np.isnan(flawed[0]) == np.isnan(seen)).all()


def test_what_no_take_measures_is_nothing_in_draws_with_and_without_flaws(tmp_path: Path) -> None:
    measurement = takes_of(small_measurement(noise=0.0), 2, 0.001)
    for r in measurement.recordings:
        r.series.points[..., 1] = np.nan
    study = Study.load(write_study(tmp_path, small_measurement(noise=0.0), hold_out=[]), workers=0)
    observer = Observer(list(measurement.recordings), Noise(0.001, 0.0, "test", "m", 0.01), Offsets())
    scenarios = {r.name: study.problem.scenarios["far" if r.name == "far" else "near"] for r in measurement.recordings}
    takes = Takes(observer, scenarios)
    draws = [np.ones((3, *m.shape)) for m in takes.measured()]
    for clean, seen in zip(takes.clean(draws), takes.observe([draws[0], draws[1]], np.arange(3), 0), strict=True):
        assert (clean[..., 1] == 0.0).all() and (seen[..., 1] == 0.0).all()
        assert (clean[..., [0, 2]] == 1.0).all() and (seen[..., [0, 2]] != 0.0).all()


def test_unordered_takes_are_one_larger_set(tmp_path: Path) -> None:
    measurement = takes_of(small_measurement(noise=0.0), 3, 0.001)
    unordered = Measurement(
        tuple(replace(r, series=replace(r.series, correspondence=False)) for r in measurement.recordings[:3])
    )
    study = Study.load(write_study(tmp_path, unordered, hold_out=[]), workers=0)
    (seen,) = together(unordered, study).measured()
    assert seen.shape[1] == 3 * measurement.recordings[0].series.points.shape[1]


def test_another_motion_is_simulated_for_itself(small_study: Study) -> None:
    problem = small_study.problem
    recordings = [problem.recordings[r] for r in problem.fit_on]
    takes = Takes(Observer(recordings, Noise(0.001, 0.0, "test", "m", 0.01), Offsets()), problem.scenarios)
    assert takes.simulated == ["near", "far"]


BOUND_CASES = [
    ("flat", lambda r, n: r.random(n), False),
    ("tilted", lambda r, n: 1.5 - np.sqrt(2.25 - 2 * r.random(n)), False),
    ("inside", lambda r, n: np.clip(r.normal(0.3, 0.1, n), 0, 1), False),
    ("two standard deviations off", lambda r, n: _cut(r.normal(0.02, 0.01, 3 * n))[:n], False),
    ("half a Gaussian", lambda r, n: np.abs(r.normal(0, 0.1, n)), True),
    ("half a narrow Gaussian", lambda r, n: np.abs(r.normal(0, 1e-3, n)), True),
    ("the tail of one", lambda r, n: r.exponential(0.05, n), True),
    ("half a standard deviation off", lambda r, n: _cut(r.normal(0.05, 0.1, 3 * n))[:n], True),
]


def _cut(draws: np.ndarray) -> np.ndarray:
    return draws[(draws > 0) & (draws < 1)]


@pytest.mark.parametrize(("name", "draw", "expected"), BOUND_CASES)
def test_a_marginal_that_is_piled_on_a_bound_is_told_from_a_flat_one(name: str, draw: Any, expected: bool) -> None:
    said = [cut_off(np.clip(draw(np.random.default_rng(seed), 2000), 0, 1)) for seed in range(20)]
    assert all(s == expected for s in said), name


def test_a_flat_marginal_is_never_called_piled() -> None:
    rng = np.random.default_rng(0)
    assert not any(cut_off(rng.random(2000)) for _ in range(2000))


def test_the_side_is_said_and_a_wider_bound() -> None:
    rng = np.random.default_rng(0)
    samples = np.stack([1 - np.abs(rng.normal(0, 0.1, 2000)), np.abs(rng.normal(0, 0.1, 2000)), rng.random(2000)], 1)
    found = at_bounds(samples, np.array([0.9, 0.1, 0.001]), np.array([0.05, 0.05, 0.28]))
    assert found == [AtBound(0, True, "posterior"), AtBound(1, False, "posterior")]
    assert at_bounds(samples[:, 2:], np.array([0.001]), np.array([0.02])) == [AtBound(0, False, "best fit")]
    space = ParameterSpace(
        (
            Parameter("stretch_stiffness", "N/m", 10.0, 1000.0, "log"),
            Parameter("air_drag.coefficient", "1", 0.0, 2.0),
            Parameter("friction", "1", 0.0, 1.0),
        )
    )
    stiff, drag = bound_notes(space, found)
    assert "upper bound of its prior, 1000 N/m" in stiff
    assert "[parameters.stretch_stiffness] high = 1e+04" in stiff
    assert "lower than zero" in drag
    assert "[effects.air_drag.coefficient] high = 4" in bound_notes(space, [AtBound(1, True, "posterior")])[0]


def result(mean: float, spread: float, estimate: float, sd: float) -> FitResult:
    draws = mean + spread * np.random.default_rng(0).standard_normal((2000, 1))
    noise = Noise(0.001, 0.0, "test", "m", 0.01)
    return FitResult(
        ("friction",), ("1",), np.array([estimate]), np.array([sd]), draws, noise, (), (), 2, "all", 10, 0, 1.0, 1e-4
    )


def test_a_posterior_that_differs_from_the_best_fit_is_explained() -> None:
    assert "friction: the posterior is wider" in result(0.5, 0.1, 0.52, 0.01).text()
    assert "friction: the best fit lies outside the posterior" in result(0.5, 0.01, 0.6, 0.01).text()
    assert "friction: the" not in result(0.5, 0.1, 0.52, 0.09).text()


def test_default_priors_over_decades_are_on_log_scales() -> None:
    from muslin.core.scenarios import PRESETS

    priors = [p for s in PRESETS.values() for kind in s.kinds for p in s.default_priors(kind)]
    assert priors
    assert all(p.scale == "log" for p in priors if p.low > 0 and p.high / p.low >= 30)
