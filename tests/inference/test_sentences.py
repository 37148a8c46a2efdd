"""What a diagnosis says in words, where a verdict alone would mislead."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from muslin.inference.criticism.caveats import elsewhere, invisible, numerics, rest, small, untried
from muslin.inference.criticism.sentences import _alternatives, _in_part, _to_be_sure, _unchecked, _verdict


def study_in(unit: str) -> SimpleNamespace:
    take = SimpleNamespace(series=SimpleNamespace(unit=unit))
    return SimpleNamespace(path="s.toml", problem=SimpleNamespace(fit_on=("a",), recordings={"a": take}))


IN_METRES, IN_PIXELS = study_in("m"), study_in("px")


def result(verdict: str, ratio: float, held_out: bool = True) -> dict[str, Any]:
    evidence = {"held_out": ratio**2 if held_out else None}
    return {"verdict": verdict, "error": {"held_out": held_out}, "evidence": evidence, "unfinished": False}


@pytest.mark.parametrize("verdict", ["no-misfit", "cannot-tell"])
def test_a_misfit_that_only_held_out_motions_show_is_told(verdict: str) -> None:
    text = elsewhere(result(verdict, 2.0))
    assert "2.0 times the noise" in text and "fit_on" in text
    assert "cannot be simulated" in elsewhere(result(verdict, float("inf")))


def test_nothing_is_told_where_there_is_nothing() -> None:
    assert not elsewhere(result("no-misfit", 1.1))
    assert not elsewhere(result("no-misfit", float("nan")))
    assert not elsewhere(result("no-misfit", 2.0, held_out=False))
    assert not elsewhere(result("named", 2.0))
    assert not elsewhere(result("cannot-tell", 2.0) | {"unfinished": True})


def test_a_misfit_that_stays_beside_what_was_named_is_told() -> None:
    named = {"evidence": {"misfit_after": 1.5**2}, "simulations": 900}
    assert not rest(named | {"rest": None})
    told = rest(named | {"rest": "none"})
    assert told.startswith("More is missing") and "1.50 times the noise" in told
    told = rest(named | {"rest": "open", "effects": ["wind", "lag"]})
    assert told.startswith("More may be missing") and "with wind and lag in the model; add them, and" in told
    told = rest(named | {"rest": "unfinished"})
    assert told.startswith("More may be missing") and "900 simulations" in told and "[diagnose] simulations" in told


def test_a_candidate_that_is_a_part_of_the_answer_is_told_with_what_it_is_good_for() -> None:
    part = {"explained": 0.36, "held_out_before": 0.0083, "held_out_after": 0.0065}
    assert "8.3 mm → 6.5 mm" in _in_part(part, "m")
    for less in ({"explained": 0.1}, {"held_out_after": 0.0084}, {"held_out_before": None, "held_out_after": None}):
        assert not _in_part(part | less, "m")
    told = _in_part(part | {"held_out_before": np.inf}, "m")
    assert "with it held-out motions can be simulated, and without it not" in told and "inf" not in told


def test_an_error_that_nobody_knows_is_told_as_such() -> None:
    """A take that only one of two models can be simulated on has no error before and after."""
    row = {"name": "drag", "coefficients": {"rate": {"mean": 1.0, "sd": 0.1, "unit": "1/s"}}}
    error = {"unit": "m", "noise": 0.003, "held_out": True, "before": np.nan, "after": np.nan, "noise_error": 0.02}
    evidence = {"misfit": 9.0, "misfit_after": 1.0, "explained": 1.0}
    named = {"verdict": "named", "effects": ["drag"], "error": error, "evidence": evidence, "candidates": [row]}
    told = _verdict(named, {"drag": SimpleNamespace(symptom="moves too fast")})  # type: ignore[dict-item]
    assert "held-out error not known (one of the two models cannot be simulated there), noise 3.0 mm" in told


def test_what_hides_behind_the_noise_is_told_to_be_small() -> None:
    error = {"held_out": True, "before": 0.0032, "after": 0.0030}
    rows = [{"name": "wind", "z": 7.8}, {"name": "tilt", "z": 7.7}]
    tied = {"verdict": "tied", "effects": ["wind", "tilt"], "candidates": rows, "error": error}
    within, beyond = {"evidence": {"beyond_noise": False}}, {"evidence": {"beyond_noise": True}}
    told = small(tied | within)
    assert "wind takes away is beyond chance (8 standard deviations), and motions that were not fitted" in told
    assert "bear it out" not in small(tied | within | {"error": error | {"after": 0.0033}})
    assert "bear it out" not in small(tied | within | {"error": error | {"held_out": False}})
    assert not small(tied | beyond)
    assert not small(tied | within | {"verdict": "no-misfit", "effects": []})


@pytest.mark.parametrize("explained, part", [(0.36, True), (0.1, False)])
def test_what_to_do_with_a_part_of_the_answer_is_told(explained: float, part: bool) -> None:
    best = {"name": "wind", "explained": explained, "held_out_before": 0.0083, "held_out_after": 0.0065}
    told = _to_be_sure(IN_METRES, {"verdict": "none", "candidates": [best], "together": None})  # type: ignore[arg-type]
    assert "muslin unknown s.toml" in told
    assert ("muslin add wind s.toml" in told) == part


def test_two_effects_that_explain_more_are_told_where_none_is_named() -> None:
    best = {"name": "lag", "explained": 0.53, "objection": "little", "held_out_before": None, "held_out_after": None}
    error = {"unit": "m", "noise": 0.003, "before": 0.009, "after": 0.009, "held_out": False, "noise_error": 0.02}
    none = {"verdict": "none", "effects": [], "error": error, "evidence": {"misfit": 9.0}, "candidates": [best]}

    def told(two: dict[str, Any] | None) -> str:
        return _verdict(none | {"together": two}, {})

    pair = {"effects": ["drag", "added-mass"], "explained": 0.81, "alike": [], "judged": True}
    assert "Together drag and added-mass explain 81 %, which is more, but these data do not tell" in told(pair)
    assert "explain 76 %, which is more, but not enough for a name." in told(pair | {"explained": 0.76})
    as_good = [{"effects": ["wind", "added-mass"], "explained": 0.79}, {"effects": ["lag", "hem"], "explained": 0.78}]
    alike = told(pair | {"alike": as_good})
    assert "these two: wind and added-mass (79 %), lag and hem (78 %) may be it as well." in alike
    assert "Together" not in told(pair | {"explained": 0.7})
    assert "Together" not in told(None)
    ended = pair | {"judged": False}
    assert "which is more, but the budget ended before it was known whether it is these two." in told(ended)

    def advice(two: dict[str, Any], study: SimpleNamespace = IN_METRES) -> str:
        return _to_be_sure(study, none | {"together": two, "simulations": 800})  # type: ignore[arg-type]

    for study in (IN_METRES, IN_PIXELS):
        told_to_do = advice(ended, study)
        assert "[diagnose] simulations = 1600" in told_to_do and "muslin add drag,added-mass s.toml" in told_to_do
    assert "simulations" not in advice(pair) + advice(ended | {"explained": 0.76})


def test_what_is_told_of_is_not_told_as_invisible() -> None:
    """An ordinary strength of an effect may not show where a large one does."""
    rows = [
        {"name": n, "identifiability": seen} for n, seen in (("wind", 0.0), ("drag", 0.0), ("lag", 0.0), ("hem", 1))
    ]
    told = invisible({"effects": ["wind"], "further": ["lag"], "candidates": rows})
    assert told == "Not visible in these data, so neither ruled in nor out: drag."
    assert not invisible({"effects": ["wind", "drag"], "further": ["lag"], "candidates": rows})


def test_what_the_budget_did_not_come_to_is_not_ruled_out() -> None:
    rows = [
        {"name": n, "tried": tried, "explained": share, "objection": "chance", "identifiability": 0.5}
        for n, tried, share in (("drag", True, 0.9), ("wind", True, 0.1), ("lag", False, 0.0), ("hem", False, 0.0))
    ]
    rows += [{"name": "crease", "tried": False, "explained": 0.0, "objection": "invisible", "identifiability": 0.0}]
    about = {"verdict": "named", "effects": ["drag"], "further": [], "simulations": 122, "candidates": rows}
    assert _alternatives(about).startswith("Ruled out: 1 of 3 others that these data can show; none explains")
    cut = untried(about | {"budget_spent": True})
    assert cut.startswith("Not tried, as the budget ended after 122 simulations: hem, lag; allow more")
    assert not untried(about | {"budget_spent": False})
    assert not untried(about | {"budget_spent": True, "verdict": "no-misfit"})
    assert not _alternatives(about | {"candidates": [rows[0], rows[2]]})


def test_held_out_motions_that_show_nothing_are_told() -> None:
    rows = [{"name": "wind", "held_out_shows": False}, {"name": "drag", "held_out_shows": True}]
    assert "too gentle to show wind" in _unchecked({"effects": ["wind"], "candidates": rows})
    assert not _unchecked({"effects": ["wind", "drag"], "candidates": rows})
    assert not _unchecked({"effects": [], "candidates": rows})
    assert not _unchecked({"effects": ["wind"], "candidates": [{"name": "wind", "held_out_shows": None}]})


def test_noise_that_is_hardly_known_is_told_as_such() -> None:
    known = {"verdict": "no-misfit", "effects": [], "candidates": [], "evidence": {"misfit": 1.5**2}}
    error = {"noise": 0.095, "unit": "m", "held_out": False, "before": 0.1, "after": 0.1}
    told = _verdict(known | {"error": error | {"noise_error": 0.22}}, {})
    assert "1.50 times the noise of 95.0 mm, and that is known to 22 % only" in told
    assert "what noise alone does" in _verdict(known | {"error": error | {"noise_error": 0.02}}, {})


def test_numbers_that_move_the_model_are_told_where_a_misfit_stays() -> None:
    known = {"error": {"noise": 0.002, "unit": "m"}, "rest": None}
    moved = {"numerics": {"step": 0.012, "mesh": 0.001, "pybullet": 0.018}}
    told = numerics(known | moved | {"verdict": "none"})
    assert "half the time step by 12.0 mm, the engine pybullet by 18.0 mm" in told and "mesh" not in told
    assert "Lower [simulator] time_step until" in told
    assert numerics(known | moved | {"verdict": "named", "rest": "none"}) == told
    assert not numerics(known | moved | {"verdict": "named"})
    assert not numerics(known | {"numerics": {"step": 0.001}, "verdict": "none"})


def test_what_is_missing_beside_others_is_not_told_as_ruled_out() -> None:
    rows = [
        {"name": n, "explained": 0.4, "objection": "little", "behind": 99.0} for n in ("wind", "tilt", "lag", "hem")
    ]
    told = _alternatives({"verdict": "tied", "effects": ["wind", "tilt"], "further": ["lag"], "candidates": rows})
    assert told.startswith("Ruled out: hem (40 %") and "lag" not in told


@pytest.mark.parametrize("after, said", [(0.0080, "better by too little"), (0.0084, "no better")])
def test_held_out_motions_that_get_a_little_better_are_not_told_as_no_better(after: float, said: str) -> None:
    rival = {"name": "wind", "explained": 0.9, "objection": "held-out", "held_out_before": 0.0083}
    rows = [rival | {"name": "tilt"}, rival | {"held_out_after": after}]
    told = _alternatives({"effects": ["tilt"], "verdict": "named", "further": [], "candidates": rows})
    assert told == f"Ruled out: wind (90 %: motions that it was not fitted to get {said})."


def test_why_a_candidate_that_passes_by_itself_is_not_named() -> None:
    def told(behind: float, **result: Any) -> str:
        rival = {"name": "wind", "explained": 0.9, "objection": None, "behind": behind}
        rows = [rival | {"name": "tilt", "behind": 0.0}, rival]
        return _alternatives({"effects": ["tilt"], "verdict": "named", "further": [], "candidates": rows} | result)

    assert told(42.0) == "Ruled out: wind (90 %: 42 behind tilt in -2 log likelihood)."
    assert told(42.0, effects=["tilt", "drag"]) == told(42.0)
    assert told(3.0, effects=["tilt", "drag"]) == "Ruled out: wind (90 %: behind with drag in the model)."
    assert "tilt (90 %: lag and drag together leave far less)" in told(3.0, effects=["lag", "drag"])
    assert "tilt (90 %: lag leaves far less)" in told(3.0, effects=["lag"])  # found beside tilt, which then was idle
    tied = {"verdict": "tied", "effects": ["tilt", "lag"]}
    assert told(42.0, **tied) == told(42.0)
    assert told(3.0, **tied, further=["drag"]) == "Ruled out: wind (90 %: behind with drag in the model)."
