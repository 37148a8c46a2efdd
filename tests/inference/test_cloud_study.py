"""A study of a cloud that shows half of the object, and whose neighbours are off together: fit and comparison."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from small import TRUTH, small_measurement, write_study

from muslin.core.errors import InputError
from muslin.core.measurement import Measurement
from muslin.core.series import PointSeries
from muslin.core.study import Study
from muslin.inference.noise import Noise, SharedNoise, estimate_noise
from muslin.inference.sequential.fitting import fit
from muslin.inference.sequential.polishing import takes_of

SHARED = Noise(0.006, 0.0, "test", "m", 0.02, shared=SharedNoise(0.95, 0.06, 0.9, 1.0))


def half_seen(measurement: Measurement, study: Study, seed: int) -> Measurement:
    """Recordings as clouds of places on the object, of its one half, with the noise of depth cameras."""
    rng, out = np.random.default_rng(seed), []
    for recording in measurement.recordings:
        scenario = study.problem.scenarios[recording.name]
        corners = recording.series.points[:, scenario.body.triangles]
        middle = scenario.body.vertices[scenario.body.triangles, 0].mean(axis=1)
        chosen = rng.choice(np.flatnonzero(middle > np.median(middle)), (len(corners), 80))
        weights = rng.dirichlet(np.ones(3), chosen.shape)
        clean = np.einsum("tpk,tpka->tpa", weights, np.take_along_axis(corners, chosen[..., None, None], axis=1))
        cloud = clean + SHARED.sd * SHARED.draw(clean, rng)
        out.append(replace(recording, series=PointSeries(recording.series.time, cloud, "m", False)))
    return Measurement(tuple(out))


@pytest.mark.slow
def test_a_half_hidden_cloud_tells_what_it_can(tmp_path: Path) -> None:
    clean = small_measurement(noise=0.0)
    marked = Study.load(write_study(tmp_path / "marked", clean), workers=0)
    path = write_study(tmp_path / "cloud", half_seen(clean, marked, 0))
    study = Study.load(path, workers=0)
    study.config.scenario.markers, study.config.noise.sd = "surface", SHARED.sd
    study.config.estimator.rounds, study.config.estimator.draws = 1, 20
    study.save()
    study = Study.load(path, workers=0)
    result = fit(study)
    assert result.noise.shared is not None and "neighbours share" in result.text()
    assert result.noise.information < 0.1
    low, high = np.quantile(result.samples[:, result.names.index("stretch_stiffness")], [0.01, 0.99])
    assert low < TRUTH.stretch_stiffness < high
    assert study.compare().adequacy.p_value > 0.01
    checks = study.calibrate(predictive=10).predictive
    assert [c.recording for c in checks] == ["near", "far", "other"]
    assert all(c.p_value > 0.01 for c in checks)


def test_only_places_of_the_surface_may_be_hidden(tmp_path: Path) -> None:
    clean = small_measurement(noise=0.0)
    unordered = [replace(r, series=replace(r.series, correspondence=False)) for r in clean.recordings]
    study = Study.load(write_study(tmp_path, Measurement(tuple(unordered))), workers=0)
    assert study.problem.clouds == []
    study.config.scenario.markers = "surface"
    study.save()
    study = Study.load(study.path, workers=0)
    assert study.problem.clouds == ["near", "far", "other"]
    draws = [np.zeros((2, *r.series.points.shape[:1], 1000, 3)) for r in clean.recordings[:2]]
    seen = takes_of(study, SHARED).observe(draws, np.arange(2), 0)
    assert [s.shape[1:] for s in seen] == [r.series.points.shape for r in clean.recordings[:2]]


def test_the_noise_of_clouds_need_not_be_told(tmp_path: Path) -> None:
    clean = small_measurement(noise=0.0)
    marked = Study.load(write_study(tmp_path / "marked", clean), workers=0)
    study = Study.load(write_study(tmp_path / "cloud", half_seen(clean, marked, 0)), workers=0)
    with pytest.raises(InputError, match="unordered points"):  # named keypoints, of which no patch can be made
        estimate_noise(study.problem, None)
    study.config.scenario.markers = "surface"
    study.save()
    found = estimate_noise(Study.load(study.path, workers=0).problem, None)
    assert found.sd == pytest.approx(SHARED.sd * (1 - SHARED.shared.share) ** 0.5, rel=0.5)  # type: ignore[union-attr]
    assert "patches of the clouds scatter" in found.source and found.shared is None
