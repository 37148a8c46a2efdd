"""``muslin next`` in this process, with a step that stands in for the real one, and as the one that is installed."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from running import cloth_measurement
from test_commands import status

pytest.importorskip("scipy")
pytest.importorskip("torch")
pytest.importorskip("mujoco")

from muslin.core.importing.gripper import read_gripper_csv, to_motion
from muslin.core.measurement_store import save_measurement
from muslin.core.motion import Motion
from muslin.core.registry import REGISTRY
from muslin.core.study import Study
from muslin.inference.criticism.next.step import NextExperiment, propose_next

MOTION = Motion.from_positions(np.arange(5) / 100, np.linspace(0, 0.01, 10).reshape(5, 2, 1) * np.ones(3))


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """What the step was asked; it proposes :data:`MOTION`, or nothing for less than 50 simulations."""
    given: dict[str, Any] = {}

    def step(study: Study, **options: Any) -> NextExperiment:
        given.update(options, workers=study.workers)
        motion = MOTION if options["simulations"] >= 50 else None
        said = ("Tied now: a, b.", "Proposed: a swing.")
        return NextExperiment({"purpose": "tied", "probability": 0.5}, said, motion)

    monkeypatch.setitem(REGISTRY._objects, ("step", "next"), step)
    return given


def test_it_says_what_to_record_and_writes_it_for_a_robot(
    asked: dict[str, Any], study: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, table = study.with_name("motion.csv"), study.with_name("next.json")
    box = ("-0.1", "0.2", "-0.3", "0.4", "0", "0.5")
    arguments = ["--effects", "wind", "air-drag", "--out", str(out), "--json", str(table), "--workspace", *box]
    assert status("next", str(study), *arguments, "--max-speed", "1.5", "--duration", "3", "--workers", "1") == 0
    said = capsys.readouterr().out
    assert "Tied now: a, b.\nProposed: a swing." in said and f"wrote {out}" in said and "next: muslin" in said
    assert asked["effects"] == ("wind", "air-drag") and asked["workspace"] == (-0.1, 0.2, -0.3, 0.4, 0.0, 0.5)
    assert asked["max_speed"] == 1.5 and asked["duration"] == 3.0 and asked["max_turn"] is None
    assert asked["simulations"] == 400 and asked["workers"] == 1
    assert json.loads(table.read_text()) == {"purpose": "tied", "probability": 0.5}
    assert out.read_text().startswith("time,gripper,x,y,z,qw,qx,qy,qz\n")
    np.testing.assert_allclose(to_motion(read_gripper_csv(out, ""), "m", "z", "").poses, MOTION.poses, atol=1e-9)


def test_what_was_written_goes_with_a_recording_of_it(asked: dict[str, Any], study: Path, tmp_path: Path) -> None:
    out = study.with_name("motion.csv")
    assert status("next", str(study), "--out", str(out)) == 0
    points = tmp_path / "points.csv"
    rows = [f"{t},{p},0.0,{p},1.0" for t in MOTION.times for p in (0, 1)]
    points.write_text("time,point,x,y,z\n" + "\n".join(rows) + "\n")
    assert status("import", str(points), "-o", str(tmp_path / "new.zarr"), "--gripper", str(out)) == 0


def test_a_file_that_is_there_is_kept_and_nothing_is_written_where_nothing_is_proposed(
    asked: dict[str, Any], study: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = study.with_name("motion.csv")
    out.write_text("mine")
    assert status("next", str(study), "--out", str(out)) == 2
    assert not asked and out.read_text() == "mine" and "--force" in capsys.readouterr().err
    assert status("next", str(study), "--out", str(out), "--force", "--simulations", "40") == 0
    assert out.read_text() == "mine" and "is not written" in capsys.readouterr().out


def test_two_files_are_not_written_to_one_place(
    asked: dict[str, Any], study: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = study.with_name("next.json")
    same = f"{study.parent}/../{study.parent.name}/next.json"
    assert status("next", str(study), "--out", str(out), "--json", same) == 2
    assert not asked and not out.exists() and "name two" in capsys.readouterr().err


def test_a_study_that_was_not_fitted_or_limits_that_cannot_be_are_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert REGISTRY.get("step", "next") is propose_next
    save_measurement(cloth_measurement(), tmp_path / "m.zarr")
    path = tmp_path / "study.toml"
    path.write_text(
        '[study]\nmeasurement = "m.zarr"\n[scenario]\nname = "fling"\nvertices = [3, 3]\n[simulator]\nname = "mujoco"\n'
    )
    for more, said in (
        ((), "muslin fit"),
        (("--max-speed", "-1"), "above zero"),
        (("--workspace", "1", "2", "0", "0", "0", "0"), "x0"),
    ):
        assert status("next", str(path), *more) == 2
        error = capsys.readouterr().err
        assert said in error and len(error.strip().splitlines()) == 1
