"""Points that are a grid over a cloth, as ``muslin new`` sees it."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from typer.testing import CliRunner

from muslin.cli.gridding import seen_grid
from muslin.cli.main import app
from muslin.core.arrays import FloatArray
from muslin.core.measurement import Measurement, Recording
from muslin.core.measurement_store import save_measurement
from muslin.core.motion import Motion
from muslin.core.series import PointSeries
from muslin.core.study import Study, read_config


def sheet(across: int, down: int, width: float, height: float, frames: int = 30, seed: int = 0) -> FloatArray:
    """A hanging cloth that swings on its top edge and is bent across, row by row from the top ``(T, P, 3)`` [m]."""
    rng = np.random.default_rng(seed)
    u, v = np.meshgrid(np.linspace(-width / 2, width / 2, across), np.linspace(0, height, down))
    swing = 0.5 * np.sin(np.linspace(0, 6, frames))[:, None]
    bend = 0.6 / width
    x = np.sin(bend * u.ravel()) / bend + 0 * swing
    y = v.ravel() * np.sin(swing) + (1 - np.cos(bend * u.ravel())) / bend
    z = -v.ravel() * np.cos(swing)
    return np.stack([x, y, z], axis=2) + 0.002 * rng.normal(size=(frames, across * down, 3))


def take(points: FloatArray, name: str = "one") -> Recording:
    return Recording(name, PointSeries(0.05 * np.arange(len(points)), points), Motion.still(1), motion=name)


@given(st.integers(3, 12), st.integers(3, 12), st.floats(0.4, 1.5), st.floats(0.8, 1.25))
def test_a_grid_is_seen_as_it_is(across: int, down: int, width: float, shape: float) -> None:
    height = shape * width * (down - 1) / (across - 1)
    points = sheet(across, down, width, height)
    points[3:9, ::5] = np.nan
    grid = seen_grid([take(points[:20]), take(points[20:], "two")])
    assert grid is not None
    assert [(n - 1) // grid.every + 1 for n in grid.counts] == [across, down] and min(grid.counts) >= 8
    assert "vertex along both sides" in grid.text(sized=True)
    np.testing.assert_allclose(grid.size, [width, height], rtol=0.05)
    marked = np.arange(np.prod(grid.counts)) if grid.markers == "all" else np.array(grid.markers)
    places = np.stack(np.divmod(marked, grid.counts[0]), axis=1)
    np.testing.assert_array_equal(places, grid.every * np.stack(np.divmod(np.arange(across * down), across), axis=1))


@pytest.mark.parametrize("seed", range(5))
def test_points_without_order_are_no_grid(seed: int) -> None:
    shuffled = np.random.default_rng(seed).permutation(64)
    assert seen_grid([take(sheet(8, 8, 0.3, 0.3)[:, shuffled])]) is None
    assert seen_grid([take(sheet(61, 1, 0.3, 0.0))]) is None  # as many as no grid has
    cloud = PointSeries(0.05 * np.arange(30), sheet(8, 8, 0.3, 0.3), correspondence=False)
    assert seen_grid([Recording("cloud", cloud)]) is None


def new(folder: Path, points: FloatArray, *arguments: str) -> str:
    save_measurement(Measurement((take(points), take(points, "two"))), folder / "m.zarr")
    store = str(folder / "m.zarr")
    given = ["new", str(folder / "study.toml"), "--measurement", store, "--scenario", "carry", "--hold-out", "two"]
    done = CliRunner().invoke(app, [*given, *arguments])
    assert done.exit_code == 0, done.output
    return " ".join(done.output.split())


def test_a_tracked_grid_is_laid_over_the_mesh(tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    even = sheet(8, 9, 0.42, 0.48)
    said = new(tmp_path, even)
    assert "the 72 points are a grid of 8 x 9 on every vertex along both sides, of a cloth of 0.4" in said
    config = read_config(tmp_path / "study.toml").scenario
    assert config.vertices == [8, 9] and config.markers == "all" and config.spacing is None
    np.testing.assert_allclose(config.size or [], [0.42, 0.48], rtol=0.03)
    problem = Study.load(tmp_path / "study.toml").problem
    scenario = problem.scenarios["one"]
    first = problem.recordings["one"].series.points[0]
    assert np.abs(scenario.markers @ scenario.start_vertices() - first).max() < 0.05  # it is bent, the model hangs flat


def test_a_grid_that_is_pulled_in_is_placed_by_its_distances(tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    points = sheet(8, 8, 0.3, 0.3)
    grid = points.reshape(-1, 8, 8, 3)
    for line, inner in ((0, 1), (7, 6)):  # the outer lines, almost a fifth of a step
        grid[:, :, line] += (grid[:, :, inner] - grid[:, :, line]) * 0.19
        grid[:, line] += (grid[:, inner] - grid[:, line]) * 0.19
    said = new(tmp_path, points, "--size", "0.3,0.3")
    assert "mm from the even places that they are given" in said and "of a cloth of" not in said
    assert read_config(tmp_path / "study.toml").scenario.spacing == "measured"


@pytest.mark.parametrize("case", ["rows", "columns", "turned", "size", "told"])
def test_what_a_person_says_or_another_order_comes_first(tmp_path: Path, case: str) -> None:
    pytest.importorskip("mujoco")
    points, arguments = sheet(8, 8, 0.3, 0.3), {"size": ("--size", "0.5,0.5"), "told": ("--vertices", "9,9")}
    if case == "rows":  # from the bottom edge
        points = points.reshape(-1, 8, 8, 3)[:, ::-1].reshape(points.shape)
    if case == "columns":  # one column after the other
        points = points.reshape(-1, 8, 8, 3).swapaxes(1, 2).reshape(points.shape)
    if case == "turned":
        points = points.reshape(-1, 8, 8, 3).swapaxes(1, 2)[:, ::-1].reshape(points.shape)
    said = new(tmp_path, points, *arguments.get(case, ()))
    assert "are a grid of" not in said
    assert ("are a grid over 0.3" in said and "check --size" in said) == (case == "size")
    assert read_config(tmp_path / "study.toml").scenario.vertices != [8, 8]


def test_a_first_frame_that_shows_nothing_claims_no_grid(tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    points = sheet(8, 8, 0.3, 0.3)
    points[0] = np.nan
    save_measurement(Measurement((take(points),)), tmp_path / "m.zarr")
    given = ["new", str(tmp_path / "s.toml"), "--measurement", str(tmp_path / "m.zarr"), "--scenario", "carry"]
    done = CliRunner().invoke(app, given)
    assert "are a grid of" not in done.output and "not seen in the first frame" in " ".join(str(done.exception).split())
