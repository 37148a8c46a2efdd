"""What a diagnosis says in words, where a verdict alone would mislead."""

from typing import Any

import pytest

from muslin.inference.criticism.sentences import _elsewhere, _in_part, _rest


def result(verdict: str, ratio: float, held_out: bool = True) -> dict[str, Any]:
    evidence = {"held_out": ratio**2 if held_out else None}
    return {"verdict": verdict, "error": {"held_out": held_out}, "evidence": evidence, "unfinished": False}


@pytest.mark.parametrize("verdict", ["no-misfit", "cannot-tell"])
def test_a_misfit_that_only_held_out_motions_show_is_told(verdict: str) -> None:
    text = _elsewhere(result(verdict, 2.0))
    assert "2.0 times the noise" in text and "fit_on" in text
    assert "cannot be simulated" in _elsewhere(result(verdict, float("inf")))


def test_nothing_is_told_where_there_is_nothing() -> None:
    assert not _elsewhere(result("no-misfit", 1.1))
    assert not _elsewhere(result("no-misfit", float("nan")))
    assert not _elsewhere(result("no-misfit", 2.0, held_out=False))
    assert not _elsewhere(result("named", 2.0))
    assert not _elsewhere(result("cannot-tell", 2.0) | {"unfinished": True})


def test_a_misfit_that_stays_beside_what_was_named_is_told() -> None:
    named = {"evidence": {"misfit_after": 1.5**2}, "simulations": 900}
    assert not _rest(named | {"rest": None})
    told = _rest(named | {"rest": "none"})
    assert told.startswith("More is missing") and "1.50 times the noise" in told
    told = _rest(named | {"rest": "unfinished"})
    assert told.startswith("More may be missing") and "900 simulations" in told and "[diagnose] simulations" in told


def test_a_candidate_that_is_a_part_of_the_answer_is_told_with_what_it_is_good_for() -> None:
    part = {"explained": 0.36, "held_out_before": 0.0083, "held_out_after": 0.0065}
    assert "8.3 mm → 6.5 mm" in _in_part(part, "m")
    for less in ({"explained": 0.1}, {"held_out_after": 0.0084}, {"held_out_before": None, "held_out_after": None}):
        assert not _in_part(part | less, "m")
