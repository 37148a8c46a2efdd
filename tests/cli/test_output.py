"""Files that commands write."""

import json
from collections.abc import Sequence
from pathlib import Path

import pytest

pytest.importorskip("typer")

from test_commands import Result, status

from muslin.cli.output import write_json
from muslin.core.registry import REGISTRY


def test_json_has_no_nan_and_no_infinity(tmp_path: Path) -> None:
    path = tmp_path / "figures.json"
    write_json(path, {"a": float("nan"), "b": [1.5, float("-inf"), None], "c": ("é", {"d": 2})})

    def refuse(word: str) -> None:
        raise AssertionError(word)

    found = json.loads(path.read_text(encoding="utf-8"), parse_constant=refuse)
    assert found == {"a": None, "b": [1.5, None, None], "c": ["é", {"d": 2}]}
    assert [f.name for f in tmp_path.iterdir()] == ["figures.json"]


@pytest.fixture
def ran(study: Path, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Steps that were run, by stand-ins; beside the study are a recording, a mesh that it names, and results."""
    done: list[str] = []
    for name in ("compare", "diagnose", "unknown", "next", "calibrate", "export"):
        work = lambda *given, name=name, **options: done.append(name) or Result({})  # noqa: E731
        monkeypatch.setitem(REGISTRY._objects, ("step", name), work)
    study.with_name("other.toml").write_text(study.read_text())
    study.write_text(study.read_text() + '[[scenario.obstacles]]\nkind = "mesh"\nfile = "floor.stl"\n')
    for name in ("take.npz", "floor.stl", "notes.txt"):
        study.with_name(name).write_text(name)
    study.with_name("study.results.zarr").mkdir()
    return done


WRITERS = (
    ("report", "STUDY", "-o", "OUT"),
    ("report", "other.toml", "--after", "STUDY", "-o", "OUT"),
    ("calibrate", "STUDY", "-o", "OUT"),
    ("calibrate", "STUDY", "--json", "OUT"),
    ("compare", "STUDY", "--json", "OUT"),
    ("diagnose", "STUDY", "--json", "OUT"),
    ("unknown", "STUDY", "--json", "OUT"),
    ("next", "STUDY", "--json", "OUT"),
    ("next", "STUDY", "-o", "OUT", "--force"),
    ("export", "STUDY", "OUT", "--as", "json", "--force"),
    ("add", "wind", "STUDY", "-o", "OUT", "--force"),
)


@pytest.mark.parametrize("arguments", WRITERS, ids=" ".join)
def test_nothing_is_written_over_the_study_or_what_it_is_about(
    arguments: Sequence[str],
    ran: list[str],
    study: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(study.parent)
    before = {p: p.read_bytes() for p in study.parent.rglob("*") if p.is_file()}
    places = {
        "study.toml": "the study itself",
        "../" + study.parent.name + "/study.toml": "the study itself",
        "floor.stl": "a file that study.toml needs",
        "m.zarr/figures.json": "lies in the measurement of",
        "study.results.zarr": "lies in the results of study.toml; name a file outside of",
    }
    if "--force" not in arguments:
        places |= {name: "exists already, and only a ." for name in ("take.npz", "notes.txt")}
    for place, words in places.items():
        assert status(*({"STUDY": "study.toml", "OUT": place}.get(a, a) for a in arguments)) == 2
        told = capsys.readouterr().err
        assert words in told and len(told.splitlines()) == 1
    assert ran == [] and {p: p.read_bytes() for p in study.parent.rglob("*") if p.is_file()} == before


def test_a_result_of_an_earlier_run_is_replaced(ran: list[str], study: Path) -> None:
    target = study.with_name("found.json")
    for _ in range(2):
        assert status("compare", str(study), "--json", str(target)) == 0
    assert ran == ["compare", "compare"] and json.loads(target.read_text()) == {}
