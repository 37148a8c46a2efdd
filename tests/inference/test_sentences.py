"""What a diagnosis says in words, where a verdict alone would mislead."""

from typing import Any

import pytest

from muslin.inference.criticism.sentences import _elsewhere


def result(verdict: str, before: float, held_out: bool = True) -> dict[str, Any]:
    error = {"noise": 0.003, "before": before, "after": before, "unit": "m", "held_out": held_out}
    return {"verdict": verdict, "error": error}


@pytest.mark.parametrize("verdict", ["no-misfit", "cannot-tell"])
def test_a_misfit_that_only_held_out_motions_show_is_told(verdict: str) -> None:
    text = _elsewhere(result(verdict, 0.006))
    assert "6.0 mm" in text and "2.0 times" in text and "fit_on" in text


def test_nothing_is_told_where_there_is_nothing() -> None:
    assert not _elsewhere(result("no-misfit", 0.0032))
    assert not _elsewhere(result("no-misfit", 0.006, held_out=False))
    assert not _elsewhere(result("named", 0.006))
