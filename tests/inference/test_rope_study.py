"""A study of a rope between two grippers, from the measurement to the page."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from muslin.core.material import RopeMaterial
from muslin.core.measurement import Measurement, Recording
from muslin.core.measurement_store import save_measurement
from muslin.core.registry import REGISTRY
from muslin.core.rollout import rollout
from muslin.core.scenarios import preset
from muslin.core.study import Study, parse_config, write_config
from muslin.core.testing.reference import ReferenceSimulator

TRUTH = RopeMaterial(stretch_stiffness=6.0, linear_density=0.1)


@pytest.mark.slow
def test_a_rope_is_fitted_and_compared_and_drawn(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(REGISTRY._objects, ("simulator", "reference"), ReferenceSimulator)
    rng = np.random.default_rng(0)
    scenario = preset("cable").scenario(vertices=[9])
    recordings = []
    for name, end in (("one", 0.8), ("two", 1.1)):
        times = np.arange(0.0, end, 1 / 30)
        series = rollout(ReferenceSimulator(), replace(scenario, times=times), TRUTH).series
        noisy = replace(series, points=series.points + rng.normal(0, 0.001, series.points.shape))
        recordings.append(Recording(name, noisy, scenario.motion))
    save_measurement(Measurement(tuple(recordings)), tmp_path / "m.zarr")
    table = {
        "study": {"measurement": "m.zarr", "hold_out": ["two"]},
        "scenario": {"name": "cable", "vertices": [9], "obstacles": [{"kind": "table", "height": 0.2}]},
        "simulator": {"name": "reference"},
        "estimator": {"name": "bayessim-rkhs", "rounds": 1, "draws": 12},
        "material": {"linear_density": 0.1},
        "parameters": {"stretch_stiffness": {"low": 3.0, "high": 100.0, "scale": "log", "unit": "N"}},
    }
    write_config(parse_config(table, "test"), tmp_path / "study.toml")
    study = Study.load(tmp_path / "study.toml", workers=0)
    study.fit()
    fitted = study.step_results("fit")["estimate"][0]  # type: ignore[index]
    assert float(fitted) == pytest.approx(6.0, rel=0.05)
    study.compare()
    held_out = next(r for r in study.step_results("compare").attrs["rows"] if r["recording"] == "two")  # type: ignore
    assert held_out["rmse"] < 1.5e-3 < held_out["default"]

    pytest.importorskip("matplotlib")
    from muslin.cli.report import write_report
    from muslin.cli.report.gather import gather
    from muslin.cli.report.verdict import thing

    found = gather(study)
    assert thing(found) == "rope"
    assert [len(line) for line in found.takes[0].outlines] == [5]  # the edge of the table
    page = write_report(study).read_text(encoding="utf-8")
    assert '"triangles":[]' in page and page.count("data:image/png") >= 2
