"""``muslin calibrate`` and ``muslin export`` on a made-up study: pages, files, and what is refused."""

import json
import re
import tomllib
from pathlib import Path

import numpy as np
import pytest
from made_up_study import make_study
from test_commands import status
from test_report import Page, page_of

pytest.importorskip("torch")

from muslin.core.registry import REGISTRY
from muslin.core.store import put
from muslin.core.study import Study
from muslin.inference.calibration.predictive import Predictive
from muslin.inference.calibration.ranks import Ranks
from muslin.inference.calibration.result import Calibration, save_calibration
from muslin.inference.calibration.verdict import judge
from muslin.inference.posterior.files import fitted_space
from muslin.inference.posterior.mixture import MixturePosterior

#: Against the upper bound of the third parameter.
POSTERIOR = MixturePosterior(
    np.array([0.6, 0.4]), np.array([[0.5, -1.0, 3.0], [-0.5, 0.0, 2.0]]), np.stack([0.25 * np.eye(3)] * 2)
)


def fitted(folder: Path) -> Study:
    """A study whose fit holds :data:`POSTERIOR`."""
    study = make_study(folder, "fit")
    POSTERIOR.save(folder / "p.npz")
    put(
        study.results("r+")["fit"], "posterior_file", np.frombuffer((folder / "p.npz").read_bytes(), np.uint8), ["byte"]
    )
    return study


def calibrated(study: Study, simulations: int = 0, predictive: int = 100) -> Calibration:
    """Stands in for the step: ranks of posteriors with half the standard deviation in the first parameter."""
    rng = np.random.default_rng(0)
    u = rng.random((120, 5))
    u[:, 0] = np.where(rng.random(120) < 0.5, u[:, 0] ** 3 / 2, 1 - u[:, 0] ** 3 / 2)
    ranks = Ranks(u[:, :3], u[:, 3], u[:, 4], np.ones(120))
    names = fitted_space(study).names
    rows = [
        Predictive("fling", "fit", 1.01, 0.9, 1.1, 0.4, predictive),
        Predictive("swing", "held-out", 2.4, 0.9, 1.1, 0.002, predictive),
    ]
    replicates = {r.recording: rng.normal(1.0, 0.05, 200) for r in rows}
    cases = f"{simulations or 120} made-up <cases>"
    found = Calibration(judge(ranks, names, rng), ranks, cases, tuple(rows), replicates, ("3 failed",), 200, 1.0)
    save_calibration(study, found)
    return found


@pytest.fixture
def study(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Study:
    pytest.importorskip("mujoco")
    monkeypatch.setitem(REGISTRY._objects, ("step", "calibrate"), calibrated)
    return fitted(tmp_path)


def test_calibrate_says_its_verdict_and_writes_its_pictures(study: Study, capsys: pytest.CaptureFixture[str]) -> None:
    table = study.path.with_name("c.json")
    assert status("calibrate", str(study.path), "--simulations", "60", "--json", str(table)) == 0
    out = capsys.readouterr().out
    first = fitted_space(study).names[0]
    assert f"The posterior is over-confident in {first}: intervals that should hold 80% hold" in out
    assert "from 60 made-up <cases>" in out and "next: muslin report" in out
    found = json.loads(table.read_text())
    assert found["verdict"] == "over-confident" and found["rows"][0]["finding"] == "over-confident"
    assert found["rows"][-1]["factor"] is None and found["predictive"][1]["finding"] == "unlike"
    html = study.path.with_name("cloth.calibration.html").read_text(encoding="utf-8")
    page = Page(html)
    assert page.figures["svg"] == 3 + 1 + 1 and page.sections == ["calibration"]  # ranks, coverage, predictive
    assert "made-up &lt;cases&gt;" in html and not re.search(r"https?:|@import|url\((?!#)", html)
    assert "swing: not like anything that the posterior predicts" in page.text and "3 failed." in page.text


def test_the_report_shows_a_calibration_once_there_is_one(study: Study) -> None:
    assert "calibration" not in page_of(study).sections
    calibrated(study)
    page = page_of(study)
    assert page.sections == ["fit", "calibration", "provenance", "hidden"]
    assert "The posterior is over-confident" in page.text and "muslin calibrate cloth.toml" in page.text


def test_a_misspelt_place_is_refused_before_anything_is_done(study: Study, capsys: pytest.CaptureFixture[str]) -> None:
    assert status("calibrate", str(study.path), "-o", str(study.path.parent / "none" / "a.html")) == 2
    assert "there is no folder" in capsys.readouterr().err
    assert "calibrate" not in study.results()


def test_export_for_training_loops_and_for_people(study: Study, tmp_path: Path) -> None:
    space = fitted_space(study)
    low, high = np.array([p.low for p in space]), np.array([p.high for p in space])
    for name in ("d.json", "d.toml"):
        path = tmp_path / name
        assert status("export", str(study.path), str(path), "--as", "domain-randomisation", "--samples", "300") == 0
        text = path.read_text(encoding="utf-8")
        table = json.loads(text) if path.suffix == ".json" else tomllib.loads(text)
        assert table["names"] == list(space.names) and table["units"] == list(space.units)
        values = np.array(table["samples"])
        assert values.shape == (300, 3) and (values >= low).all() and (values <= high).all()
        unit = POSTERIOR.sample(50_000, np.random.default_rng(1))
        assert space.to_unit(values).mean(axis=0) == pytest.approx(unit.mean(axis=0), abs=0.06)
    path = tmp_path / "s.json"
    assert status("export", str(study.path), str(path), "--as", "json") == 0
    table = json.loads(path.read_text())
    row = table["parameters"][0]
    assert row["low"] <= row["quantiles"]["0.025"] < row["quantiles"]["0.5"] < row["quantiles"]["0.975"] <= row["high"]
    assert np.sqrt(np.diag(table["covariance"])) == pytest.approx([r["sd"] for r in table["parameters"]])
    assert [m["mass"] for m in table["modes"]] == pytest.approx([0.6, 0.4], abs=0.05)


def test_export_to_arviz_comes_back_with_units(study: Study, tmp_path: Path) -> None:
    arviz = pytest.importorskip("arviz")
    path = tmp_path / "a.nc"
    assert status("export", str(study.path), str(path), "--as", "arviz", "--samples", "400") == 0
    back = arviz.from_netcdf(str(path))
    first = next(iter(fitted_space(study)))
    assert back["posterior"][first.name].shape == (1, 400)
    assert back["posterior"][first.name].attrs["units"] == first.unit
    assert np.isfinite(back["sample_stats"]["lp"].values).all()
    assert list(tmp_path.glob(".a.nc*")) == []


def test_export_draws_slices(study: Study, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    assert status("export", str(study.path), str(tmp_path / "s.png"), "--as", "slices") == 0
    assert (tmp_path / "s.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("kind", "name", "says"),
    [
        ("csv", "x.csv", "it can as arviz, json, domain-randomisation"),
        ("json", "x.toml", "written to a .json file, not to x.toml"),
        ("domain-randomisation", "x.nc", "a .json or .toml file"),
        ("slices", "x.jpg", "written to a .png file"),
    ],
)
def test_what_cannot_be_exported_is_said(
    study: Study, tmp_path: Path, capsys: pytest.CaptureFixture[str], kind: str, name: str, says: str
) -> None:
    assert status("export", str(study.path), str(tmp_path / name), "--as", kind) == 2
    assert says in capsys.readouterr().err
    assert not (tmp_path / name).exists()


def test_export_needs_a_fit_and_leaves_files_alone(
    study: Study, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "there.json").write_text("mine")
    assert status("export", str(study.path), str(tmp_path / "there.json"), "--as", "json") == 2
    assert "--force" in capsys.readouterr().err and (tmp_path / "there.json").read_text() == "mine"
    make_study(tmp_path)
    assert status("export", str(study.path), str(tmp_path / "x.json"), "--as", "json") == 2
    assert "muslin fit" in capsys.readouterr().err


def test_a_damaged_posterior_is_one_clear_error(study: Study, capsys: pytest.CaptureFixture[str]) -> None:
    put(study.results("r+")["fit"], "posterior_file", np.zeros(40, np.uint8), ["byte"])
    assert status("export", str(study.path), str(study.path.with_name("x.json")), "--as", "json") == 2
    said = capsys.readouterr().err
    assert "the posterior is not a saved posterior" in said and "run the fit again" in said
