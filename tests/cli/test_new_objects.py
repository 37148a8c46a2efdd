"""``muslin new`` for ropes and for objects of one's own."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from muslin.cli.main import run
from muslin.core.measurement import Measurement, Recording
from muslin.core.measurement_store import load_measurement, save_measurement
from muslin.core.motion import Motion
from muslin.core.registry import REGISTRY
from muslin.core.scenarios import preset
from muslin.core.scenarios.measured import MEASURED_NEAR, MEASURED_TAILS
from muslin.core.series import PointSeries
from muslin.core.study import build_problem, read_config

SHEET = "v -0.1 0 0\nv 0.1 0 0\nv 0 0 -0.1\nv -0.1 0 -0.2\nv 0.1 0 -0.2\nf 1 3 2\nf 1 4 3\nf 4 5 3\nf 5 2 3\n"


def status(*arguments: object) -> int:
    with pytest.raises(SystemExit) as caught:
        run([str(a) for a in arguments])
    return int(caught.value.code or 0)


def save(folder: Path, points: np.ndarray, motion: Motion) -> Path:
    series = PointSeries(np.linspace(0, 0.2, 5), np.tile(points, (5, 1, 1)))
    save_measurement(Measurement((Recording("one", series, motion),)), folder / "m.zarr")
    return folder / "m.zarr"


def test_a_rope(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Five markers along a cable: the study names their vertices, with sizes and units of a rope."""
    scenario = preset("cable").scenario(size=[0.8], vertices=[21])
    measurement = save(tmp_path, scenario.start_vertices()[::5], scenario.motion)
    path = tmp_path / "s.toml"
    options = ("--measurement", measurement, "--scenario", "cable", "--size", "0.8", "--vertices", "21")
    assert status("new", path, *options) == 0, capsys.readouterr().err
    text = path.read_text()
    for words in ("size = [0.8]  # length [m]", "vertices = [21]", "linear_density = 0.05  # [kg/m]", 'unit = "N m2"'):
        assert words in text
    config = read_config(path)
    assert config.scenario.markers == [0, 5, 10, 15, 20]
    assert build_problem(config, load_measurement(measurement), tmp_path).material.kind == "rope"


def from_end_to_end(count: int = 9) -> tuple[np.ndarray, Motion]:
    """Markers along a rope that sags, and the grippers at the outer ones."""
    x = np.linspace(0.0, 0.6, count)
    points = np.stack([x, 0 * x, 0.8 + 2.0 * (x - 0.3) ** 2], axis=1)
    return points, Motion.from_positions(np.zeros(1), points[None, [0, -1]])


def test_a_rope_that_is_seen_from_gripper_to_gripper_starts_as_measured(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    measurement = save(tmp_path, *from_end_to_end())
    path = tmp_path / "s.toml"
    assert status("new", path, "--measurement", measurement, "--scenario", "cable") == 0, capsys.readouterr().err
    assert "every take starts through its markers" in capsys.readouterr().out
    config = read_config(path)
    assert config.scenario.start == "measured" and config.scenario.size is None and config.scenario.markers is None
    assert config.simulator.options["time_step"] == REGISTRY.get("simulator", "mujoco").usual_steps["rope"]
    assert list(config.parameters) == ["bending_rigidity", "twist_rigidity", "damping_time"]
    problem = build_problem(config, load_measurement(measurement), tmp_path)
    middle = problem.space.as_dict(problem.space.from_unit(np.full(3, 0.5)))
    first = problem.simulate(middle, "one").series.points[0]
    assert np.abs(first - problem.recordings["one"].series.points[0]).max() < 0.002
    assert status("new", path, "--measurement", measurement, "--scenario", "cable", "--size", "0.8", "--force") == 0
    config = read_config(path)
    assert config.scenario.start is None


@pytest.mark.parametrize(
    ("axes", "signs", "said"),
    [
        ([0, 1, 2], 1.0, None),
        ([1, 2, 0], 1.0, "along -y, and z is taken to be up; import again with --up y if it is not"),
        ([0, 1, 2], -1.0, "along +z, and z is taken to be up; turn points and poses if it is not"),
    ],
)
def test_a_rope_that_does_not_sag_down_is_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], axes: list[int], signs: float, said: str | None
) -> None:
    points, motion = from_end_to_end(9)
    poses = motion.poses.copy()
    poses[..., :3] = signs * poses[..., axes]
    measurement = save(tmp_path, signs * points[:, axes], Motion(motion.times, poses))
    assert status("new", tmp_path / "s.toml", "--measurement", measurement, "--scenario", "cable") == 0
    printed = capsys.readouterr().out
    assert ("the rope sags by 0." in printed) == (said is not None) and (said or "") in printed


def test_markers_that_stand_beside_a_rope_are_said_to(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A rope of one length that bends more and more, with markers above it."""
    away, length = 0.012 * np.sin(np.linspace(0, np.pi, 9)), 0.6
    s, bends = np.linspace(0.0, length, 9), np.linspace(0.5, 4.0, 40)
    angle = bends[:, None] * (s - length / 2)  # of the tangent of a circle
    up = np.stack([-np.sin(angle), 0 * angle, np.cos(angle)], axis=2)
    axis = np.stack([np.sin(angle), 0 * angle, -np.cos(angle)], axis=2) / bends[:, None, None]
    points = axis + away[:, None] * up
    poses = np.zeros((len(bends), 2, 7))
    poses[..., :3], poses[..., 3] = points[:, [0, -1]], 1.0
    times = 0.1 * np.arange(len(bends))
    take = Recording("one", PointSeries(times, points), Motion(times, poses))
    save_measurement(Measurement((take, replace(take, name="two"))), tmp_path / "m.zarr")
    path = tmp_path / "s.toml"
    assert status("new", path, "--measurement", tmp_path / "m.zarr", "--scenario", "cable") == 0
    said = capsys.readouterr().out
    assert "mm beside the axis of the rope" in said
    away_said = float(said.split("the markers stand ")[1].split(" mm")[0])
    assert away_said == pytest.approx(1e3 * np.sqrt(np.mean(away**2)), rel=0.25)
    config = read_config(path)
    assert config.scenario.markers == "beside" and config.scenario.start == "measured"
    build_problem(config, load_measurement(tmp_path / "m.zarr"), tmp_path)


@pytest.mark.parametrize(
    ("noise", "lasts", "frames"), [(3e-5, 2.5, 200), (3e-5, 1.5, 200), (3e-5, 4.0, 30), (1e-3, 2.5, 200)]
)
def test_a_rope_that_is_seen_well_and_for_long_is_fitted_in_pieces(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], noise: float, lasts: float, frames: int
) -> None:
    points, motion = from_end_to_end(9)
    seen = points + np.random.default_rng(0).normal(0.0, noise, (frames, *points.shape))
    take = Recording("one", PointSeries(np.linspace(0, lasts, frames), seen), motion)
    save_measurement(Measurement((take, replace(take, name="two"))), tmp_path / "m.zarr")
    path = tmp_path / "s.toml"
    assert status("new", path, "--measurement", tmp_path / "m.zarr", "--scenario", "cable") == 0
    pieces = noise < 1e-3 and lasts > 2.0 and frames > 100
    assert read_config(path).study.window == (1.0 if pieces else None)
    assert ("fitted in pieces of 1 s" in capsys.readouterr().out) == pieces


@pytest.mark.parametrize("noise, near", [(3e-5, MEASURED_NEAR), (1e-3, None)])
def test_a_rope_that_is_seen_far_better_than_it_is_modelled_is_held_to_less(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], noise: float, near: float | None
) -> None:
    points, motion = from_end_to_end(9)
    seen = points + np.random.default_rng(0).normal(0.0, noise, (60, *points.shape))
    take = Recording("one", PointSeries(np.linspace(0, 0.6, 60), seen), motion)
    save_measurement(Measurement((take, replace(take, name="two"))), tmp_path / "m.zarr")
    path = tmp_path / "s.toml"
    assert status("new", path, "--measurement", tmp_path / "m.zarr", "--scenario", "cable") == 0
    told = read_config(path).noise
    assert (told.sd, told.tails) == ((near, MEASURED_TAILS) if near else (None, None))
    assert ("come within 5 mm ([noise] sd)" in capsys.readouterr().out) == (near is not None)


@pytest.mark.parametrize(
    ("fault", "said"),
    [
        ("hidden", "one: marker 4 is not seen in its first frame; import it from a later --start"),
        ("out of order", "one: its markers do not lead from the first gripper to the second one by one"),
        ("far from the grippers", "name those that do with --points (1 more as well)"),
        ("few", ""),
    ],
)
def test_a_rope_that_is_not_seen_whole_hangs_at_the_start(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], fault: str, said: str
) -> None:
    points, motion = from_end_to_end(5 if fault == "few" else 9)
    if fault == "out of order":
        points[[2, 6]] = points[[6, 2]]
    if fault == "far from the grippers":
        points += [0.0, 0.0, 0.1]
    series = PointSeries(np.linspace(0, 0.2, 5), np.tile(points, (5, 1, 1)))
    if fault == "hidden":
        series.points[0, 4] = np.nan
    takes = (
        Recording("one", series, motion),
        Recording("two", PointSeries(series.time, series.points[[1] * 5]), motion),
    )
    save_measurement(Measurement(takes), tmp_path / "m.zarr")
    path = tmp_path / "s.toml"
    assert status("new", path, "--measurement", tmp_path / "m.zarr", "--scenario", "cable") == 0
    assert read_config(path).scenario.start is None
    printed = capsys.readouterr().out
    assert said in printed and ("the rope hangs at the start" in printed) == bool(said)


def test_the_material_of_a_scenario_is_written(tmp_path: Path) -> None:
    scenario = preset("wiping").scenario(vertices=[3, 3])
    measurement = save(tmp_path, scenario.start_vertices(), scenario.motion)
    path = tmp_path / "s.toml"
    assert status("new", path, "--measurement", measurement, "--scenario", "wiping", "--vertices", "3,3") == 0
    text = path.read_text()
    assert "areal_density = 0.5" in text and "[parameters.friction]" in text
    assert '# obstacles = [{ kind = "table", height = 0.0, friction = 1.0 }]  # built in' in text


def test_a_mesh(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("trimesh")
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "sheet.obj").write_text(SHEET)
    corners = np.array([[-0.2, 0, 1.0], [0.2, 0, 1], [0, 0, 0.8], [-0.2, 0, 0.6], [0.2, 0, 0.6]])
    measurement = save(tmp_path, corners, Motion.from_positions(np.zeros(1), np.array([[[0, 0, 1.0]]])))
    path = tmp_path / "s.toml"
    base = ("new", path, "--measurement", measurement, "--scenario", "swing", "--mesh", tmp_path / "parts/sheet.obj")
    assert status(*base) == 2
    assert "say where it is held" in capsys.readouterr().err and not path.exists()
    assert status(*base, "--mesh-scale", "2", "--grasp-points", "-0.2,0,0; 0.2,0,0") == 2
    assert "2 grippers" in capsys.readouterr().err
    assert status(*base, "--mesh-scale", "2", "--grasp-points", "-0.2,0") == 2
    assert "--grasp-points must be x,y,z" in capsys.readouterr().err
    assert status(*base, "--size", "1,1", "--grasp-points", "-0.2,0,0") == 2
    assert "--size does not go with --mesh" in capsys.readouterr().err
    assert status(*base, "--mesh-scale", "-1", "--grasp-points", "-0.2,0,0") == 2
    assert "[scenario.mesh_scale]" in capsys.readouterr().err
    assert status(*base, "--mesh-scale", "2", "--grasp-points", "-0.2,0,0") == 0
    config = read_config(path)
    assert config.scenario.mesh == "parts/sheet.obj" and config.scenario.grasp_points == [(-0.2, 0.0, 0.0)]
    problem = build_problem(config, load_measurement(measurement), tmp_path)
    np.testing.assert_allclose(problem.scenarios["one"].start_vertices(), corners)
    np.testing.assert_allclose(problem.scenarios["one"].markers, np.eye(5))


def test_a_mesh_in_pieces_is_remarked_on(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("trimesh")
    corners, faces = SHEET.split("f", 1)
    apart = "v 0.4 0 0\nv 0.5 0 0\nv 0.4 0 -0.1\n"
    (tmp_path / "two.obj").write_text(f"{corners}{apart}f{faces}f 6 8 7\n")
    measurement = save(tmp_path, np.tile([0.0, 0.0, 0.9], (8, 1)), Motion.still())
    base = ("new", tmp_path / "s.toml", "--measurement", measurement, "--scenario", "swing")
    assert status(*base, "--mesh", tmp_path / "two.obj", "--grasp-points", "-0.1,0,0") == 0
    assert "2 parts that do not hang together" in capsys.readouterr().out


def test_a_cloud_is_held_against_the_surface(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scenario = preset("fling").scenario(vertices=[3, 3])
    rng = np.random.default_rng(0)
    cloud = rng.uniform(-0.1, 0.1, (5, 40, 3)) + scenario.start_vertices().mean(axis=0)
    series = PointSeries(np.linspace(0, 0.2, 5), cloud, correspondence=False)
    save_measurement(Measurement((Recording("one", series, scenario.motion),)), tmp_path / "m.zarr")
    path = tmp_path / "s.toml"
    options = ("--measurement", tmp_path / "m.zarr", "--scenario", "fling", "--vertices", "3,3")
    assert status("new", path, *options) == 0, capsys.readouterr().err
    assert "the 40 points are a cloud, held against the whole surface" in capsys.readouterr().out
    config = read_config(path)
    assert config.scenario.markers == "surface"
    made = build_problem(config, load_measurement(tmp_path / "m.zarr"), tmp_path).scenarios["one"]
    assert made.sampled and len(made.markers) == 1000
    assert status("new", path, *options, "--force", "--markers", "all") == 0
    made = build_problem(read_config(path), load_measurement(tmp_path / "m.zarr"), tmp_path).scenarios["one"]
    assert not made.sampled and len(made.markers) == 9
