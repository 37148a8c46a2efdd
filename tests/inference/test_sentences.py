"""What a diagnosis says in words, where a verdict alone would mislead."""

from typing import Any

import pytest

from muslin.inference.criticism.sentences import _elsewhere


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
