"""The fit: right where the model is right, continues after a kill, does not depend on the workers."""

import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray
import zarr
from small import TRUTH, small_measurement, write_study

from muslin.core.arrays import FloatArray
from muslin.core.errors import InputError, MuslinError, StepMissingError, StoreError
from muslin.core.measurement import Measurement
from muslin.core.measurement_store import save_measurement
from muslin.core.registry import REGISTRY
from muslin.core.store import read
from muslin.core.study import Study, read_config, write_config
from muslin.inference.criticism import compare as comparing
from muslin.inference.polish import Objective, Polished, polish
from muslin.inference.sequential import fitting, polishing
from muslin.inference.sequential.only_one import only_one

pytest.importorskip("mujoco")


def test_a_right_model_is_fitted_within_its_uncertainty(small_study: Study) -> None:
    result = small_study.fit()
    truth = np.array([TRUTH.stretch_stiffness, TRUTH.bending_rigidity])
    assert result.names == ("stretch_stiffness", "bending_rigidity")
    assert np.all(np.abs(result.estimate - truth) < 4 * result.sd), (result.estimate, result.sd)
    assert abs(result.noise.sd - 0.001) < 0.0002
    assert result.failed == 0
    comparison = small_study.compare()
    assert comparison.adequate, comparison.text()
    assert all(row.rmse < row.baseline for row in comparison.rows)


@pytest.mark.parametrize("rested", [True, False])
def test_a_search_that_ends_in_a_wrong_place_is_not_the_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, rested: bool
) -> None:
    """One that believes to rest is helped by what all draws tell, one that knows better goes on."""
    real, calls = polishing.polish_from, []

    def stuck(objective: Objective, starts: FloatArray, best: Polished | None = None) -> Polished:
        calls.append(best)
        if best is not None and rested:
            return real(objective, starts, best)
        return best or replace(polish(objective, np.array([0.95, 0.05]), 0), rested=rested)

    monkeypatch.setattr(polishing, "polish_from", stuck)
    result = Study.load(write_study(tmp_path, small_measurement()), workers=0).fit()
    assert result.left < 1.2
    assert result.values()["stretch_stiffness"] == pytest.approx(TRUTH.stretch_stiffness, rel=0.05)
    assert (calls[-1] is not None) == rested


def test_with_tails_what_goes_another_way_does_not_lead_the_fit(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    held_against = list[float | None]()
    told = comparing.set_view
    monkeypatch.setattr(
        comparing, "set_view", lambda held, noise, rng: (held_against.append(noise.tails), told(held, noise, rng))[1]
    )
    near, far, other = small_measurement().recordings
    points = far.series.points.copy()
    points[-8:, 5:] += 0.08 * np.sin(np.arange(11.0))[:, None]  # from then on it is off, each point its own way
    measurement = Measurement((near, replace(far, series=replace(far.series, points=points)), other))
    truth = np.array([TRUTH.stretch_stiffness, TRUTH.bending_rigidity])
    off = {}
    for tails in (None, 3.0):
        path = write_study(tmp_path / str(tails), measurement)
        config = read_config(path)
        config.noise.sd, config.noise.tails = 0.001, tails
        write_config(config, path)
        study = Study.load(path, workers=0)
        off[tails] = np.abs(np.log(study.fit().estimate / truth))
        assert not study.compare().adequate
    assert set(held_against) == {None}  # it compares by squares, whatever the fit goes by
    assert np.all(off[3.0] < 0.1) and np.all(off[3.0] < off[None] / 3), off


def test_a_fit_tells_what_is_known_past_chance(small_study: Study, monkeypatch: pytest.MonkeyPatch) -> None:
    told = list[Polished]()

    def past_chance(objective: Objective, best: Polished) -> Polished:
        # as if chance had a hand in it, and three times the noise were left
        told.append(replace(best, covariance=4.0 * best.covariance, count=best.rss / 9.0))
        return told[-1]

    monkeypatch.setattr(polishing, "seen_past_chance", past_chance)
    sd = small_study.fit().sd
    kept = read(small_study.step_results("fit"), "estimate_covariance")
    prior = 12.0 * np.eye(len(sd))
    data = np.linalg.inv(told[-1].covariance) - prior
    np.testing.assert_allclose(kept, np.linalg.inv(data / 9.0 + prior))
    np.testing.assert_allclose(sd, fitting.physical_sd(small_study.problem.space, told[-1].unit, kept))


def test_pieces_of_a_recording_count_as_one_simulation(
    small_study: Study, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    problem = small_study.problem
    halves = replace(problem, cut_from={f"{n} {k}": n for n in ("near", "far") for k in "ab"})
    assert (problem.told_as(10), halves.told_as(10)) == (10, 5)
    plain = small_study.fit().simulations
    monkeypatch.setattr(type(problem), "told_as", lambda self, rollouts: round(rollouts / 2))
    again = Study.load(write_study(tmp_path / "again", small_measurement()), workers=0)
    assert again.fit().simulations == pytest.approx(plain / 2, abs=1)


def test_a_finished_fit_is_returned_and_not_run_again(small_study: Study) -> None:
    first = small_study.fit()
    began = time.monotonic()
    again = Study.load(small_study.path, workers=0).fit()
    assert time.monotonic() - began < 1.0
    np.testing.assert_array_equal(first.samples, again.samples)


def test_one_and_two_workers_give_the_same_posterior(tmp_path: Path) -> None:
    measurement = small_measurement()
    results = []
    for workers in (1, 2):
        path = write_study(tmp_path / str(workers), measurement)
        results.append(Study.load(path, workers=workers).fit())
    np.testing.assert_array_equal(results[0].samples, results[1].samples)
    np.testing.assert_array_equal(results[0].estimate, results[1].estimate)


def test_another_seed_gives_other_draws(tmp_path: Path) -> None:
    measurement = small_measurement()
    samples = [
        Study.load(write_study(tmp_path / str(seed), measurement, seed=seed), workers=0).fit().samples
        for seed in (0, 1)
    ]
    assert not np.array_equal(samples[0], samples[1])


@pytest.mark.slow
@pytest.mark.parametrize("after", [3, 20])
def test_a_killed_fit_goes_on_with_the_same_result(tmp_path: Path, after: int) -> None:
    """kill -9 in the first and in the second round; the draws that were there are not simulated again."""
    measurement = small_measurement()
    whole = Study.load(write_study(tmp_path / "whole", measurement), workers=0).fit()
    path = write_study(tmp_path / "killed", measurement)
    errors, passing = tmp_path / "errors", tmp_path / "passing"
    passing.mkdir()
    with errors.open("w") as told:
        process = subprocess.Popen(
            [sys.executable, "-m", "muslin.cli", "fit", str(path), "--workers", "1"],
            stdout=subprocess.DEVNULL,
            stderr=told,
            cwd=tmp_path,
            env={**os.environ, "TMPDIR": str(passing)},
        )
    status = path.parent / "study.results.zarr/fit/draws/status/c"
    deadline = time.monotonic() + 120
    while len(list(status.glob("*"))) < after:
        assert process.poll() is None, "the fit ended before it could be killed"
        assert time.monotonic() < deadline
        time.sleep(0.005)
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    done = {f.name: f.stat().st_mtime_ns for f in status.glob("*") if f.name.isdigit()}
    with pytest.raises(StepMissingError):
        Study.load(path).step_results("fit")
    continued = Study.load(path, workers=0).fit()
    np.testing.assert_array_equal(continued.samples, whole.samples)
    np.testing.assert_array_equal(continued.estimate, whole.estimate)
    assert len(done) >= after
    for name, when in done.items():
        assert (status / name).stat().st_mtime_ns == when, f"draw {name} was simulated again"
    assert "Traceback" not in errors.read_text(), "workers end quietly"
    while left := list(passing.glob("*.problem")):
        assert time.monotonic() < deadline, f"nobody took {left} away"
        time.sleep(0.1)


def test_results_open_in_xarray_with_units(small_study: Study) -> None:
    small_study.fit()
    draws = xarray.open_zarr(small_study.results_path, group="fit/draws", consolidated=False)
    assert draws["points_near"].dims == ("draw", "time_near", "point", "axis")
    assert draws["points_near"].attrs["units"] == "m"
    assert np.isfinite(draws["points_near"].values).all()
    samples = xarray.open_zarr(small_study.results_path, group="fit", consolidated=False)["posterior_samples"]
    assert samples.shape == (2000, 2)


def test_a_changed_study_is_fitted_anew(small_study: Study) -> None:
    small_study.fit()
    before = read(small_study.step_results("fit"), "estimate")
    changed = Study.load(small_study.path, workers=0)
    changed.config.material["areal_density"] = 0.3
    after = changed.fit()
    assert not np.allclose(before, after.estimate, rtol=1e-3)
    old = small_study.path.with_name("study.results.old1.zarr")
    np.testing.assert_array_equal(zarr.open_group(old / "fit", mode="r")["estimate"][...], before)


def test_a_changed_measurement_is_fitted_anew(small_study: Study) -> None:
    small_study.fit()
    before = read(small_study.step_results("fit"), "estimate")
    save_measurement(small_measurement(seed=5), small_study.measurement_path, overwrite=True)
    after = Study.load(small_study.path, workers=0).fit()
    assert not np.array_equal(before, after.estimate)


def test_steps_say_what_is_missing(small_study: Study) -> None:
    with pytest.raises(StepMissingError, match="muslin fit"):
        small_study.compare()


def test_results_of_an_earlier_state_of_the_study_are_not_used(small_study: Study) -> None:
    small_study.fit()
    small_study.compare()
    changed = Study.load(small_study.path, workers=0)
    changed.config.study.hold_out = []
    changed.config.study.fit_on = ["near", "far"]
    changed.step_results("fit")  # does not depend on what is held out
    with pytest.raises(StepMissingError, match="changed since 'compare'"):
        changed.step_results("compare")
    changed.config.material["areal_density"] = 0.3
    with pytest.raises(StepMissingError, match="muslin fit"):
        Study(changed.config, changed.path, workers=0).compare()


def test_a_wrong_estimator_option_is_said_before_anything_is_simulated(
    small_study: Study, monkeypatch: pytest.MonkeyPatch
) -> None:
    config = small_study.config.model_copy(deep=True)
    config.estimator = config.estimator.model_validate({"name": "bayessim-rkhs", "no_such_option": 1})
    with pytest.raises(InputError, match="no_such_option"):
        Study(config, small_study.path, workers=0).fit()
    monkeypatch.setitem(REGISTRY._objects, ("estimator", "own"), lambda *, width=3, correspondence=True: None)
    config.estimator = config.estimator.model_validate({"name": "own", "widht": 1})
    with pytest.raises(InputError, match=r"'own' has no option 'widht'\. Did you mean 'width'\? Options: width, corr"):
        Study(config, small_study.path, workers=0).fit()
    assert not small_study.results_path.exists()


@pytest.mark.parametrize("what", ["fit/zarr.json", "fit/estimate/c/0", "fit/posterior_samples/zarr.json"])
def test_a_damaged_store_is_one_clear_error(small_study: Study, what: str) -> None:
    small_study.fit()
    (small_study.results_path / what).write_bytes(b"not what was written")
    with pytest.raises(StoreError, match="damaged"):
        Study.load(small_study.path, workers=0).compare()


@pytest.mark.slow
def test_two_fits_of_one_study_do_not_mix(small_study: Study) -> None:
    with only_one(small_study.results_path), pytest.raises(MuslinError, match="another fit"):
        small_study.fit()
    assert small_study.fit().failed == 0
