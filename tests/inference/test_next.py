"""The next experiment, on a rope that is simulated in milliseconds: what is proposed separates what was tied."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("scipy")
pytest.importorskip("torch")

from next_world import (
    LIFT,
    NOISE,
    STIFFNESS,
    Fragile,
    LinearDrag,
    cut_in_half,
    put_diagnosis,
    register,
    rope_study,
)

from muslin.cli.report.figures_motion import motion_figure
from muslin.core.errors import InputError, StepMissingError
from muslin.core.registry import REGISTRY
from muslin.core.store import read
from muslin.core.study import Study
from muslin.inference.criticism.next import opening
from muslin.inference.criticism.next.rivals import knowing
from muslin.inference.criticism.next.step import NextExperiment, propose_next
from muslin.inference.criticism.next.words import explain
from muslin.inference.sequential.result import load_fit

FEW = 60


@pytest.fixture(autouse=True)
def world(monkeypatch: pytest.MonkeyPatch) -> None:
    register(monkeypatch)


def kept(study: Study, effect: str, value: float, span: float, rss: float = 300.0) -> dict[str, object]:
    """A model as the diagnosis keeps it."""
    unit = [*study.problem.space.to_unit(np.array([STIFFNESS])).tolist(), value / span]
    name = {"linear-drag": "rate", "twin-drag": "rate", "quadratic-drag": "factor"}[effect]
    values = {"stretch_stiffness": STIFFNESS, f"{effect}.{name}": value}
    return {"effects": [effect], "values": values, "unit": unit, "covariance": [[4e-4, 0], [0, 1e-3]], "rss": rss}


def tied_drags(study: Study, lead: float = 0.0) -> None:
    models = [kept(study, "linear-drag", 1.0, 5.0), kept(study, "quadratic-drag", 6.0, 20.0, 300.0 + lead)]
    put_diagnosis(study, "tied", ["linear-drag", "quadratic-drag"], models=models)


def propose(study: Study, **options: object) -> NextExperiment:
    return propose_next(study, **{"simulations": FEW, **options})  # type: ignore[arg-type]


def test_tied_drags_are_told_apart_by_a_motion_within_the_limits(tmp_path: Path) -> None:
    study = rope_study(tmp_path, LinearDrag(rate=1.0))
    tied_drags(study)
    found = propose(study, max_speed=1.0, max_acceleration=10.0, workspace=(-0.2, 0.2) * 3, duration=1.2)
    result = found.to_json()
    assert result["purpose"] == "tied" and result["effects"] == ["linear-drag", "quadratic-drag"]
    assert result["tells"] and result["probability"] > 0.9 > 0.5 > result["repeat"]["probability"]
    assert found.motion is not None
    assert result["motion"]["peak_speed"] <= 1.0 and result["motion"]["peak_acceleration"] <= 10.0
    assert FEW * 0.6 < result["simulations"] < FEW * 1.3
    text = found.text()
    assert text.startswith("Tied now: linear-drag, quadratic-drag.") and "would be named with probability" in text
    group = study.step_results("next")
    np.testing.assert_array_equal(read(group, "gripper_pose"), found.motion.poses)  # type: ignore[arg-type]
    assert group.attrs["result"]["probability"] == result["probability"]  # type: ignore[index,call-overload]
    picture = motion_figure(group, 0.001)
    assert picture is not None and "quadratic drag" in picture and "beside those of linear drag; grey: noise" in picture


def test_nothing_tells_twins_apart_and_that_is_said(tmp_path: Path) -> None:
    study = rope_study(tmp_path, LinearDrag(rate=1.0))
    models = [kept(study, "linear-drag", 1.0, 5.0), kept(study, "twin-drag", 1.0, 5.0)]
    put_diagnosis(study, "tied", ["linear-drag", "twin-drag"], models=models)
    found = propose(study, simulations=36, max_speed=2.0, max_acceleration=20.0)
    assert found.motion is None and found.result["probability"] < 0.01 and found.result["takes"] is None
    assert "No motion within these limits would tell them apart: best less than 1 %" in found.text()
    with pytest.raises(InputError, match="nothing to write"):
        found.write(tmp_path / "motion.csv")
    assert not (tmp_path / "motion.csv").exists()


def test_a_motion_of_which_several_takes_would_do_is_proposed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("muslin.inference.criticism.next.step.HOPELESS", 0.8)
    study = rope_study(tmp_path, LinearDrag(rate=1.0))
    tied_drags(study)
    found = propose(study, simulations=36, max_speed=0.2, max_acceleration=8.0, workspace=(-0.15, 0.15) * 3)
    assert found.result["probability"] < 0.8 and found.result["takes"] > 1 and found.motion is not None


@pytest.mark.slow
def test_models_are_refitted_where_the_diagnosis_kept_none(tmp_path: Path) -> None:
    study = rope_study(tmp_path, LinearDrag(rate=1.0))
    found = propose(study, effects=("linear-drag", "quadratic-drag"), max_speed=1.0, workspace=(-0.2, 0.2) * 3)
    assert found.result["purpose"] == "tied" and found.result["probability"] > found.result["repeat"]["probability"]
    put_diagnosis(study, "tied", ["linear-drag", "quadratic-drag"])
    rivals, count = opening.tied_rivals(
        study,
        knowing(study.problem, {"linear-drag": LinearDrag}),
        load_fit(study),
        read(study.step_results("fit"), "estimate_unit"),
        opening.Opening("tied", ("linear-drag",)),
    )
    assert count > 0 and rivals[0].values()["linear-drag.rate"] == pytest.approx(1.0, abs=0.25)


def test_kept_models_are_used_and_none_refitted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    study = rope_study(tmp_path)
    tied_drags(study)
    monkeypatch.setattr(opening, "refitted_rival", lambda *_: pytest.fail("refitted"))
    assert propose(study, simulations=30).result["simulations"] <= 45


@pytest.mark.parametrize(
    ("verdict", "named", "further", "open_", "beside"),
    [
        ("tied", ("linear-drag", "twin-drag"), ("quadratic-drag",), ("linear-drag", "twin-drag"), ("quadratic-drag",)),
        ("named", ("quadratic-drag",), ("linear-drag", "twin-drag"), ("linear-drag", "twin-drag"), ("quadratic-drag",)),
    ],
)
def test_what_is_missing_whichever_it_is_is_in_every_model(
    tmp_path: Path, verdict: str, named: tuple[str, ...], further: tuple[str, ...], open_: tuple[str, ...],
    beside: tuple[str, ...],
) -> None:  # fmt: skip
    study = rope_study(tmp_path)
    other = kept(study, beside[0], 6.0, 20.0)
    models = []
    for name in open_:
        model = kept(study, name, 1.0, 5.0)
        joint = {"effects": [*beside, name], "values": {**other["values"], **model["values"]}}  # type: ignore[dict-item]
        unit = [*other["unit"], model["unit"][-1]]  # type: ignore[misc,index]
        models.append(model | joint | {"unit": unit, "covariance": np.diag([4e-4, 1e-3, 2e-3]).tolist()})
    put_diagnosis(study, verdict, list(named), models=[*models, kept(study, open_[0], 2.0, 5.0)])
    group = study.results("r+")["diagnose"]
    group.attrs["result"] = {**group.attrs["result"], "further": list(further)}  # type: ignore[dict-item]
    found = opening.opening_of(study)
    assert (found.purpose, found.effects, found.beside) == ("tied", open_, beside)
    known = knowing(study.problem, {n: REGISTRY.get("effect", n) for n in found.all_effects})
    rivals, count = opening.tied_rivals(study, known, load_fit(study), np.zeros(1), found)
    assert count == 0 and [r.name for r in rivals] == list(open_)
    for name, rival in zip(open_, rivals, strict=True):
        assert rival.values()[f"{name}.rate"] == pytest.approx(1.0)
        assert rival.values()["quadratic-drag.factor"] == pytest.approx(6.0)
        assert rival.covariance[-1, -1] == (1e-3 if rival.space.names[-1] == "quadratic-drag.factor" else 2e-3)
    said = explain({"purpose": "tied", "effects": open_, "beside": beside, "motion": None, "tried": 3}, "")[0]
    assert said == "Tied now: linear-drag, twin-drag, with quadratic-drag in the model."


def test_what_the_recordings_decide_needs_no_motion(tmp_path: Path) -> None:
    study = rope_study(tmp_path)
    tied_drags(study, lead=25.0)
    found = propose(study, effects=("linear-drag", "quadratic-drag"))
    assert found.result["purpose"] == "nothing" and found.result["simulations"] == 0 and found.motion is None
    assert "linear-drag fits better than quadratic-drag, by 25" in found.text()


def test_a_lead_that_the_diagnosis_does_not_go_by_decides_nothing(tmp_path: Path) -> None:
    study = rope_study(tmp_path, LinearDrag(rate=1.0))
    tied_drags(study, lead=25.0)
    limits = {"max_speed": 1.0, "max_acceleration": 10.0, "workspace": (-0.2, 0.2) * 3, "duration": 1.2}
    found = propose(study, simulations=30, **limits)
    assert found.result["purpose"] == "tied" and found.motion is not None


def test_nothing_open_is_said_without_a_simulation(tmp_path: Path) -> None:
    study = rope_study(tmp_path)
    put_diagnosis(study, "named", ["linear-drag"])
    found = propose(study)
    assert found.result["purpose"] == "nothing" and found.result["simulations"] == 0
    assert found.text().startswith("No motion is proposed: linear-drag is named")


def test_an_effect_that_is_named_is_not_one_that_could_not_be_seen(tmp_path: Path) -> None:
    """Where an ordinary strength would not show, a large one may."""
    study = rope_study(tmp_path)
    unseen = {"name": "linear-drag", "coefficients": {}, "identifiability": 0.0}
    for hidden, effects in (([], ()), (["quadratic-drag"], ("quadratic-drag",))):
        put_diagnosis(study, "named", ["linear-drag"], hidden=hidden, models=[kept(study, "linear-drag", 1.0, 5.0)])
        group = study.results("r+")["diagnose"]
        result: dict[str, Any] = group.attrs["result"]  # type: ignore[assignment]
        rows = [unseen, *result["candidates"][1:]]
        group.attrs["result"] = {**result, "candidates": rows}
        assert opening.opening_of(study).effects == effects
        assert propose(study, simulations=30).result["purpose"] == ("unseen" if hidden else "nothing")


@pytest.mark.parametrize(
    ("verdict", "more", "said"),
    [
        ("none", {}, "none of the candidates, and these data show every one of them; muslin unknown {}"),
        ("cannot-tell", {"unfinished": True}, "before what promises most was refitted; allow several times"),
        ("no-misfit", {}, "no effects are tied, and these data show every candidate"),
    ],
)
def test_what_tells_more_than_a_motion_is_said(tmp_path: Path, verdict: str, more: dict[str, bool], said: str) -> None:
    study = rope_study(tmp_path)
    put_diagnosis(study, verdict, [], hidden=["quadratic-drag"] if more else [])
    group = study.results("r+")["diagnose"]
    rows = [{"name": "linear-drag", "coefficients": {}, "identifiability": 0.5}]
    result: dict[str, Any] = group.attrs["result"]  # type: ignore[assignment]
    group.attrs["result"] = {**result, "candidates": [*result["candidates"], *rows], **more}
    found = propose(study)
    assert found.result["purpose"] == "nothing" and found.result["simulations"] == 0
    assert found.text().startswith("No motion is proposed: ") and said.format(study.path) in found.text()


def test_no_force_in_space_is_looked_for_in_pixels() -> None:
    take = SimpleNamespace(series=SimpleNamespace(unit="px"))
    study = SimpleNamespace(path="s.toml", problem=SimpleNamespace(fit_on=("a",), recordings={"a": take}))
    told = opening._no_question(study, {"verdict": "none", "effects": []})  # type: ignore[arg-type]
    assert "of points in metres muslin unknown estimates" in told and "s.toml" not in told


def test_what_was_not_seen_is_shown_by_a_livelier_motion(tmp_path: Path) -> None:
    study = rope_study(tmp_path)
    put_diagnosis(study, "cannot-tell", [], hidden=["quadratic-drag", "actuator-lag"])
    found = propose(study, max_speed=1.5, max_acceleration=15.0, workspace=(-0.2, 0.2) * 3, duration=1.2)
    assert found.result["purpose"] == "unseen" and found.motion is not None
    assert min(found.result["probabilities"].values()) > 0.9
    assert "Not visible in these data: quadratic-drag, actuator-lag." in found.text()
    still = propose(study, simulations=30, max_speed=0.01, max_acceleration=0.1, duration=1.2)
    assert still.result["probabilities"]["actuator-lag"] < 0.05


def test_motions_that_tear_the_object_are_avoided(tmp_path: Path) -> None:
    study = rope_study(tmp_path, simulator="fragile")
    tied_drags(study)
    found = propose(study, simulations=40, max_speed=1.0, max_acceleration=10.0)
    assert found.result["failed"] > 0
    assert found.result["motion"]["peak_speed"] <= Fragile.strength * 1.02  # the command is sampled more finely


def test_a_recording_that_is_fitted_in_pieces_was_moved_in_one_go(tmp_path: Path) -> None:
    study = rope_study(tmp_path, motion=LIFT)
    put_diagnosis(study, "named", ["linear-drag"])
    whole = propose(study).result["limits"]
    assert whole["workspace"][4:] == [-0.1, pytest.approx(0.4, abs=1e-3)] and whole["duration"] == pytest.approx(1.96)
    cut_in_half(study)
    tied_drags(study)
    found = propose(study, simulations=30).result
    assert found["limits"] == {**whole, "workspace": pytest.approx(whole["workspace"], abs=0.02)}
    assert found["repeat"]["name"] == "slow once more"


def test_the_same_seed_proposes_the_same_motion(tmp_path: Path) -> None:
    study = rope_study(tmp_path)
    tied_drags(study)
    first, second = propose(study, simulations=30), propose(study, simulations=30)
    assert {**first.result, "seconds": 0} == {**second.result, "seconds": 0}


def test_bad_questions_are_answered_in_one_line(tmp_path: Path) -> None:
    study = rope_study(tmp_path)
    with pytest.raises(StepMissingError, match="muslin diagnose"):
        propose(study)
    with pytest.raises(InputError, match="named twice"):
        propose(study, effects=("linear-drag", "linear-drag"))
    with pytest.raises(InputError, match="at least 30"):
        propose(study, effects=("linear-drag", "twin-drag"), simulations=3)
    with pytest.raises(InputError, match="explains anything"):
        propose(study, effects=("linear-drag", "law"))
    with pytest.raises(InputError, match="cloth and solid"):
        propose(study, effects=("linear-drag", "air-drag"))


@pytest.mark.slow
def test_noise_hides(tmp_path: Path) -> None:
    quiet, loud = rope_study(_folder(tmp_path / "a")), rope_study(_folder(tmp_path / "b"), noise=60 * NOISE)
    shares = []
    for study in (quiet, loud):
        tied_drags(study)
        shares.append(propose(study, max_speed=1.0, max_acceleration=10.0).result["probability"])
    assert shares[0] > shares[1] + 0.3


def test_the_error_of_a_time_step_hides(tmp_path: Path) -> None:
    """Of one motion, recorded once more, less can be told by a model whose step is known to be off."""
    told = []
    for simulator in ("reference", "stepped"):
        study = rope_study(_folder(tmp_path / simulator), simulator=simulator, noise=0.2 * NOISE)
        tied_drags(study)
        told.append(propose(study, max_speed=1.0, max_acceleration=10.0).result["repeat"]["probability"])
    assert told[0] > told[1] + 0.1


def _folder(path: Path) -> Path:
    path.mkdir()
    return path
