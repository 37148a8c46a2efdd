"""What is off in a recording's clock and place is put onto every prediction that is kept beside it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import zarr
from next_world import LIFT, LinearDrag, register, rope_study

from muslin.core.arrays import FloatArray
from muslin.core.interpolation import interpolate
from muslin.core.store import read
from muslin.core.study import Study

LATE, AWAY = 0.05, np.array([0.02, -0.01, 0.03])


def moved_study(folder: Path) -> Study:
    """A rope slowed by a drag that the model lacks, seen late and aside."""
    study = rope_study(folder, LinearDrag(rate=1.0), noise=0.001, motion=LIFT)
    study.config.nuisance.clock_offset, study.config.nuisance.constant_offset = 0.1, 0.05
    (recording,) = study.problem.recordings.values()
    series = recording.series
    seen = interpolate(series.time + LATE, series.time, series.points) + AWAY
    moved = replace(recording, series=replace(series, points=seen))
    study.__dict__["problem"] = replace(study.problem, recordings={recording.name: moved})
    study.results("r+")["fit"].attrs["fingerprint"] = study.fingerprint("fit")
    return study


def by_time(difference: FloatArray) -> FloatArray:
    return np.asarray(np.sqrt(np.mean(difference**2, axis=(1, 2))))


def test_what_is_kept_of_a_comparison_and_a_diagnosis_lies_where_the_recording_shows_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    register(monkeypatch)
    study = moved_study(tmp_path)
    study.compare()
    study.diagnose()
    compared, diagnosed = (study.results()[step]["slow"] for step in ("compare", "diagnose"))
    assert isinstance(compared, zarr.Group) and isinstance(diagnosed, zarr.Group)
    measured, predicted = read(compared, "measured"), read(compared, "predicted")
    np.testing.assert_allclose(measured - predicted, read(compared, "difference"), atol=1e-12)
    np.testing.assert_allclose(read(compared, "vertices"), predicted, atol=1e-12)  # a marker on each
    for draw in read(compared, "draws"):  # of a posterior that is one point
        np.testing.assert_allclose(draw, predicted, atol=1e-6)
    for when in ("before", "after"):
        apart = by_time(measured - read(diagnosed, f"predicted_{when}"))
        np.testing.assert_allclose(apart, read(diagnosed, f"error_{when}"), atol=1e-12)
        np.testing.assert_allclose(
            read(diagnosed, f"vertices_{when}"), read(diagnosed, f"predicted_{when}"), atol=1e-12
        )
    assert by_time(measured - read(diagnosed, "predicted_after")).max() < 0.006
