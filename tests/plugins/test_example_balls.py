"""The falling balls: meshes are what their script makes, studies resolve, and heights alone can be compared."""

import runpy
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from muslin.core.measurement import Measurement
from muslin.core.measurement_store import save_measurement
from muslin.core.registry import REGISTRY
from muslin.core.study import Study

pytestmark = pytest.mark.filterwarnings("ignore::muslin.core.dataset.DatasetNote")
FOLDER = Path(__file__).resolve().parents[2] / "examples/balls"
#: Diameter [m], mass [kg] and height [m] of every study's ball.
BALLS = {
    "whiffle": (0.073, 0.0198, 47.2),
    "tennis": (0.067, 0.058, 47.3),
    "volleyball": (0.21, 0.27, 48.3),
    "bowling": (0.218, 6.4, 46.5),
    "golf": (0.0427, 0.0459, 47.5),
}


def study_of(ball: str, folder: Path) -> Study:
    for name in (f"{ball}.toml", f"{ball}.vtk"):
        (folder / name).write_bytes((FOLDER / name).read_bytes())
    takes = REGISTRY.get("dataset", "balls")(FOLDER / "drops.csv", [])
    save_measurement(Measurement(tuple(takes)), folder / "balls.zarr", overwrite=True)
    return Study.load(folder / f"{ball}.toml", workers=0)


@pytest.mark.parametrize("ball", sorted(BALLS))
def test_the_study_resolves_to_a_ball_of_the_right_mass(ball: str, tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    pytest.importorskip("meshio")
    diameter, mass, height = BALLS[ball]
    arguments = ["--diameter", str(diameter), "--mass", str(mass), "--height", str(height), "-o", "again.vtk"]
    command = [sys.executable, str(FOLDER / "make_ball.py"), *arguments]
    subprocess.run(command, cwd=tmp_path, check=True, capture_output=True)
    assert (tmp_path / "again.vtk").read_text() == (FOLDER / f"{ball}.vtk").read_text()
    problem = study_of(ball, tmp_path).problem
    scenario = problem.scenarios[problem.fit_on[0]]
    assert scenario.body.measures.sum() * problem.material.density == pytest.approx(mass, rel=0.002)
    np.testing.assert_allclose(scenario.markers @ scenario.world_vertices(), [[0.0, 0.0, height]], atol=1e-6)


def test_the_mesh_is_as_large_from_below_as_the_ball() -> None:
    vertices, cells = runpy.run_path(str(FOLDER / "make_ball.py"))["ball"](0.2, 10.0)
    p = vertices[cells[:, 1:]]
    level = 0.5 * np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])[:, 2]
    assert np.abs(level).sum() / 2 == pytest.approx(np.pi * 0.2**2 / 4)
    assert level.sum() == pytest.approx(0.0, abs=1e-12)  # closed


def test_drag_on_a_falling_ball_is_that_of_its_cross_section(tmp_path: Path) -> None:
    """Terminal velocity sqrt(2 m g / (rho C_D A)): the closed form of a fall with quadratic drag."""
    pytest.importorskip("mujoco")
    pytest.importorskip("meshio")
    diameter, mass, height = BALLS["whiffle"]
    problem = study_of("whiffle", tmp_path).problem
    problem = replace(problem, effects={"air-drag": REGISTRY.get("effect", "air-drag")})
    name = problem.fit_on[0]
    values = {"youngs_modulus": 3e5, "air-drag.drag_coefficient": 0.5, "air-drag.lift_coefficient": 0.0}
    fallen = height - problem.simulate(values, name).series.points[:, 0, 2]
    t = problem.recordings[name].series.time
    t = t - t[0]
    g = 9.80665
    terminal = np.sqrt(2 * mass * g / (1.204 * 0.5 * np.pi * diameter**2 / 4))
    exact = terminal**2 / g * np.log(np.cosh(g * t / terminal))
    np.testing.assert_allclose(fallen, exact, atol=0.01 * exact[-1])


@pytest.mark.slow
def test_the_air_is_found_on_a_whiffle_ball_and_not_on_a_bowling_ball(tmp_path: Path) -> None:
    pytest.importorskip("torch")
    pytest.importorskip("mujoco")
    pytest.importorskip("meshio")
    light, heavy = study_of("whiffle", tmp_path), study_of("bowling", tmp_path)
    light.fit()
    assert light.compare().rows[0].rmse > 1.0  # metres
    found = light.diagnose().result
    assert found["verdict"] in ("named", "tied") and set(found["effects"]) <= {"air-drag", "viscous-damping"}
    assert found["error"]["after"] < 0.3 < 1.0 < found["error"]["before"]
    heavy.fit()
    assert heavy.diagnose().result["verdict"] == "no-misfit"


@pytest.mark.slow
def test_the_law_of_drag_on_a_tennis_ball_is_left_open(tmp_path: Path) -> None:
    """Two drops tell the noise to a fifth only; linear and quadratic drag are both within what it may be."""
    pytest.importorskip("torch")
    pytest.importorskip("mujoco")
    pytest.importorskip("meshio")
    study = study_of("tennis", tmp_path)
    study.fit()
    found = study.diagnose().result
    assert found["verdict"] == "tied" and set(found["effects"]) == {"air-drag", "viscous-damping"}
