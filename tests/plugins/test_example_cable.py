"""The cable example: every take starts through its markers, whatever shape it begins in."""

import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from published import ROOT, published

from muslin.core.body import rope_line
from muslin.core.dataset import DatasetNote
from muslin.core.material import RopeMaterial
from muslin.core.measurement import Measurement, Recording
from muslin.core.measurement_store import save_measurement
from muslin.core.motion import Motion
from muslin.core.registry import REGISTRY
from muslin.core.series import PointSeries
from muslin.core.study import Study, read_config, write_config
from muslin.inference.noise import Noise
from muslin.inference.roughness import Roughness
from muslin.inference.sequential import doubts

FOLDER = ROOT / "examples/cable"
FITTED = ("97", "104", "89", "66", "122")
NAMES = (*FITTED, "87", "49", "111", "51")


def measured(folder: Path, takes: list[Recording], window: float | None = None) -> Study:
    """The study of the example with these takes, in pieces of ``window`` [s] if that is given."""
    pytest.importorskip("mujoco")
    config = read_config(FOLDER / "study.toml")
    config.study.window = window
    write_config(config, folder / "study.toml")
    save_measurement(Measurement(tuple(takes)), folder / "cable1.zarr")
    return Study.load(folder / "study.toml", workers=0)


def bent(seed: int) -> Recording:
    """A cable of 1.04 m, 13 markers, bent sideways as no hanging one is, its ends moved a little."""
    places = np.random.default_rng(0).uniform(-0.01, 0.01, 9)  # of the markers: those of one cable
    s = np.linspace(-1.0, 1.0, 2001)
    curve = np.stack([0.4 * s, 0.08 * np.sin(2.5 * s + seed), 0.9 + 0.25 * s**2], axis=1)
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(curve, axis=0), axis=1))])
    curve *= 1.04 / along[-1]
    where = np.concatenate([[0.0, 0.02], np.linspace(0.1, 0.9, 9) + places, [0.98, 1.0]])
    points = np.stack([np.interp(where, along / along[-1], curve[:, k]) for k in range(3)], axis=1)
    time = np.linspace(0.0, 0.5, 51)
    sway = np.stack([0 * time, 0.05 * (1 - np.cos(6 * time)), 0 * time], axis=1)
    series = PointSeries(time, points + sway[:, None])
    ends = np.stack([points[0] + sway, points[-1] + sway], axis=1)
    return Recording(NAMES[seed], series, Motion.from_positions(time, ends))


def test_every_take_starts_where_it_was_measured(tmp_path: Path) -> None:
    study = measured(tmp_path, [bent(k) for k in range(len(NAMES))])
    for name, recording in study.problem.recordings.items():
        scenario = study.problem.scenarios[name]
        start = scenario.markers @ scenario.start_vertices()
        assert np.linalg.norm(start - recording.series.points[0], axis=1).max() < 0.002
        assert scenario.body.measures.sum() == pytest.approx(1.04, rel=0.005)
    moved = study.problem.simulate({"bending_rigidity": 1e-3, "twist_rigidity": 1e-3, "damping_time": 0.02}, "87")
    first = moved.series.points[0] - study.problem.recordings["87"].series.points[0]
    assert np.linalg.norm(first, axis=1).max() < 0.002  # as measured, nothing has relaxed yet
    ends = moved.series.points[:, [0, -1]] - study.problem.recordings["87"].series.points[:, [0, -1]]
    assert np.abs(ends).max() < 0.002  # held where the grippers are


def test_takes_that_are_fitted_can_be_cut_and_held_out_ones_stay_whole(tmp_path: Path) -> None:
    problem = measured(tmp_path, [bent(k) for k in range(len(NAMES))], 0.25).problem
    assert problem.fit_on[:2] == ("97 from 0 s", "97 from 0.25 s")
    assert len(problem.fit_on) == 2 * len(FITTED) and problem.hold_out == NAMES[5:]
    values = {"bending_rigidity": 1e-3, "twist_rigidity": 1e-3, "damping_time": 0.02}
    for name in ("97 from 0.25 s", "87"):
        recording = problem.recordings[name].series
        made = problem.simulate(values, name).series
        np.testing.assert_array_equal(made.time, recording.time)
        assert np.linalg.norm(made.points[0] - recording.points[0], axis=1).max() < 0.002


def test_a_piece_knows_how_the_rope_was_bent_before(tmp_path: Path) -> None:
    problem = measured(tmp_path, [bent(k) for k in range(len(NAMES))], 0.25).problem
    scenarios = problem.scenarios
    assert scenarios["97 from 0 s"].earlier is None and scenarios["87"].earlier is None
    piece = scenarios["97 from 0.25 s"]
    whole = problem.recordings["97 from 0 s"].series
    assert piece.earlier is not None and len(piece.earlier) == len(whole.time[::3])
    seen = whole.points[::3]
    np.testing.assert_allclose(piece.earlier[:, 0], seen[:, 0], atol=0.0005)
    assert np.linalg.norm(np.einsum("mv,tvx->tmx", piece.markers, piece.earlier) - seen, axis=2).max() < 0.002
    coarse = replace(
        piece,
        body=rope_line(np.array([[0.0, 0.0, 0.0], [1.04, 0.0, 0.0]]), 21),
        grasps=(np.array([0, 1]), np.array([19, 20])),
        markers=np.eye(21),
        load_vertices=np.zeros(0, np.int64),
    )
    scene = coarse.scene(RopeMaterial(bending_rigidity=1e-3), np.zeros(3))
    np.testing.assert_allclose(scene.earlier, piece.earlier[:, ::2])


@pytest.mark.parametrize("window", [None, 0.25])
def test_a_fit_that_is_left_to_chance_says_that_pieces_would_help(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, window: float | None
) -> None:
    study = measured(tmp_path, [bent(k) for k in range(len(NAMES))], window)
    lasts = 0.5  # so that pieces are its halves
    chaos = {name: np.ones(r.series.frames) for name, r in study.problem.recordings.items()}
    monkeypatch.setattr(doubts, "roughness", lambda *_: Roughness(chaos, chaos, chaos))
    with study.pool() as pool:
        said = doubts.doubts(pool, study.problem.space, np.full(3, 0.5), Noise(0.005, 0.0, "test", "m", 0.01))
    (chaotic,) = (sentence for sentence in said if "chaotic" in sentence)
    assert (f"[study] window = {lasts / 2}" in chaotic) == (window is None)


def test_the_real_takes_of_the_example_are_there_and_can_be_simulated(tmp_path: Path) -> None:
    path = published("cable/cable1.npz")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DatasetNote)
        takes = REGISTRY.get("dataset", "deform-cable")(path, list(NAMES))
    study = measured(tmp_path, takes)
    assert (*study.problem.fit_on, *study.problem.hold_out) == NAMES
    made = study.problem.simulate(
        {"bending_rigidity": 1e-3, "twist_rigidity": 1e-3, "damping_time": 0.02}, "87"
    ).series.points
    difference = made - study.problem.recordings["87"].series.points
    assert np.linalg.norm(difference[0], axis=1).max() < 0.002
    assert np.nanmean(np.abs(difference)) < 0.02  # metres
