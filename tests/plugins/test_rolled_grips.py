"""Takes in which a rope is turned in its grippers, which do not say so: what its markers tell of that."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("mujoco")

from muslin.backends.mujoco import MujocoSimulator
from muslin.core.arrays import FloatArray
from muslin.core.beside import Beside, Natural, bent_by, closing_angles, untwisted_frames
from muslin.core.body import rope_line
from muslin.core.material import RopeMaterial
from muslin.core.measurement import Measurement, Recording
from muslin.core.measurement_store import save_measurement
from muslin.core.motion import Motion, rolled
from muslin.core.rollout import rollout
from muslin.core.scenario import Scenario
from muslin.core.scenarios.standoffs import told_standoffs
from muslin.core.series import PointSeries
from muslin.core.study import Study
from muslin.inference.sequential.doubts import rope_turned

MATERIAL = RopeMaterial(0.05, 2000.0, bending_rigidity=2e-3, twist_rigidity=2e-3, damping_time=0.02)
BEFORE, LONG = 2.0, 4.0
TIME = np.arange(0.0, BEFORE + LONG, 0.01)
ROLLS = {"a": (0.0, 0.0), "b": (0.9, 0.0), "c": (-0.8, 0.3), "d": (0.5, -0.4), "e": (-0.4, 0.2), "f": (0.7, 0.3)}
FITTED = ("a", "b", "c", "d")


def bent() -> FloatArray:
    """At rest the rope is a hoop that leaves its plane ``(31, 3)`` [m], its ends straight."""
    angle = np.concatenate([[0.0], np.linspace(0.0, 2.6, 29), [2.6]])
    along = np.stack([np.cos(angle), 0.4 * np.sin(2 * angle), -np.sin(angle)], axis=1)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    return np.concatenate([np.zeros((1, 3)), np.cumsum(0.03 * along[:-1], axis=0)])


@cache
def take(name: str) -> Recording:
    """The grippers turn the rope before the recording starts, and are recorded as if they had not."""
    body = rope_line(bent(), 31)
    rng = np.random.default_rng(list(ROLLS).index(name))
    ramp = np.clip(TIME, 0.0, 1.0)
    poses = np.zeros((len(TIME), 2, 7))
    poses[..., 3] = 1.0
    late = np.maximum(TIME - BEFORE + 0.3, 0.0)
    swing = 0.2 * np.sin(2 * np.pi * np.outer(late, rng.uniform(0.3, 0.8, 3)))
    poses[:, :, :3] = body.vertices[[0, -1]]
    poses[:, 1, :3] += swing
    ends = np.diff(body.vertices, axis=0)[[0, -1]]
    axes = ends / np.linalg.norm(ends, axis=1, keepdims=True)
    turned = np.stack([rolled(p, axes, np.array(ROLLS[name]) * r) for p, r in zip(poses, ramp, strict=True)])
    held = (np.array([0, 1]), np.array([29, 30]))
    markers = np.eye(31)[[0, 1, 4, 7, 10, 13, 16, 19, 22, 25, 28, 29, 30]]
    scenario = Scenario("bent", body, held, Motion(TIME, turned), TIME, markers, np.zeros(0, np.int64))
    vertices = rollout(MujocoSimulator(time_step=0.0025), scenario, MATERIAL).vertices
    angle = 1.3 * np.array([0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 10])
    rest, start = body.vertices[None], poses[:1]
    frames = untwisted_frames(rest, start)
    kept = Natural(np.linspace(0.0, 1.0, 31)[1:-1], bent_by(rest, frames[:, :, 0], frames[:, :, 1])[0][0])
    offsets = 0.012 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    beside = Beside(offsets, float(closing_angles(rest, start)[0]), kept)
    seen = TIME >= BEFORE
    points = (markers @ vertices + beside.shifts(vertices, turned, markers))[seen]
    noise = np.random.default_rng(7).normal(0.0, 3e-5, points.shape)
    time = TIME[seen] - BEFORE
    return Recording(name, PointSeries(time, points + noise), Motion(time, poses[seen]))


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("rolled")
    save_measurement(Measurement(tuple(take(name) for name in ROLLS)), folder / "rope.zarr")
    (folder / "study.toml").write_text(
        '[study]\nmeasurement = "rope.zarr"\nfit_on = ["a", "b", "c", "d"]\nhold_out = ["e", "f"]\n\n'
        '[scenario]\nname = "cable"\nvertices = [31]\nstart = "measured"\nmarkers = "beside"\n\n'
        '[simulator]\nname = "mujoco"\ntime_step = 0.0025\n\n[effects.rest-curvature]\n'
    )
    return folder / "study.toml"


@pytest.mark.parametrize(("until", "near"), [(np.inf, 0.08), (0.3, 0.2)])
def test_markers_tell_how_a_rope_is_turned_in_its_grippers(until: float, near: float) -> None:
    """Also those of takes that were not fitted; what all have in common is where the markers stand."""
    told = told_standoffs([take(name) for name in FITTED])
    assert told.beside.natural is not None
    off = told.rolls([take(name) for name in ROLLS], until) - np.array(list(ROLLS.values()))
    assert np.std(off, axis=0).max() < near  # where the rolls themselves have 0.61 and 0.24


def test_simulations_start_so_and_a_fit_says_it(path: Path) -> None:
    problem = Study.load(path).problem
    for name, scenario in problem.scenarios.items():
        until = np.inf if name in FITTED else 0.3
        (rolled_by,) = told_standoffs([take(n) for n in FITTED]).rolls([take(name)], until)
        said, done = (m.at(TIME[:1])[0, :, 3:] for m in (take(name).gripper, scenario.motion) if m is not None)
        turned = 2.0 * np.arccos(np.abs(np.sum(said * done, axis=1)).clip(max=1.0))
        np.testing.assert_allclose(turned, np.abs(rolled_by), atol=5e-3)
    (sentence,) = rope_turned(problem)
    first, second = (float(part.split(" rad")[0].split()[-1]) for part in sentence.split(" in the ")[:2])
    true = np.array([ROLLS[name] for name in FITTED])
    np.testing.assert_allclose([first, second], np.std(true, axis=0), atol=0.15)


def test_a_rope_without_markers_beside_it_is_not_spoken_of(path: Path) -> None:
    text = path.read_text().replace('markers = "beside"\n', "")
    (path.parent / "on-the-axis.toml").write_text(text)
    assert rope_turned(Study.load(path.parent / "on-the-axis.toml").problem) == []
