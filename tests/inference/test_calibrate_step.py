"""The step ``calibrate`` on a small study, from fit to store."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from small import small_measurement, write_study

from muslin.core.errors import InputError, StepMissingError
from muslin.core.estimator import Posterior
from muslin.core.registry import REGISTRY
from muslin.core.store import read
from muslin.core.study import Study

pytest.importorskip("torch")
pytest.importorskip("mujoco")

from muslin.inference.calibration.calibrate import calibrate
from muslin.inference.estimators.bayessim_rkhs import BayesSimRKHS


def test_a_study_without_a_fit_and_too_few_simulations_are_refused(small_study: Study) -> None:
    with pytest.raises(StepMissingError, match="muslin fit"):
        calibrate(small_study)
    with pytest.raises(InputError, match="at least 20"):
        calibrate(small_study, simulations=5)
    with pytest.raises(InputError, match="at least 20 and 10"):
        calibrate(small_study, predictive=3)
    small_study.config.estimator.proposal = "gaussian"
    with pytest.raises(InputError, match="gaussian"):
        calibrate(small_study, simulations=50)


@pytest.mark.slow
def test_a_fit_is_calibrated_from_its_own_draws_and_from_fresh_ones(small_study: Study) -> None:
    small_study.config.estimator.draws = 40
    result = small_study.fit()
    before = read(small_study.step_results("fit"), "posterior_samples")
    own = calibrate(small_study, predictive=20)
    draws = read(small_study.step_results("fit"), "draws/theta")
    # draws of the second round do not follow the prior: what they weighed in the training is known
    assert "weighted by the density that they stand for" in own.cases
    assert own.ranks.parameter.shape[1] == 2 and 20 <= len(own.ranks.weights) <= len(draws)
    assert own.verdict.word in ("calibrated", "over-confident", "under-confident", "biased", "misshapen")
    # the truth is in the posterior of a right model, and no recording looks strange
    assert {p.recording: p.role for p in own.predictive} == {"near": "fit", "far": "fit", "other": "held-out"}
    assert all(p.finding != "unlike" for p in own.predictive), own.text()
    stored = small_study.step_results("calibrate")
    np.testing.assert_array_equal(read(stored, "rank"), own.ranks.parameter)
    assert stored.attrs["text"] == own.text()
    again = calibrate(small_study, predictive=0)
    np.testing.assert_array_equal(again.ranks.parameter, own.ranks.parameter)
    fresh = calibrate(small_study, simulations=24, predictive=0)
    assert len(fresh.ranks.weights) == 24 and "fresh draws" in fresh.text() and not fresh.predictive
    assert fresh.simulations == 24 * 2
    np.testing.assert_array_equal(read(small_study.step_results("fit"), "posterior_samples"), before)
    assert result.rounds == 2


@pytest.mark.slow
def test_the_estimator_sees_what_it_saw_in_the_fit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a model that misses much, so that draws are given more noise than the measurement has."""
    drag = REGISTRY.get("effect", "viscous-damping")(rate=3.0)
    study = Study.load(write_study(tmp_path, small_measurement(drag)), workers=0)
    trained: list[np.ndarray] = []
    asked: list[np.ndarray] = []

    class Watched(BayesSimRKHS):
        def fit(self, theta: np.ndarray, x: list[np.ndarray], **options: Any) -> None:
            trained.append(np.concatenate([a.reshape(len(a), -1) for a in x], axis=1))
            super().fit(theta, x, **options)

        def posterior(self, x: list[np.ndarray]) -> Posterior:
            asked.append(np.concatenate([a.ravel() for a in x]))
            return super().posterior(x)

    monkeypatch.setitem(REGISTRY._objects, ("estimator", "bayessim-rkhs"), Watched)
    study.fit()
    all_draws = [x for x in trained if len(x) == max(map(len, trained))]
    trained.clear(), asked.clear()
    calibrate(study, simulations=24, predictive=0)
    np.testing.assert_array_equal(trained[-1], all_draws[-1])
    assert len(asked) == 24
    centre = trained[-1].mean(axis=0)
    directions = np.linalg.svd(trained[-1] - centre, full_matrices=False)[2]
    for x in asked:  # fresh draws lie in what those of the fit span
        off = x - centre
        assert np.linalg.norm(off - directions.T @ (directions @ off)) < 1e-6 * np.linalg.norm(off) + 1e-9


@pytest.mark.slow
def test_results_of_another_engine_are_left_where_they_are(small_study: Study, monkeypatch: pytest.MonkeyPatch) -> None:
    small_study.fit()
    small_study.results("r+")["fit"].attrs["engine"] = "an engine of long ago"
    with pytest.raises(StepMissingError, match="an engine of long ago"):
        calibrate(small_study)
    assert small_study.results_path.exists()
