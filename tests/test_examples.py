"""The examples: their studies resolve, and the recording in the repository is what its script makes."""

import os
import runpy
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from muslin.core.measurement_store import load_measurement, read_hidden
from muslin.core.series import PointSeries
from muslin.core.study import Study

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"


def test_the_hidden_effect_recording_is_what_its_script_makes(tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    folder = EXAMPLES / "hidden_effect"
    again = tmp_path / "again.zarr"
    subprocess.run([sys.executable, str(folder / "make_recording.py"), "-o", str(again)], check=True, cwd=tmp_path)
    made, kept = load_measurement(again), load_measurement(folder / "recording.zarr")
    assert made.names == kept.names
    assert read_hidden(again) == read_hidden(folder / "recording.zarr")
    for name in made.names:
        np.testing.assert_allclose(made[name].series.points, kept[name].series.points, atol=1e-6)


def test_the_hidden_effect_study_resolves() -> None:
    pytest.importorskip("mujoco")
    problem = Study.load(EXAMPLES / "hidden_effect/study.toml").problem
    assert problem.fit_on == ("fling", "swing") and problem.hold_out == ("fling-wide",)
    assert problem.space.names == ("stretch_stiffness", "bending_rigidity")


def test_the_beam_is_imported_and_its_study_resolves(tmp_path: Path) -> None:
    """With the very command that the demo runs; the model's markers start where the real ones do."""
    pytest.importorskip("mujoco")
    pytest.importorskip("ezc3d")
    shutil.copy(EXAMPLES / "beam/study.toml", tmp_path)
    demo = runpy.run_path(str(EXAMPLES / "demo.py"))
    demo["import_beam"](tmp_path)
    study = Study.load(tmp_path / "study.toml")
    assert sorted(study.measurement.names) == sorted(name for _, name, *_ in demo["BEAM"])
    for name, recording in study.problem.recordings.items():
        scenario = study.problem.scenarios[name]
        start = scenario.markers @ scenario.world_vertices()
        np.testing.assert_allclose(start, recording.series.points[0], atol=1e-6)
        assert np.ptp(recording.series.points[:, :, 2], axis=0).min() > 0.005  # it was let go


def test_a_beam_that_is_let_go_falls_at_first_as_if_nothing_hung_on_it(tmp_path: Path) -> None:
    """All takes slow down within 50 ms, as the bare beam does; one whose load pulls from the start falls ever faster.

    So no model of the beam that is told the load alone can meet the first tenth of a second.
    """
    pytest.importorskip("mujoco")
    pytest.importorskip("ezc3d")
    shutil.copy(EXAMPLES / "beam/study.toml", tmp_path)
    runpy.run_path(str(EXAMPLES / "demo.py"))["import_beam"](tmp_path)
    problem = Study.load(tmp_path / "study.toml").problem
    for name, recording in problem.recordings.items():
        assert 0.2 < slowing(recording.series) < 0.8
        pulled = slowing(problem.simulate({"youngs_modulus": 264e3}, name).series)
        assert pulled > 1.1 if name.startswith("load") else 0.2 < pulled < 0.8


def slowing(series: PointSeries) -> float:
    """Speed of the tip in the fourth hundredth of a second after it has fallen by 3 mm, over that in the first two."""
    fallen = series.points[0, :, 2].mean() - series.points[:, :, 2].mean(axis=1)
    begin = float(np.interp(0.003, fallen[:5], series.time[:5]))
    way = np.diff(np.interp(begin + 0.01 * np.arange(5), series.time, fallen))
    return float(way[3] / way[:2].mean())


def test_an_engine_that_is_not_there_is_one_line() -> None:
    done = subprocess.run(
        [sys.executable, str(EXAMPLES / "own_mesh/swing.py"), "mujco"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 1
    assert "no simulator 'mujco'" in done.stderr and "Traceback" not in done.stderr


@pytest.mark.parametrize("engine", ["mujoco", pytest.param("pybullet", marks=pytest.mark.slow)])
def test_the_shirt_is_what_its_script_makes_and_swings(
    engine: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip(engine)
    pytest.importorskip("trimesh")
    folder = EXAMPLES / "own_mesh"
    for name in ("shirt.obj", "study.toml"):
        shutil.copy(folder / name, tmp_path)
    runpy.run_path(str(folder / "make_shirt.py"))["main"](tmp_path / "again.obj")
    assert (tmp_path / "again.obj").read_text() == (folder / "shirt.obj").read_text()
    runpy.run_path(str(folder / "swing.py"))["main"](engine, str(tmp_path / "recording.zarr"))
    assert f"{engine}: 145 vertices" in capsys.readouterr().out
    study = Study.load(tmp_path / "study.toml")
    scenario = study.problem.scenarios["swing"]
    assert len(scenario.grasps) == 1 and len(scenario.grasps[0]) == 6  # the seams of both shoulders
    np.testing.assert_allclose(study.measurement["swing"].series.points[0, scenario.grasps[0], 2], 1.0, atol=1e-6)
    study.problem.simulator.check(scenario.scene(study.problem.material, np.array([0.0, 0.0, -9.8])))


def recordings(*arguments: str, data: str = "") -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(EXAMPLES / "recordings.py"), *arguments]
    return subprocess.run(command, capture_output=True, text=True, env={**os.environ, "MUSLIN_DATA": data})


def test_recordings_that_are_not_there_are_one_line(tmp_path: Path) -> None:
    out = str(tmp_path / "out")
    for done, said in (
        (recordings("cable", "-o", out), "set MUSLIN_DATA to the folder that it is in"),
        (recordings("carried_cloth", "-o", out, data=str(tmp_path)), f"there is no {tmp_path / 'cloth_carried'}"),
        (recordings("balls", "--study", "rugby.toml", "-o", out), "there is no rugby.toml"),
        (recordings("balls", "-o", str(tmp_path)), "is there already; remove it"),
    ):
        assert done.returncode == 1 and said in done.stderr and "Traceback" not in done.stderr
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_recordings_become_a_report(tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    done = recordings("balls", "--study", "bowling.toml", "-o", str(tmp_path / "out"))
    assert done.returncode == 0, done.stderr
    assert "$ muslin import" in done.stdout and (tmp_path / "out/report.html").stat().st_size > 10_000


@pytest.mark.slow
def test_what_the_hidden_effect_study_hides_is_named(tmp_path: Path) -> None:
    """The demo's own cloth, by fewer draws, of the two candidates that are nearest; the demo itself takes all."""
    pytest.importorskip("mujoco")
    shutil.copytree(EXAMPLES / "hidden_effect/recording.zarr", tmp_path / "recording.zarr")
    shutil.copy(EXAMPLES / "hidden_effect/study.toml", tmp_path)
    hidden = read_hidden(tmp_path / "recording.zarr")
    study = Study.load(tmp_path / "study.toml", workers=0)
    study.config.estimator.rounds, study.config.estimator.draws, study.config.diagnose.draws = 1, 32, 6
    study.config.diagnose.candidates = ["air-drag", "viscous-damping"]
    study.fit()
    result = study.diagnose().result
    assert (result["verdict"], result["effects"]) == ("named", [hidden["effect"]])
    for name, found in result["candidates"][0]["coefficients"].items():
        assert abs(found["mean"] - hidden["coefficients"][name]) < 4 * found["sd"]
    assert result["error"]["after"] < 1.1 * result["error"]["noise"]
