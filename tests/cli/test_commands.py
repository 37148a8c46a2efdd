"""Commands in this process, with steps that stand in for the real ones."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from running import Muslin, cloth_measurement

from muslin.cli.failure import BAD_INPUT, INTERNAL, describe
from muslin.cli.main import run
from muslin.core.errors import InputError
from muslin.core.measurement_store import load_measurement, save_measurement
from muslin.core.registry import REGISTRY
from muslin.core.scenarios import PRESETS
from muslin.core.study import Study, build_problem, read_config


class Result:
    def __init__(self, table: dict[str, Any]) -> None:
        self.table = table

    def text(self) -> str:
        return "what a person reads"

    def to_json(self) -> dict[str, Any]:
        return self.table


def status(*arguments: str) -> int:
    with pytest.raises(SystemExit) as caught:
        run(arguments)
    return int(caught.value.code or 0)


@pytest.fixture
def step(monkeypatch: pytest.MonkeyPatch) -> Callable[[str, Callable[[Study], Any]], None]:
    return lambda name, work: monkeypatch.setitem(REGISTRY._objects, ("step", name), work)


def test_every_step_says_what_it_found_and_what_is_next(
    step: Callable[..., None], study: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name, following in (("fit", "muslin compare"), ("compare", "muslin diagnose")):
        step(name, lambda s: Result({}))
        assert status(name, str(study)) == 0
        out = capsys.readouterr().out
        assert "what a person reads" in out and f"next: {following} {study}" in out


def test_workers_and_progress_reach_the_study(
    step: Callable[..., None], study: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    def work(s: Study) -> Result:
        s.progress(f"simulating with {s.workers}", 1, 4)
        return Result({})

    step("fit", work)
    assert status("fit", str(study), "--workers", "3") == 0
    assert "simulating with 3: 1 of 4" in capsys.readouterr().err


def test_diagnose_writes_json_and_names_the_command_to_add(
    step: Callable[..., None], study: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    step("diagnose", lambda s: Result({"verdict": "named", "effects": ["wind"], "error": {"after": float("nan")}}))
    target = study.parent / "v.json"
    assert status("diagnose", str(study), "--json", str(target)) == 0
    assert json.loads(target.read_text())["error"]["after"] is None
    assert "muslin add wind" in capsys.readouterr().out
    step("diagnose", lambda s: Result({"verdict": "no-misfit", "effects": []}))
    assert status("diagnose", str(study)) == 0
    assert "muslin add" not in capsys.readouterr().out


def test_all_that_was_named_is_added_by_the_next_command(
    step: Callable[..., None], study: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    step("diagnose", lambda s: Result({"verdict": "named", "effects": ["wind", "gravity-tilt"]}))
    assert status("diagnose", str(study)) == 0
    assert f"muslin add wind,gravity-tilt {study}" in capsys.readouterr().out
    step("diagnose", lambda s: Result({"verdict": "tied", "effects": ["wind", "gravity-tilt"], "further": ["hem"]}))
    assert status("diagnose", str(study)) == 0
    told = capsys.readouterr().out
    assert f"muslin add wind,hem {study}" in told and "add gravity" not in told
    for further, more in ((["hem", "lag"], True), ([], False)):  # which one is missing, too, another motion may tell
        found = {"verdict": "named", "effects": ["wind"], "further": further}
        step("diagnose", lambda s, found=found: Result(found))  # type: ignore[misc]
        assert status("diagnose", str(study)) == 0
        assert (f"muslin next {study}" in capsys.readouterr().out) is more


def test_a_missing_folder_is_told_before_anything_is_simulated(step: Callable[..., None], study: Path) -> None:
    ran: list[Study] = []
    step("diagnose", ran.append)
    assert status("diagnose", str(study), "--json", str(study.parent / "no" / "v.json")) == 2
    assert ran == []


def test_an_interrupted_fit_says_that_it_goes_on(
    step: Callable[..., None], study: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    def interrupted(s: Study) -> Result:
        raise KeyboardInterrupt

    step("fit", interrupted)
    assert status("fit", str(study)) == 130
    err = capsys.readouterr().err
    assert "goes on from what it has simulated" in err and len(err.splitlines()) == 1


def test_an_error_behind_an_error_is_the_one_told(
    step: Callable[..., None], study: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    def fails(s: Study) -> Result:
        try:
            raise InputError("the real reason")
        except InputError as error:
            raise RuntimeError("a worker failed") from error

    step("fit", fails)
    assert status("fit", str(study)) == 2
    assert capsys.readouterr().err == "muslin: error: the real reason\n"
    step("fit", lambda s: [][0])
    assert status("fit", str(study)) == INTERNAL
    err = capsys.readouterr().err
    assert "IndexError" in err and "--debug" in err and len(err.splitlines()) == 1


def test_what_the_operating_system_says() -> None:
    full = OSError(28, "No space left on device", "results.zarr")
    assert describe(full) == (
        "the disk is full (results.zarr); free some space and run the same command again",
        BAD_INPUT,
    )
    assert describe(PermissionError(13, "Permission denied", "s.toml"))[0] == "Permission denied (s.toml)"
    assert describe(MemoryError())[1] == BAD_INPUT


def test_add_writes_a_study_with_the_effect(study: Path, capsys: pytest.CaptureFixture[str]) -> None:
    second = study.with_name("study2.toml")
    assert status("add", "air-drag", str(study), "-o", str(second)) == 0
    assert read_config(second).effects == {"air-drag": {}}
    assert f"next: muslin fit {second}" in capsys.readouterr().out
    assert status("add", "air-drag", str(study), "-o", str(second)) == 2
    assert status("add", "air-drag", str(study), "-o", str(second), "--force") == 0
    assert status("add", "air-drag", str(second)) == 2
    capsys.readouterr()
    assert status("add", "law", str(study)) == 2  # no candidate
    assert f"then muslin add --law law.json {study}" in capsys.readouterr().err
    assert not study.with_name("study-with-law.toml").exists()


def test_add_writes_a_study_with_several_effects(study: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert status("add", "air-drag, hem", str(study)) == 0
    both = study.with_name("study-with-air-drag-and-hem.toml")
    assert read_config(both).effects == {"air-drag": {}, "hem": {}}
    assert "with air-drag and hem" in capsys.readouterr().out
    assert status("add", "wind,wind", str(study)) == 2 and "named twice" in capsys.readouterr().err
    assert status("add", "wind,hem", str(both)) == 2 and "has 'hem' already" in capsys.readouterr().err
    assert status("add", "wind,", str(study)) == 2
    with pytest.raises(InputError, match="of one effect"):
        Study.load(study).add(["wind", "hem"], coefficients={"velocity_x": 1.0})


def test_import_of_several_files(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("a", "b"):
        np.savez(tmp_path / f"{name}.npz", time=np.arange(5) * 0.1, points=np.random.default_rng(0).random((5, 2, 3)))
    files = [str(tmp_path / f"{n}.npz") for n in ("a", "b")]
    out = str(tmp_path / "m.zarr")
    assert status("import", *files, "-o", out, "--load", "0", "--load", "0.052", "--motion", "release") == 0
    got = load_measurement(tmp_path / "m.zarr")
    assert [(r.name, r.load, r.motion) for r in got.recordings] == [("a", 0.0, "release"), ("b", 0.052, "release")]
    assert "--scenario beam" in capsys.readouterr().out
    assert status("import", *files, "-o", out, "--force") == 0
    assert "next: muslin new" in (said := capsys.readouterr().out) and "--scenario fling" in said
    assert status("import", *files, "-o", out, "--force", "--load", "0", "--load", "1", "--load", "2") == 2
    assert "--load is given 3 times for 2 files" in capsys.readouterr().err
    assert status("import", *files, "-o", out, "--force", "--name", "x") == 2
    assert load_measurement(tmp_path / "m.zarr").names == ["a", "b"]


@pytest.mark.parametrize("arguments", [(), ("--vertices", "5,5")])
def test_new_writes_a_study_that_can_be_built(tmp_path: Path, arguments: tuple[str, ...]) -> None:
    measured = cloth_measurement()
    (tmp_path / "data").mkdir()
    save_measurement(measured, tmp_path / "data" / "m.zarr")
    path = tmp_path / "study.toml"
    given = ("--measurement", str(tmp_path / "data" / "m.zarr"), "--scenario", "fling", "--hold-out", "two")
    assert status("new", str(path), *given, *arguments) == 0
    config = read_config(path)
    assert config.study.measurement == "data/m.zarr"
    assert config.study.fit_on == ["one"] and config.study.hold_out == ["two"]
    problem = build_problem(config, measured)
    assert problem.space.names == ("stretch_stiffness", "bending_rigidity")
    scenario = problem.scenarios["one"]
    placed = scenario.markers @ scenario.world_vertices()
    # 3 mm of noise, and the nearest vertex is the one each marker was made on
    assert np.abs(placed - measured["one"].series.points[0]).max() < 0.02
    text = path.read_text()
    assert "[N/m]" in text or 'unit = "N/m"' in text
    assert "# drag_coefficient = 1.2" in text


def test_every_commented_line_of_a_new_study_is_right(tmp_path: Path) -> None:
    """Taking the # off a key, or a whole table, that is off by default leaves a study that can still be built."""
    measured = cloth_measurement((9, 9))
    save_measurement(measured, tmp_path / "m.zarr")
    path = tmp_path / "study.toml"
    assert status("new", str(path), "--measurement", str(tmp_path / "m.zarr"), "--scenario", "fling") == 0
    lines = path.read_text().splitlines()
    tried = set()
    for k, line in enumerate(lines):
        bare = line.removeprefix("# ")
        key = bare.split(" ")[0]
        if line == bare or not (bare.startswith("[") or (" = " in bare and key.replace("_", "").isalpha())):
            continue
        if key in ("mesh", "mesh_scale", "points", "marker_points") or 'kind = "mesh"' in bare:
            continue  # these need a file, or other points
        unit = {k}
        if key == "grasp_radius":
            unit.add(k - 1)
        while bare.startswith("[") and max(unit) + 1 < len(lines) and lines[max(unit) + 1].startswith("# "):
            unit.add(max(unit) + 1)
        path.write_text("\n".join(x.removeprefix("# ") if j in unit else x for j, x in enumerate(lines)))
        if key not in ("low", "high", "drag_coefficient"):  # of a table that is off
            build_problem(read_config(path), measured)
            tried.add(key)
    assert {"frame", "grasps", "grasp_points", "grasp_radius", "obstacles", "sd", "candidates"} <= tried
    assert {"[parameters.scale]", "[effects.air-drag]"} <= tried


def test_new_refuses_what_cannot_be(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    save_measurement(cloth_measurement(), tmp_path / "m.zarr")
    base = ("new", str(tmp_path / "s.toml"), "--measurement", str(tmp_path / "m.zarr"), "--scenario")
    for arguments, words in (
        (("flign",), "Did you mean 'fling'"),
        (("fling", "--hold-out", "three"), "it has one, two"),
        (("fling", "--fit-on", "one", "--hold-out", "one"), "both fitted on and held out"),
        (("fling", "--hold-out", "one,two"), "nothing is left to fit on"),
        (("fling", "--size", "big"), "--size must be numbers"),
        (("fling", "--markers", "somewhere"), "--markers must be"),
        (("fling", "--markers", "1,2"), "names 2 vertices"),
        (("beam",), "cannot be tied"),
    ):
        assert status(*base, *arguments) == 2
        assert words in capsys.readouterr().err
    assert status(*base[:-1]) == 2
    told = capsys.readouterr().err
    assert "--scenario NAME is missing" in told
    for name, its in PRESETS.items():
        assert f"  {name:7}  {its.about}\n" in told
    assert not (tmp_path / "s.toml").exists()


class Hollow:
    """Finds nothing."""


def test_plugins_says_what_each_is_and_of_others_whose(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(REGISTRY._objects, ("extractor", "hollow"), Hollow)
    assert status("plugins") == 0
    lines = [" ".join(line.split()) for line in capsys.readouterr().out.splitlines()]
    assert "cylinder-drag Drag of still air on a rope, per segment [rope]" in lines
    assert "hollow Finds nothing (this process)" in lines
    assert lines.index("extractors") < lines.index("effects")


def test_plugins_as_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert status("plugins", "--json") == 0
    rows = json.loads(capsys.readouterr().out)
    assert {"kind": "effect", "name": "wind"}.items() <= next(r for r in rows if r["name"] == "wind").items()


def test_check_passes_and_fails(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    assert status("check", "wind") == 0
    assert "0 failed" in capsys.readouterr().out
    monkeypatch.setitem(REGISTRY._objects, ("extractor", "hollow"), dict)
    assert status("check", "hollow") == 1
    assert "FAIL" in capsys.readouterr().out
    assert status("check", "fit") == 2
    assert "no conformance kit" in capsys.readouterr().err


def test_help_and_version(muslin: Muslin) -> None:
    done = muslin("--version")
    assert done.returncode == 0 and done.stdout.startswith("muslin ")
    overview = muslin().stdout
    for command in ("import", "new", "fit", "compare", "diagnose", "add", "report", "plugins", "check"):
        assert command in overview
    assert "in kg" in muslin("import", "--help").stdout
