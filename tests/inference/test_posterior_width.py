"""How wide the posterior of a fit is: as the data make it, what the model misses taken for noise, and no wider."""

from pathlib import Path

import numpy as np
import pytest
from small import TRUTH, small_measurement, write_study

from muslin.core.registry import REGISTRY
from muslin.core.store import read
from muslin.core.study import Study, read_config, write_config
from muslin.core.study.config import ParameterTable
from muslin.inference.sequential import proposals

pytest.importorskip("mujoco")


@pytest.mark.parametrize("seed", [1, 2])
def test_the_posterior_is_as_wide_as_the_data_make_it(tmp_path: Path, seed: int) -> None:
    """Of a model that is right and nearly linear as far as the posterior reaches; sixteen draws a round."""
    result = Study.load(write_study(tmp_path, small_measurement(seed=seed)), workers=0).fit()
    assert result.left < 1.2 and "times the squares" not in result.text()
    width = result.samples.std(axis=0) / result.sd
    assert np.all((width > 0.7) & (width < 1.5)), width
    assert np.all(np.abs(result.samples.mean(axis=0) - result.estimate) < 0.6 * result.sd)


def test_what_a_model_misses_makes_its_posterior_as_much_wider(tmp_path: Path) -> None:
    drag = REGISTRY.get("effect", "viscous-damping")(rate=3.0)
    study = Study.load(write_study(tmp_path, small_measurement(drag)), workers=0)
    result = study.fit()
    assert result.counted > 4.0 * result.left > 16.0
    assert "times the squares that noise leaves" in result.text() and "times, as it lasts" in result.text()
    told = np.sqrt(np.diag(read(study.results()["fit"], "estimate_covariance")))
    width = study.problem.space.to_unit(result.samples).std(axis=0) / told
    assert np.all((width > 0.5) & (width < 2.0)), width


def test_a_misfit_does_not_lead_the_posterior_astray(tmp_path: Path) -> None:
    """Counted once, and seen as it is, what this model misses takes the estimator 36 standard deviations away."""
    tilt = REGISTRY.get("effect", "gravity-tilt")(about_x=0.03, about_y=0.0)
    result = Study.load(write_study(tmp_path, small_measurement(tilt, seed=1)), workers=0).fit()
    assert result.left > 4.0
    assert np.all(np.abs(result.samples.mean(axis=0) - result.estimate) < 3.0 * result.sd)


def test_a_posterior_that_reaches_the_end_of_where_draws_came_from_is_told_so(
    small_study: Study, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(proposals, "WIDER", 1e6)  # what is drawn from ends right around the best fit
    result = small_study.fit()
    assert "another round looks there: [estimator] rounds = 3" in " ".join(result.warnings)


def test_a_parameter_that_does_nothing_is_left_as_wide_as_its_prior(tmp_path: Path) -> None:
    path = write_study(tmp_path, small_measurement())
    config = read_config(path)
    config.parameters = {"friction": ParameterTable(low=0.1, high=1.0)}
    config.material = {"stretch_stiffness": TRUTH.stretch_stiffness, "bending_rigidity": TRUTH.bending_rigidity}
    write_config(config, path)
    result = Study.load(path, workers=0).fit()
    assert result.samples.std() == pytest.approx(0.9 / 12**0.5, rel=0.3)
