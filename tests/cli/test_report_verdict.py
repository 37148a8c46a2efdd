"""What the first sentences of a report say of a verdict."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from made_up_study import make_study
from matplotlib.figure import Figure
from report_page import page_of

from muslin.cli.report.gather import gather
from muslin.cli.report.verdict import verdict
from muslin.cli.report.words import NBSP, fall


@pytest.fixture(autouse=True)
def undrawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """Only words are read here; drawing, most of the time of a report, is for test_report."""

    def savefig(self: Figure, buffer: Any, format: str, **_: object) -> None:
        buffer.write("<svg></svg>" if format == "svg" else b"")

    monkeypatch.setattr(Figure, "savefig", savefig)


@pytest.mark.parametrize(
    ("verdict", "says"),
    [
        ("tied", "Air drag or viscous damping is missing from the model; these recordings cannot tell which. With"),
        ("none", "no candidate explains it"),
        ("cannot-tell", "cannot show what is missing"),
        ("no-misfit", "Nothing is seen to be missing"),
    ],
)
def test_other_verdicts_claim_no_fall_of_the_error_but_a_tie(tmp_path: Path, verdict: str, says: str) -> None:
    page = page_of(make_study(tmp_path, "fit", "compare", "diagnose", verdict=verdict))
    assert says in page.text
    if verdict != "tied":
        assert "falls from" not in page.text and "→" not in page.text.split("The object at")[0]
    assert ("with air drag (candidate)" in page.text) == (verdict != "no-misfit")


def test_two_missing_effects_are_told_as_two(tmp_path: Path) -> None:
    study = make_study(tmp_path, "fit", "compare", "diagnose")
    group = study.results("r+")["diagnose"]
    group.attrs["result"] = {**group.attrs["result"], "effects": ["air-drag", "viscous-damping"]}
    assert "Air drag and viscous damping are missing from the model; with them, the" in page_of(study).text


def test_what_is_missing_beside_tied_effects_is_told(tmp_path: Path) -> None:
    study = make_study(tmp_path, "fit", "compare", "diagnose")
    group = study.results("r+")["diagnose"]
    tied = {"verdict": "tied", "effects": ["air-drag", "viscous-damping"], "further": ["wind"]}
    group.attrs["result"] = {**group.attrs["result"], **tied}
    text = page_of(study).text
    assert "Whichever it is, wind is missing, too. With air drag and wind, the" in text
    assert "muslin add air-drag,wind cloth.toml" in text


def test_what_is_missing_is_not_told_as_not_to_be_seen(tmp_path: Path) -> None:
    study = make_study(tmp_path, "fit", "compare", "diagnose")
    group = study.results("r+")["diagnose"]
    result: dict[str, Any] = group.attrs["result"]  # type: ignore[assignment]
    rows = [{**row, "identifiability": 0.0} for row in result["candidates"]]
    group.attrs["result"] = {**result, "further": ["viscous-damping"], "candidates": rows}
    text = page_of(study).text
    assert "neither found nor ruled out: gravity tilt, actuator lag" in text
    assert text.count("only if as strong as here") == 2 and text.count("no: too weak") == 2


@pytest.mark.parametrize("verdict", ["named", "tied"])
def test_an_after_study_that_has_less_than_was_found_is_not_told_as_all_of_it(tmp_path: Path, verdict: str) -> None:
    study = make_study(tmp_path, "fit", "compare", "diagnose")
    group, named = study.results("r+")["diagnose"], verdict == "named"
    both = {"effects": ["air-drag", "wind"]} if named else {"effects": ["air-drag", "hem"], "further": ["wind"]}
    group.attrs["result"] = {**group.attrs["result"], "verdict": verdict, **both}
    text = page_of(study, make_study(tmp_path, "fit", "compare", drag=True)).text
    assert "ith air drag, the" in text and "air drag and wind, the" not in text and "with them" not in text


@pytest.mark.parametrize(
    ("before", "after", "said"),
    [
        (0.0519, 0.003, "falls from 52 mm to 3.0 mm"),
        (0.01304, 0.0126, "falls from 13.0 mm to 12.6 mm"),
        (0.013041, 0.013039, "stays at 13.0 mm"),
        (0.0130, 0.0152, "rises from 13 mm to 15 mm"),
    ],
)
def test_an_error_that_falls_by_little_is_told_to_a_tenth(before: float, after: float, said: str) -> None:
    assert fall(before, after).replace(NBSP, " ") == said


@pytest.mark.parametrize("caveat", ["", "But held-out recordings are far off (2 of 2)."])
def test_a_model_that_only_fits_where_it_was_fitted_is_not_told_as_good(tmp_path: Path, caveat: str) -> None:
    study = make_study(tmp_path, "fit", "compare", "diagnose", drag=True, verdict="no-misfit")
    results = study.results("r+")
    results["compare"].attrs["elsewhere"] = caveat
    results["diagnose"].attrs["result"] = {**results["diagnose"].attrs["result"], "told": {"elsewhere": caveat}}  # type: ignore[dict-item]
    said = [verdict(replace(gather(study), diagnose=None)), verdict(gather(study))]
    assert [v.tone for v in said] == ["open" if caveat else "good"] * 2
    assert ["but" in v.headline for v in said] == [bool(caveat)] * 2
