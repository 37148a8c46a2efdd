"""Diagnosis end to end on small studies, on both engines."""

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from small import small_measurement, write_study
from test_verdict import COUNT, candidate, evidence

from muslin.core.errors import InputError
from muslin.core.measurement import Measurement
from muslin.core.study import Study
from muslin.inference.criticism import work
from muslin.inference.criticism.before_after import BeforeAfter
from muslin.inference.criticism.diagnose import Diagnosis, _models
from muslin.inference.polish import Objective, Polished
from muslin.plugins.effects.air import AirDrag
from muslin.plugins.effects.command import ActuatorLag

pytest.importorskip("mujoco")

SCHEMA = {
    "verdict", "effects", "further", "rest", "together", "candidates", "error", "evidence", "numerics", "unrepeatable",
    "where", "told", "simulations", "budget_spent", "unfinished", "seconds", "seed",
}  # fmt: skip
CANDIDATE = {
    "name", "coefficients", "explained", "z", "behind", "objection", "held_out_before", "held_out_after",
    "held_out_shows", "identifiability", "refitted", "tried",
}  # fmt: skip
ERROR = {"noise", "noise_error", "before", "after", "unit", "held_out", "fitted_before", "fitted_after"}


def check_schema(result: dict[str, object]) -> None:
    assert set(result) == SCHEMA
    assert set(result["error"]) == ERROR  # type: ignore[call-overload]
    for c in result["candidates"]:  # type: ignore[attr-defined]
        assert set(c) == CANDIDATE
        assert all(set(v) == {"mean", "sd", "unit"} for v in c["coefficients"].values())
    json.loads(json.dumps(result, allow_nan=False))


@pytest.mark.slow
def test_air_drag_is_named_and_adding_it_brings_the_held_out_error_to_the_noise(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    told = list[Polished]()

    def past_chance(objective: Objective, best: Polished) -> Polished:
        told.append(replace(best, covariance=4.0 * best.covariance))  # as if chance had a hand in it
        return told[-1]

    monkeypatch.setattr(work, "seen_past_chance", past_chance)
    path = write_study(tmp_path, small_measurement(AirDrag(drag_coefficient=1.2)))
    study = Study.load(path)
    study.fit()
    assert not study.compare().adequate
    diagnosis: Diagnosis = study.diagnose()
    check_schema(diagnosis.result)
    assert diagnosis.result["verdict"] == "named"
    assert diagnosis.result["effects"] == ["air-drag"]
    assert next(iter(diagnosis.result["told"])) == "verdict"
    assert "where" in diagnosis.result["told"]
    assert diagnosis.result["evidence"]["beyond_noise"] and "small" not in diagnosis.result["told"]
    assert diagnosis.result["candidates"][0]["objection"] is None
    assert study.step_results("diagnose").attrs["models"][0]["effects"] == ["air-drag"]
    drag = diagnosis.result["candidates"][0]["coefficients"]["drag_coefficient"]
    assert abs(drag["mean"] - 1.2) < 4 * drag["sd"] + 0.02
    (best,) = told
    names, covariance = study.step_results("diagnose").attrs["models"][0]["parameters"], best.covariance
    known = AirDrag.coefficients[0].high * np.sqrt(covariance.diagonal())[names.index("air-drag.drag_coefficient")]
    assert known <= drag["sd"] < 1.5 * known  # what is told is what is known past chance
    monkeypatch.undo()
    assert diagnosis.result["error"]["after"] < 0.5 * diagnosis.result["error"]["before"]
    added = study.add("air-drag")
    added.fit()
    rows = {r.recording: r for r in added.compare().rows}
    assert rows["other"].role == "held-out"
    assert rows["other"].rmse < 1.15 * rows["other"].noise
    added.config.diagnose.candidates = ["hem", "viscous-damping"]
    again = added.diagnose().result  # with the effect in the model nothing more is missing
    check_schema(again)
    assert again["effects"] == [] and again["verdict"] in ("no-misfit", "cannot-tell")


@pytest.mark.slow
def test_of_many_takes_the_same_is_named(tmp_path: Path) -> None:
    """Who leads is found on some of them."""
    drag = AirDrag(drag_coefficient=1.2)
    takes = [replace(r, name=f"{r.name} {k}") for k in range(10) for r in small_measurement(drag, seed=k).recordings]
    others = [r.name for r in takes if r.name.startswith("other")]
    study = Study.load(write_study(tmp_path, Measurement(tuple(takes)), hold_out=others), workers=0)
    study.config.diagnose.candidates = ["actuator-lag", "air-drag", "gravity-tilt", "viscous-damping"]
    study.fit()
    found = study.diagnose().result
    assert (found["verdict"], found["effects"]) == ("named", ["air-drag"])
    assert all(c["tried"] for c in found["candidates"])
    (coefficient,) = (c["coefficients"]["drag_coefficient"] for c in found["candidates"] if c["name"] == "air-drag")
    assert abs(coefficient["mean"] - 1.2) < 4 * coefficient["sd"]


@pytest.mark.slow
def test_what_makes_a_users_held_out_error_larger_is_not_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As nothing that is right does so, the errors are made up."""
    monkeypatch.setattr(BeforeAfter, "error", lambda self, names: (0.003, 0.004))
    study = Study.load(write_study(tmp_path, small_measurement(AirDrag(drag_coefficient=1.2))), workers=0)
    study.config.diagnose.candidates = ["air-drag"]
    study.fit()
    result = study.diagnose().result
    assert (result["verdict"], result["effects"]) == ("none", [])
    assert result["candidates"][0]["objection"] == "held-out"
    assert result["error"]["after"] == result["error"]["before"]


@pytest.mark.slow
def test_two_effects_at_once_are_both_named(tmp_path: Path) -> None:
    hidden = (AirDrag(drag_coefficient=1.2), ActuatorLag(time_constant=0.05))
    study = Study.load(write_study(tmp_path, small_measurement(*hidden)), workers=0)
    study.config.diagnose.candidates = ["air-drag", "actuator-lag", "gravity-tilt", "hem"]
    study.fit()
    result = study.diagnose().result
    assert result["verdict"] == "named"
    assert set(result["effects"]) == {"air-drag", "actuator-lag"}
    assert result["rest"] is None
    assert result["error"]["after"] < 1.2 * result["error"]["noise"]


@pytest.mark.slow
def test_a_small_budget_still_gives_a_ranking(tmp_path: Path) -> None:
    study = Study.load(write_study(tmp_path, small_measurement(AirDrag(drag_coefficient=1.2))), workers=0)
    study.config.diagnose.simulations = 150
    study.fit()
    result = study.diagnose().result
    assert result["candidates"][0]["name"] in ("air-drag", "viscous-damping")
    assert result["simulations"] < 500
    assert result["budget_spent"]
    assert not all(c["tried"] for c in result["candidates"])
    if result["verdict"] in ("named", "tied", "none"):
        assert "Not tried, as the budget ended after" in result["told"]["untried"]


@pytest.mark.slow
def test_nothing_is_named_where_nothing_is_missing(small_study: Study) -> None:
    small_study.fit()
    result = small_study.diagnose().result
    check_schema(result)
    assert result["verdict"] in ("no-misfit", "cannot-tell")
    assert result["effects"] == []
    assert result["numerics"]["step"] > 0 and result["numerics"]["mesh"] > 0
    assert result["error"]["after"] == result["error"]["before"]


@pytest.mark.slow
def test_the_same_study_runs_on_the_other_engine_by_changing_one_word(tmp_path: Path) -> None:
    pytest.importorskip("pybullet")
    path = write_study(tmp_path, small_measurement())
    text = path.read_text()
    assert text.count('"mujoco"') == 1
    path.write_text(text.replace('"mujoco"', '"pybullet"').replace("time_step = 0.01", "time_step = 0.005"))
    study = Study.load(path, workers=0)
    study.fit()
    row = study.compare().rows[0]
    assert np.isfinite(row.rmse)
    assert row.rmse < row.baseline


def test_models_are_kept_as_vague_as_they_are_told() -> None:
    """Three times the noise is left of one of them."""
    left = [candidate("drag", COUNT), candidate("lag", 9.0 * COUNT)]
    found = SimpleNamespace(
        first=SimpleNamespace(evidence=evidence(20.0 * COUNT, *left)), effects=("drag",), rivals=(), verdict="named"
    )
    for kept, c in zip(_models(found), left, strict=True):  # type: ignore[arg-type]
        ((_, sd, _),) = c.coefficients.values()
        assert kept["covariance"][1][1] == pytest.approx(sd**2)
        prior = 12.0 * np.eye(len(c.fit.unit))  # information of the uniform prior, that no misfit takes away
        data = np.linalg.inv(c.fit.covariance) - prior
        np.testing.assert_allclose(kept["covariance"], np.linalg.inv(data * COUNT / c.rss + prior))


def test_candidates_are_the_installed_effects_that_are_not_in_yet(small_study: Study) -> None:
    from muslin.inference.criticism.candidate_names import candidate_names

    names = candidate_names(small_study)
    assert {"air-drag", "wind", "viscous-damping", "internal-damping", "gravity-tilt", "actuator-lag"} <= set(names)
    small_study.config.effects["wind"] = {}
    assert "wind" not in candidate_names(small_study)
    small_study.config.diagnose.candidates = ["wind"]
    with pytest.raises(InputError, match="no candidate"):
        candidate_names(small_study)


def test_add_writes_a_study_with_the_effect_inferred(small_study: Study) -> None:
    added = Study.load(small_study.add("air-drag").path)
    assert "air-drag.drag_coefficient" in added.problem.space.names
    with pytest.raises(InputError, match="already"):
        added.add("air-drag")
