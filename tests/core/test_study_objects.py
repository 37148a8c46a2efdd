"""``[scenario]`` with objects and obstacles of one's own, ropes, frames and grasps."""

import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from muslin.core.errors import InputError, MuslinError
from muslin.core.material import RopeMaterial
from muslin.core.measurement import Measurement, Recording
from muslin.core.measurement_store import save_measurement
from muslin.core.motion import Motion
from muslin.core.obstacles import Cylinder, StaticMesh, Table
from muslin.core.registry import REGISTRY
from muslin.core.series import PointSeries
from muslin.core.study import Problem, Study, build_problem, parse_config, read_config, write_config
from muslin.core.testing.reference import ReferenceSimulator

pytest.importorskip("trimesh")

#: A sheet of four triangles around its middle, hanging in the x-z plane.
SHEET = "v -0.1 0 0\nv 0.1 0 0\nv 0 0 -0.1\nv -0.1 0 -0.2\nv 0.1 0 -0.2\nf 1 3 2\nf 1 4 3\nf 4 5 3\nf 5 2 3\n"
TURN = [np.cos(np.pi / 4), 0.0, 0.0, np.sin(np.pi / 4)]  # a quarter about z


@pytest.fixture(autouse=True)
def reference_engine(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(REGISTRY._objects, ("simulator", "reference"), ReferenceSimulator)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "sheet.obj").write_text(SHEET)
    (tmp_path / "rope.csv").write_text("x,y,z\n0,0,0\n0.1,0,0\n0.1,0,-0.3\n")
    return tmp_path


def measured(points: int, gripper: Motion | None = None) -> Measurement:
    seen = np.tile(np.random.default_rng(0).normal(size=(points, 3)), (3, 1, 1))
    return Measurement((Recording("a", PointSeries(np.linspace(0, 0.1, 3), seen), gripper),))


def built(folder: Path, points: int, gripper: Motion | None = None, **scenario: Any) -> Problem:
    top = {k: scenario.pop(k) for k in ("material", "parameters") if k in scenario}
    table = {"study": {"measurement": "m.zarr"}, "scenario": scenario, "simulator": {"name": "reference"}, **top}
    return build_problem(parse_config(table, "study.toml"), measured(points, gripper), folder)


def complaint(folder: Path, points: int = 5, gripper: Motion | None = None, **scenario: Any) -> str:
    with pytest.raises(MuslinError) as caught:
        built(folder, points, gripper, **scenario)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_poses_of_too_few_grippers_are_told_with_their_recording(folder: Path) -> None:
    said = complaint(folder, 41, Motion.still(1), name="cable")
    assert "'cable' holds the object with 2 grippers, but recording 'a' has poses of 1; import the poses of all" in said


def test_a_mesh_of_ones_own(folder: Path) -> None:
    problem = built(folder, 5, name="swing", mesh="sheet.obj", mesh_scale=2.0, grasp_points=[[-0.2, 0, 0]])
    scenario = problem.scenarios["a"]
    assert problem.material.kind == "cloth" and len(scenario.body.vertices) == 5
    assert [g.tolist() for g in scenario.grasps] == [[0]]
    np.testing.assert_allclose(scenario.start_vertices()[2], [0, 0, 0.8])


def test_grasps_by_points(folder: Path) -> None:
    def held(**table: Any) -> list[list[int]]:
        scenario = built(folder, 5, name="swing", mesh="sheet.obj", **table).scenarios["a"]
        return [g.tolist() for g in scenario.grasps]

    bar = [[[-0.1, 0, 0], [0.1, 0.01, 0]]]
    assert held(grasp_points=bar) == [[0, 1]]
    assert held(grasp_points=[[0, 0, -0.05]], grasp_radius=0.12) == [[0, 1, 2]]
    assert held(grasps=[[3, 4]]) == [[3, 4]]
    far = complaint(folder, name="swing", mesh="sheet.obj", grasp_points=[[0, 0, 3.0]])
    assert "[0.0, 0.0, 3.0] of gripper 0 is 3" in far and "lies between [-0.1, 0.0, -0.2]" in far
    assert "say where it is held" in complaint(folder, name="swing", mesh="sheet.obj")
    assert "keep one of them" in complaint(folder, name="swing", grasps=[[0]], grasp_points=[[0, 0, 0]])
    assert "goes with grasp_points" in complaint(folder, name="swing", grasp_radius=0.1)


@pytest.mark.parametrize(
    ("frame", "first"), [("gripper", (1, 1.9, 3)), ("upright", (0.9, 2, 3)), ("world", (-0.1, 0, 0))]
)
def test_the_frame_of_an_object(folder: Path, frame: str, first: tuple[float, ...]) -> None:
    gripper = Motion(np.zeros(1), np.array([[[1.0, 2, 3, *TURN]]]))
    problem = built(folder, 5, gripper, name="swing", mesh="sheet.obj", grasps=[[0]], frame=frame)
    np.testing.assert_allclose(problem.scenarios["a"].start_vertices()[0], first, atol=1e-12)


def test_what_does_not_go_together(folder: Path) -> None:
    assert "size does not go with a mesh" in complaint(folder, name="swing", mesh="sheet.obj", size=[1.0, 1.0])
    assert "mesh_scale says how to take a mesh" in complaint(folder, name="swing", mesh_scale=2.0)
    assert "one number, not [3, 3]" in complaint(folder, name="swing", mesh="sheet.obj", vertices=[3, 3])
    assert "is for ropes" in complaint(folder, name="swing", mesh="sheet.obj", straight_rest=True, grasps=[[0]])
    assert "there is no mesh" in complaint(folder, name="swing", mesh="nix.obj")
    assert "holds a rope, but sheet.obj is a cloth" in complaint(folder, name="cable", mesh="sheet.obj")


def test_a_measured_start_takes_nothing_that_it_would_ignore(folder: Path) -> None:
    def refused(**table: Any) -> str:
        return complaint(folder, name="cable", start="measured", **table)

    told = refused(size=[1.05], markers="all", frame="world")
    assert "[scenario] start = 'measured' takes the rope, its length and its markers" in told
    assert "leave size, markers, frame out" in told
    assert "leave mesh out" in refused(mesh="rope.csv")
    assert "settle = 0.5 s would take it away from there; leave settle out" in refused(settle=0.5)
    assert "name the held vertices with grasps" in refused(grasp_points=[[0, 0, 0]])
    assert "parameters.scale does not go with" in refused(parameters={"scale": {"low": 0.9, "high": 1.1}})
    assert "only a rope" in complaint(folder, name="fling", start="measured", settle=0.0)


def test_a_rope_from_a_file(folder: Path) -> None:
    curved = built(folder, 9, name="swing", mesh="rope.csv", vertices=[9]).scenarios["a"]
    np.testing.assert_allclose(curved.start_vertices()[-1], [0.1, 0, 0.7])
    assert [g.tolist() for g in curved.grasps] == [[0]]
    problem = built(folder, 9, name="swing", mesh="rope.csv", vertices=[9], straight_rest=True)
    straight = problem.scenarios["a"]
    np.testing.assert_allclose(straight.start_vertices(), curved.start_vertices(), atol=1e-12)
    np.testing.assert_allclose(straight.body.edge_lengths(straight.body.vertices), curved.body.measures)
    np.testing.assert_allclose(np.ptp(straight.body.vertices[:, 1:], axis=0), 0.0, atol=1e-12)
    grown = straight.start_vertices(1.5)
    np.testing.assert_allclose(np.linalg.norm(np.diff(grown, axis=0), axis=1), 1.5 * curved.body.measures)
    assert isinstance(problem.material, RopeMaterial)
    assert problem.space.units == ("N m2", "N")


@pytest.mark.parametrize("held", [0, 4, 8])
def test_a_rope_that_is_scaled_stays_in_its_gripper(folder: Path, held: int) -> None:
    table = {"name": "swing", "mesh": "rope.csv", "vertices": [9], "grasps": [[held]]}
    for straight in (False, True):
        scenario = built(folder, 9, straight_rest=straight, **table).scenarios["a"]
        np.testing.assert_allclose(scenario.start_vertices(1.5)[held], scenario.start_vertices()[held], atol=1e-12)


def test_the_material_and_the_priors_of_a_scenario(folder: Path) -> None:
    thick = built(folder, 9, name="wiping", vertices=[3, 3], material={"areal_density": 0.7})
    assert (thick.material.areal_density, thick.material.stretch_stiffness) == (0.7, 2000.0)  # type: ignore[union-attr]
    assert thick.space.names == ("stretch_stiffness", "bending_rigidity", "friction")
    mine = built(folder, 9, name="wiping", vertices=[3, 3], parameters={"friction": {"low": 0.1, "high": 0.5}})
    assert mine.space.names == ("friction",)


def test_effects_are_for_some_kinds(folder: Path) -> None:
    table = {
        "study": {"measurement": "m.zarr"},
        "scenario": {"name": "cable", "vertices": [9]},
        "simulator": {"name": "reference"},
        "effects": {"air-drag": {}},
    }
    with pytest.raises(MuslinError, match=r"\[effects.air-drag\] is for cloth and solid, but this is a rope"):
        build_problem(parse_config(table, "s"), measured(9), folder)


def test_grippers_further_apart_than_the_rope_is_long(folder: Path) -> None:
    def gripped(apart: float) -> Motion:
        return Motion.from_positions(np.zeros(1), np.array([[[0.0, 0, 1], [apart, 0, 1]]]))

    cable = {"name": "cable", "size": [0.5], "vertices": [9]}
    wrong = complaint(folder, 9, gripped(0.8), **cable)
    assert "stretched to 1.6 times" in wrong and "0.8 m apart, but the rope is 0.5 m long" in wrong
    bounds = {"scale": {"low": 0.8, "high": 1.2}}
    assert "at scale 0.8" in complaint(folder, 9, gripped(0.45), parameters=bounds, **cable)
    assert built(folder, 9, gripped(0.45), **cable)


def test_obstacles(folder: Path) -> None:
    box = "\n".join(f"v {x} {y} {z}" for x in (0, 100) for y in (0, 100) for z in (0, 100))
    sides = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    faces = "\n".join(f"f {a + 1} {b + 1} {c + 1}" for p, q, r, s in sides for a, b, c in ((p, q, r), (p, r, s)))
    (folder / "box.obj").write_text(f"{box}\n{faces}\n")
    given = [
        {"kind": "table", "height": -1.0, "friction": 0.5},
        {"kind": "cylinder", "center": [0, 0, -0.5], "axis": [0, 2, 0], "radius": 0.1, "length": 0.3},
        {"kind": "mesh", "file": "box.obj", "scale": 0.001, "position": [0, 0, -0.5]},
    ]
    found = built(folder, 9, name="swing", vertices=[3, 3], obstacles=given).scenarios["a"].obstacles
    assert [type(o) for o in found] == [Table, Cylinder, StaticMesh]
    assert isinstance(found[2], StaticMesh) and found[2].volume == pytest.approx(1e-3)
    np.testing.assert_allclose(found[2].vertices.min(axis=0), [0, 0, -0.5])

    def refused(**obstacle: Any) -> str:
        return complaint(folder, 9, name="swing", vertices=[3, 3], obstacles=[obstacle])

    assert "[scenario.obstacles.0.table.heigth] is not a key here. Did you mean 'height'?" in refused(
        kind="table", height=0.0, heigth=1.0
    )
    assert "[scenario.obstacles.0.table.height] is missing" in refused(kind="table")
    assert "no obstacle of kind 'ball'. Kinds: table, cylinder, mesh" in refused(kind="ball")
    assert "there is no mesh" in refused(kind="mesh", file="nix.stl")
    assert "must be closed" in refused(kind="mesh", file="sheet.obj")
    assert "cannot start like this: the object is" in refused(kind="table", height=0.85)


def test_without_a_built_in_obstacle(folder: Path) -> None:
    assert built(folder, 9, name="wiping", vertices=[3, 3]).scenarios["a"].obstacles == (Table(0.0),)
    assert not built(folder, 9, name="wiping", vertices=[3, 3], obstacles=[]).scenarios["a"].obstacles
    assert "needs a cylinder" in complaint(folder, 9, name="winding", vertices=[9], obstacles=[])


def test_an_effect_that_is_no_candidate_is_added_with_its_coefficients_alone(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    wide = type("Wide", (REGISTRY.get("effect", "wind"),), {"name": "wide", "candidate": False})
    monkeypatch.setitem(REGISTRY._objects, ("effect", "wide"), wide)
    save_measurement(measured(5), folder / "m.zarr")
    scenario = {"name": "swing", "mesh": "sheet.obj", "grasps": [[0]]}
    table = {"study": {"measurement": "m.zarr"}, "scenario": scenario, "simulator": {"name": "reference"}}
    study = Study(parse_config(table, "s"), folder / "study.toml")
    with pytest.raises(InputError, match=r"'wide' must be told which of its coefficients to infer"):
        study.add("wide")
    assert not list(folder.glob("*.toml"))
    added = study.add("wide", coefficients={"velocity_x": 0.0})
    assert "wide.velocity_y" in added.problem.space.names and "wide.velocity_x" not in added.problem.space.names
    assert "gravity-strength.excess" in study.add("gravity-strength").problem.space.names  # one leaves no choice


def test_paths_start_at_the_study_file_and_results_at_the_content(
    folder: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    save_measurement(measured(5), folder / "m.zarr")
    text = {"name": "swing", "mesh": "parts/sheet.obj", "grasps": [[0]]}
    (folder / "parts").mkdir()
    shutil.move(folder / "sheet.obj", folder / "parts" / "sheet.obj")
    path = folder / "study.toml"
    table = {"study": {"measurement": "m.zarr"}, "scenario": text, "simulator": {"name": "reference"}}
    write_config(parse_config(table, "s"), path)
    assert read_config(path) == parse_config(table, "s")
    study = Study.load(path)
    assert len(study.problem.scenarios["a"].body.vertices) == 5
    before = study.fingerprint()
    elsewhere = tmp_path_factory.mktemp("elsewhere") / "more.toml"
    assert len(study.add("wind", elsewhere).problem.scenarios["a"].body.vertices) == 5
    (folder / "parts" / "sheet.obj").write_text(SHEET.replace("-0.2", "-0.21"))
    assert Study.load(path).fingerprint() != before


def test_points_that_are_followed_are_not_held_against_the_surface(folder: Path) -> None:
    told = complaint(folder, name="swing", mesh="sheet.obj", grasp_points=[[-0.1, 0, 0]], markers="surface")
    assert "is for clouds" in told and "'a' follows its points" in told
