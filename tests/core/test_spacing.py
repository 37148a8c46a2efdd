"""Where the markers of a sheet sit, told by their distances."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from muslin.core.arrays import FloatArray
from muslin.core.body import Body, cloth_grid
from muslin.core.errors import InputError
from muslin.core.measurement import Measurement, Recording
from muslin.core.measurement_store import save_measurement
from muslin.core.motion import Motion, rotate
from muslin.core.scenario import marker_weights
from muslin.core.scenarios.spacing import told_places
from muslin.core.series import PointSeries
from muslin.core.study import Study
from muslin.inference.sequential.doubts import markers_elsewhere

SIZE, LINES = 0.3, 8


def sheet() -> Body:
    return cloth_grid(SIZE, SIZE, LINES, LINES)


def bent(flat: FloatArray, frames: int, seed: int, noise: float = 0.0) -> FloatArray:
    """Places ``(M, 2)`` of a sheet that is rolled onto cylinders of every direction, and turned: ``(T, M, 3)``."""
    rng = np.random.default_rng(seed)
    out = np.empty((frames, len(flat), 3))
    for k in range(frames):
        angle, curvature = rng.uniform(0, np.pi), rng.uniform(0.2, 8.0)
        axes = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
        s, u = (flat @ axes.T).T
        rolled = np.stack([np.sin(curvature * s) / curvature, u, (1 - np.cos(curvature * s)) / curvature], axis=1)
        turn = rng.normal(size=4)
        out[k] = rotate(turn / np.linalg.norm(turn), rolled) + rng.normal(size=3)
    return out + noise * rng.normal(size=out.shape)


def seen(points: FloatArray, name: str = "take") -> Recording:
    return Recording(name, PointSeries(0.1 * np.arange(len(points)), points), Motion.still(1))


def pulled_in(flat: FloatArray, by: float = 0.012) -> FloatArray:
    """A grid whose corners a tracker pulls in, each coordinate by so much [m]."""
    half = np.abs(flat).max(axis=0)
    return flat - np.sign(flat) * by * (np.abs(flat) / half) ** 4 * ((np.abs(flat) / half) ** 4)[:, ::-1]


def flat_of(body: Body) -> FloatArray:
    middle = body.vertices - body.vertices.mean(axis=0)
    return middle[:, np.ptp(middle, axis=0) > 0]


@pytest.mark.parametrize("seed", range(3))
def test_markers_are_found_where_they_sit(seed: int) -> None:
    body = sheet()
    true = pulled_in(flat_of(body))
    assert np.linalg.norm(true - flat_of(body), axis=1).max() > 0.016
    points = bent(true, 60, seed, noise=0.003)
    points[np.random.default_rng(seed).random(points.shape[:2]) < 0.2] = np.nan
    told = told_places(body, np.eye(LINES**2), [seen(points[:20]), seen(points[20:])])
    off = np.linalg.norm(told @ flat_of(body) - true, axis=1)
    assert off.max() < 0.004 and off.mean() < 0.0015


@given(st.integers(0, 10**6))
def test_no_motion_of_the_whole_tells_anything(seed: int) -> None:
    """Markers that sit where they are said to are told to sit there, and weights are shares of a triangle."""
    body, rng = sheet(), np.random.default_rng(seed)
    ids = rng.choice(LINES**2, 20, replace=False)
    turns = rng.normal(size=(12, 1, 4))
    rigid = rotate(turns / np.linalg.norm(turns, axis=2, keepdims=True), body.vertices[ids][None])
    told = told_places(body, marker_weights(LINES**2, ids), [seen(rigid + rng.normal(size=(12, 1, 3)))])
    np.testing.assert_allclose(told @ body.vertices, body.vertices[ids], atol=1e-9)
    assert (told >= 0).all() and (np.count_nonzero(told > 1e-12, axis=1) <= 3).all()
    np.testing.assert_allclose(told.sum(axis=1), 1.0)


def test_a_marker_beside_the_sheet_sits_at_its_edge() -> None:
    body = sheet()
    told = told_places(body, np.eye(LINES**2), [seen(bent(1.1 * flat_of(body), 20, 0))])
    half = np.abs(flat_of(body)).max(axis=0)
    assert (np.abs(told @ flat_of(body)) <= half + 1e-12).all()
    corner = int(np.argmax(flat_of(body).sum(axis=1)))
    np.testing.assert_allclose((told @ flat_of(body))[corner], half, atol=1e-9)


def test_a_sliver_of_the_mesh_and_a_single_marker_do_no_harm() -> None:
    body = sheet()
    with_sliver = Body("cloth", body.vertices, np.concatenate([body.elements, [[0, 1, 2]]]))
    take = [seen(bent(flat_of(body), 20, 0))]
    np.testing.assert_allclose(told_places(with_sliver, np.eye(64), take), told_places(body, np.eye(64), take))
    with pytest.raises(InputError, match="no pair of them is seen"):
        told_places(body, np.eye(64)[:1], [seen(bent(flat_of(body), 20, 0)[:, :1])])


def test_what_tells_nothing_is_refused() -> None:
    body, points = sheet(), bent(flat_of(sheet()), 20, 0)
    eye = np.eye(LINES**2)
    with pytest.raises(InputError, match="no pair of them is seen in 10 frames of take"):
        told_places(body, eye, [seen(points[:9])])
    with pytest.raises(InputError, match="64 of them here, but recording 'take' has 63"):
        told_places(body, eye, [seen(points[:, 1:])])
    cloud = Recording("cloud", PointSeries(0.1 * np.arange(20), points, correspondence=False), Motion.still(1))
    with pytest.raises(InputError, match="'cloud' has 64 without correspondence"):
        told_places(body, eye, [cloud])
    rolled = Body("cloth", bent(flat_of(body), 1, 0)[0], body.elements)
    with pytest.raises(InputError, match="this is a cloth of another shape; leave it out"):
        told_places(rolled, eye, [seen(points)])


@pytest.mark.parametrize(("told", "pulled"), [("all", True), ("all", False), ("spaced", True)])
def test_a_fit_tells_of_markers_that_sit_elsewhere(tmp_path: Path, told: str, pulled: bool) -> None:
    pytest.importorskip("mujoco")
    scenario = {"all": 'markers = "all"', "spaced": 'spacing = "measured"'}
    problem = Study.load(study(tmp_path, scenario[told])).problem
    flat, take = flat_of(sheet()), problem.recordings["a"]
    true = pulled_in(flat, 0.03) if pulled else flat
    measured = replace(take, series=replace(take.series, points=bent(true, 30, 5, noise=0.002)))
    problem = replace(problem, recordings={**problem.recordings, "a": measured})
    plain = SimpleNamespace(series=PointSeries(take.series.time, bent(flat, 30, 6)))  # it does something else
    said = markers_elsewhere(problem, {"a": plain})  # type: ignore[dict-item]
    if told != "all" or not pulled:
        assert said == []
        return
    (text,) = said
    away = np.linalg.norm(true - flat, axis=1)
    worst = float(text.split("marker")[-1].split(" mm;")[0].split()[-1])
    assert worst == pytest.approx(1e3 * away.max(), abs=2.0)
    assert 'spacing = "measured" places them' in text


def study(folder: Path, scenario: str) -> Path:
    true = pulled_in(flat_of(sheet()))
    save_measurement(
        Measurement((seen(bent(true, 30, 0), "a"), seen(bent(0.8 * true, 30, 1), "b"))), folder / "sheet.zarr"
    )
    (folder / "study.toml").write_text(
        '[study]\nmeasurement = "sheet.zarr"\nfit_on = ["a"]\nhold_out = ["b"]\n\n[scenario]\nname = "carry"\n'
        f"size = [{SIZE}, {SIZE}]\nvertices = [{LINES}, {LINES}]\n{scenario}\n\n"
        '[simulator]\nname = "mujoco"\n'
    )
    return folder / "study.toml"


def test_a_study_tells_from_what_is_fitted_alone(tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    problem = Study.load(study(tmp_path, 'markers = "all"\nspacing = "measured"')).problem
    for name in ("a", "b"):  # the held-out one shows a smaller sheet
        scenario = problem.scenarios[name]
        placed = (scenario.markers @ scenario.body.vertices)[:, [0, 2]]
        placed = placed - placed.mean(axis=0)
        apart = np.linalg.norm(placed[:, None] - placed[None], axis=2)
        true = pulled_in(flat_of(sheet()))
        np.testing.assert_allclose(apart, np.linalg.norm(true[:, None] - true[None], axis=2), atol=0.002)


@pytest.mark.parametrize("markers", ["bound", "surface"])
def test_a_study_says_what_spacing_goes_with(tmp_path: Path, markers: str) -> None:
    with pytest.raises(InputError, match=f"not markers = '{markers}'; keep one of the two"):
        Study.load(study(tmp_path, f'markers = "{markers}"\nspacing = "measured"'))


def test_a_size_is_told_once(tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    path = study(tmp_path, 'spacing = "measured"')
    path.write_text(path.read_text() + "\n[parameters.scale]\nlow = 0.9\nhigh = 1.1\n")
    with pytest.raises(InputError, match=r"does not go with \[parameters\.scale\]; leave one of them out"):
        _ = Study.load(path).problem
