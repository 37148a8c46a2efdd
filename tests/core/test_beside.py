"""Markers that stand beside the axis of a rope: frames, the way there and back, and what bends tell of them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from muslin.core.arrays import FloatArray
from muslin.core.beside import Beside, rope_frames
from muslin.core.errors import InputError
from muslin.core.material import RopeMaterial
from muslin.core.measurement import Measurement, Recording
from muslin.core.measurement_store import save_measurement
from muslin.core.motion import Motion, inverse, multiply, rolled, rotate
from muslin.core.scenarios import preset
from muslin.core.scenarios.kept import told_bend
from muslin.core.scenarios.measured import measured_start
from muslin.core.scenarios.standoffs import told_standoffs
from muslin.core.series import PointSeries
from muslin.core.study import Study
from muslin.inference.sequential.doubts import markers_beside

FINE, LENGTH = 800, 1.0
PLACES = np.array([0.0, 0.03, 0.13, 0.23, 0.32, 0.42, 0.52, 0.61, 0.70, 0.80, 0.88, 0.965, 1.0])
X, Z = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])


def quaternion(axes: FloatArray) -> FloatArray:
    """Of rotations whose columns are ``axes (T, 3, 3)``."""
    w = 0.5 * np.sqrt(np.maximum(1.0 + np.trace(axes, axis1=1, axis2=2), 1e-12))
    v = np.stack([axes[:, 2, 1] - axes[:, 1, 2], axes[:, 0, 2] - axes[:, 2, 0], axes[:, 1, 0] - axes[:, 0, 1]], axis=1)
    return np.concatenate([w[:, None], v / (4 * w[:, None])], axis=1)


def rope(frames: int, seed: int, turn: float = 0.0) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Axes of an unstretched rope that bends and is twisted evenly, clamped straight at both ends.

    Returns:
        Curves ``(T, FINE + 1, 3)``, material axes ``(T, FINE + 1, 2, 3)`` and gripper poses ``(T, 2, 7)``.
    """
    rng = np.random.default_rng(seed)
    s, step = np.linspace(0.0, LENGTH, FINE + 1), LENGTH / FINE
    free = (s > 0.035) & (s < 0.96)
    time = np.linspace(0.0, 1.0, frames)[:, None]
    bends = []
    for k in range(2):
        waves = [
            rng.normal(0, 1.5)
            * np.sin(2 * np.pi * rng.uniform(0.5, 2) * time + rng.uniform(0, 6))
            * np.cos(n * np.pi * s)
            for n in range(3)
        ]
        bends.append(free * (sum(waves) + (2.5 if k == 0 else 0.0)))
    twist = 0.6 * np.sin(5 * time[:, 0] + seed)  # of the whole rope [rad]
    t, e = (np.tile(v, (frames, 1)) for v in (X, Z))
    f, x = np.cross(t, e), np.zeros((frames, 3))
    curve, axes = np.empty((frames, FINE + 1, 3)), np.empty((frames, FINE + 1, 2, 3))
    for k in range(FINE + 1):
        share = (twist * s[k] / LENGTH)[:, None]
        curve[:, k] = x
        axes[:, k, 0], axes[:, k, 1] = np.cos(share) * e + np.sin(share) * f, np.cos(share) * f - np.sin(share) * e
        about = step * (bends[0][:, k : k + 1] * axes[:, k, 1] - bends[1][:, k : k + 1] * axes[:, k, 0])
        size = np.linalg.norm(about, axis=1, keepdims=True)
        spin = np.concatenate([np.cos(size / 2), np.sin(size / 2) * about / np.maximum(size, 1e-15)], axis=1)
        x = x + 0.5 * step * t
        t, e, f = rotate(spin, t), rotate(spin, e), rotate(spin, f)
        x = x + 0.5 * step * t
    ends = []
    for k, sign, roll in ((0, 1.0, 0.0), (FINE, -1.0, turn)):
        along = sign * np.cross(axes[:, k, 0], axes[:, k, 1])
        up = np.cos(roll) * axes[:, k, 0] + np.sin(roll) * axes[:, k, 1]
        turned = quaternion(np.stack([along, np.cross(up, along), up], axis=2))
        ends.append(np.concatenate([curve[:, k], turned], axis=1))
    return curve, axes, np.stack(ends, axis=1)


def markers(curve: FloatArray, axes: FloatArray, offsets: FloatArray) -> FloatArray:
    at = np.rint(PLACES * FINE).astype(int)
    return np.asarray(curve[:, at] + np.einsum("ma,tmax->tmx", offsets, axes[:, at]))


def offsets(seed: int) -> FloatArray:
    made = np.random.default_rng(seed).normal(0.0, 0.01, (len(PLACES), 2))
    made[0], made[-1] = made[1], made[-2]
    return made


def recording(
    seed: int, beside: FloatArray, turn: float = 0.0, noise: float = 0.0, rolls: tuple[float, float] = (0.0, 0.0)
) -> Recording:
    """A take in which the rope is turned in its grippers by ``rolls`` beyond what their poses say."""
    curve, axes, poses = rope(60, seed, turn)
    poses = rolled(poses, np.array([X, -X]), -np.array(rolls))  # the second's x axis points against the rope
    points = markers(curve, axes, beside)
    points = points + np.random.default_rng(seed).normal(0.0, noise, points.shape)
    time = 0.1 * np.arange(60)
    return Recording(f"take{seed}", PointSeries(time, points), Motion(time, poses))


@pytest.mark.parametrize("turn", [0.0, 2.0])
def test_frames_are_those_of_the_material(turn: float) -> None:
    curve, axes, poses = rope(40, 3, turn)
    found = rope_frames(curve, poses, turn)
    np.testing.assert_allclose(found, axes, atol=0.01)
    np.testing.assert_allclose(
        np.einsum("tvax,tvbx->tvab", found, found), np.broadcast_to(np.eye(2), (*found.shape[:2], 2, 2)), atol=1e-9
    )
    at = np.rint(PLACES * FINE).astype(int)
    np.testing.assert_allclose(
        Beside(offsets(1), turn).frames(curve[:, at], poses)[:, 2:-2], axes[:, at][:, 2:-2], atol=0.12
    )


def test_frames_turn_with_the_rope() -> None:
    curve, _, poses = rope(5, 4)
    spin = np.array([np.cos(0.4), 0.0, np.sin(0.4), 0.0])
    turned = np.concatenate([rotate(spin, poses[..., :3]), multiply(spin, poses[..., 3:])], axis=-1)
    again = rope_frames(rotate(spin, curve), turned, 0.3)
    np.testing.assert_allclose(rotate(inverse(spin), again), rope_frames(curve, poses, 0.3), atol=1e-9)


def test_from_the_markers_to_the_axis_and_back() -> None:
    curve, axes, poses = rope(30, 5)
    beside = Beside(offsets(1), 0.0)
    seen = markers(curve, axes, beside.offsets)
    weights = np.zeros((len(PLACES), FINE + 1))
    weights[np.arange(len(PLACES)), np.rint(PLACES * FINE).astype(int)] = 1.0
    np.testing.assert_allclose(weights @ curve + beside.shifts(curve, poses, weights), seen, atol=2e-4)
    seen[7, 4] = np.nan
    axis = beside.axis(seen, poses)
    assert np.isnan(axis[7]).all()
    axis, at = np.delete(axis, 7, axis=0), np.delete(weights @ curve, 7, axis=0)
    assert np.sqrt(np.mean(np.sum((axis - at) ** 2, axis=2))) < 0.0015  # of 14 mm beside
    np.testing.assert_allclose(Beside(0 * offsets(1), 0.0).axis(at, np.delete(poses, 7, axis=0)), at, atol=1e-12)


@pytest.mark.parametrize("turn", [0.0, 2.5])
def test_bends_tell_where_markers_stand(turn: float) -> None:
    true = offsets(2)
    found = told_standoffs([recording(k, true, turn, noise=1e-4) for k in (6, 7, 8)]).beside
    off = np.angle(np.exp(1j * (found.turn - turn)))
    assert abs(off) < 0.1  # the twist of the takes has no mean of exactly zero
    assert np.sqrt(np.mean((found.offsets - true) ** 2)) < 0.004  # of 10 mm


def test_a_frame_with_two_markers_at_one_place_tells_nothing() -> None:
    take, true = recording(6, offsets(2)), offsets(2)
    take.series.points[20, 5] = take.series.points[20, 4]
    found = told_standoffs([take, recording(7, true)]).beside
    assert np.sqrt(np.mean((found.offsets - true) ** 2)) < 0.004


def test_distances_tell_how_a_rope_is_turned_in_its_grippers() -> None:
    true = offsets(2)
    given = {6: (0.0, 0.0), 7: (-0.9, 0.2), 8: (0.7, -0.3), 9: (0.3, 0.6), 10: (-0.1, -0.5)}
    takes = {k: recording(k, true, noise=1e-4, rolls=r) for k, r in given.items()}
    told = told_standoffs(list(takes.values()))
    # what all takes have in common is where the markers stand
    for until, near in ((np.inf, 0.1), (0.3, 0.3)):
        found = told.rolls(list(takes.values()), until)
        off = found - np.array(list(given.values()))
        assert np.abs(off - off.mean(axis=0)).max() < near
    angles = []
    for k, take in zip(takes, told.turned(list(takes.values())), strict=True):
        curve, axes, _ = rope(60, k)
        assert take.gripper is not None
        frames = rope_frames(curve, take.gripper.at(take.series.time), told.beside.turn)
        angles.append(np.arctan2(*(np.einsum("tvx,tvx->tv", frames[:, :, 0], axes[:, :, a]) for a in (1, 0))))
    turned = np.exp(1j * np.array(angles))
    assert np.abs(np.angle(turned / turned.mean(axis=(0, 1)))).max() < 0.1


def test_grippers_that_say_how_they_are_turned_are_left_as_they_are() -> None:
    takes = [recording(k, offsets(2), noise=1e-4) for k in (6, 7, 8, 9)]
    told = told_standoffs(takes)
    for until, near in ((np.inf, 0.02), (0.3, 0.1)):
        assert np.abs(told.rolls(takes, until)).max() < near


def test_a_recording_that_shows_nothing_leaves_its_grippers_as_they_are() -> None:
    told = told_standoffs([recording(k, offsets(2)) for k in (6, 7)])
    hidden = recording(8, offsets(2), rolls=(0.5, 0.5))
    hidden.series.points[:20, 4] = np.nan
    assert (told.rolls([hidden], 0.3) == 0.0).all()
    both = told.rolls([hidden, recording(9, offsets(2))], 0.3)
    assert (both[0] == 0.0).all()
    assert np.abs(told.rolls([hidden])).max() > 0.3


def test_a_recording_without_a_whole_frame_changes_nothing() -> None:
    takes = [recording(k, offsets(2), noise=1e-4, rolls=(0.3 * (k - 7), 0.0)) for k in (6, 7, 8)]
    none = recording(9, offsets(2))
    none.series.points[:, 4] = np.nan
    alone, beside = told_standoffs(takes), told_standoffs([*takes, none])
    np.testing.assert_allclose(beside.beside.offsets, alone.beside.offsets, atol=1e-9)
    assert (beside.rolls([none]) == 0.0).all()
    (again,) = beside.turned([none])
    assert again.gripper is not None
    assert none.gripper is not None
    np.testing.assert_allclose(again.gripper.poses, none.gripper.poses, atol=1e-12)


def test_a_scene_starts_as_twisted_as_the_rope_is_then() -> None:
    for seed in (3, 8):
        _, _, poses = rope(60, seed, 0.4)
        take = recording(seed, np.zeros((len(PLACES), 2)), 0.4)
        plain = preset("cable").scenario((LENGTH,), (41,)).for_recording(take)
        material = RopeMaterial()
        assert measured_start(plain, take).scene(material, np.zeros(3)).start_twist == 0.0
        beside = Beside(np.zeros((len(PLACES), 2)), 0.4)
        started = measured_start(plain, take, beside).scene(material, np.zeros(3)).start_twist
        assert started == pytest.approx(0.6 * np.sin(seed), abs=0.05)
        assert beside.twist(rope(1, seed)[0][0], poses[0]) == pytest.approx(0.6 * np.sin(seed), abs=0.05)


def test_a_kept_bend_is_told_in_axes_that_are_twisted_as_the_rope_is() -> None:
    """In axes that are turned by an angle the same bend has numbers that are turned back by it."""
    take = recording(3, np.zeros((len(PLACES), 2)))
    plain = preset("cable").scenario((LENGTH,), (41,)).for_recording(take)

    def told(turn: float) -> FloatArray:
        scenario = measured_start(plain, take, Beside(np.zeros((len(PLACES), 2)), turn))
        kept = told_bend([replace(scenario, times=take.series.time[:5])], [first_frames])
        assert kept is not None
        return kept.shapes.sum(axis=0)

    short = replace(take.series, time=take.series.time[:5], points=take.series.points[:5])
    first_frames = replace(take, series=short)
    one, other = told(0.0), told(0.5)
    # a turn that is larger by 0.5 rad is a twist that is smaller by it
    angle = 0.5 * np.arange(1, 40) / 40
    c, s = np.cos(angle), np.sin(angle)
    back = np.stack([c * one[:, 0] - s * one[:, 1], s * one[:, 0] + c * one[:, 1]], axis=1)
    np.testing.assert_allclose(other, back, atol=0.02 * np.abs(one).max())
    assert np.abs(other - one).max() > 0.1 * np.abs(one).max()


def test_markers_on_the_axis_are_told_to_be_there() -> None:
    found = told_standoffs([recording(k, np.zeros((len(PLACES), 2)), noise=1e-4) for k in (6, 7)]).beside
    assert np.abs(found.offsets).max() < 0.002


def test_what_does_not_tell_is_refused() -> None:
    take = recording(6, offsets(2))
    few = Recording("few", PointSeries(take.series.time[:9], take.series.points[:9]), take.gripper)
    with pytest.raises(InputError, match=r"of few only 9 do, 0\.1 s apart; at least 20 are needed"):
        told_standoffs([few])
    fewer = Recording("fewer", PointSeries(take.series.time, take.series.points[:, 1:]), take.gripper)
    with pytest.raises(InputError, match="of the same markers, but take6 has 13, fewer has 12"):
        told_standoffs([take, fewer])
    assert take.gripper is not None
    one = Motion(take.gripper.times, take.gripper.poses[:, :1])
    with pytest.raises(InputError, match=r"between two grippers, but recording 'one' is another"):
        told_standoffs([Recording("one", take.series, one)])


def study(folder: Path, scenario: str) -> Path:
    true = offsets(2)
    save_measurement(Measurement((recording(6, true), recording(7, true))), folder / "rope.zarr")
    (folder / "study.toml").write_text(
        '[study]\nmeasurement = "rope.zarr"\nfit_on = ["take6"]\nhold_out = ["take7"]\n\n'
        f'[scenario]\nname = "cable"\nvertices = [41]\n{scenario}\n\n[simulator]\nname = "mujoco"\n'
    )
    return folder / "study.toml"


def test_a_rope_starts_with_its_markers_where_they_were_seen(tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    problem = Study.load(study(tmp_path, 'start = "measured"\nmarkers = "beside"')).problem
    values = problem.space.as_dict(problem.space.from_unit(np.full(len(problem.space), 0.5)))
    for name in ("take6", "take7"):  # the held-out one with the offsets of the other
        scenario, seen = problem.scenarios[name], problem.recordings[name].series.points
        assert scenario.body.measures.sum() == pytest.approx(LENGTH, rel=0.01)
        made = problem.simulate(values, name).series.points
        assert np.linalg.norm(made[0] - seen[0], axis=1).max() < 0.004
        assert np.linalg.norm(scenario.markers @ scenario.start_vertices() - seen[0], axis=1).mean() > 0.008


def test_a_fit_tells_of_markers_that_stand_beside(tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    path = study(tmp_path, 'start = "measured"')
    (said,) = markers_beside(Study.load(path).problem)
    true = np.sqrt(np.mean(np.sum(offsets(2) ** 2, axis=1)))
    assert float(said.split(" mm beside")[0].split()[-1]) == pytest.approx(1e3 * true, rel=0.3)
    path.write_text(path.read_text().replace('"measured"', '"measured"\nmarkers = "beside"'))
    assert markers_beside(Study.load(path).problem) == []


def test_a_study_says_what_goes_together(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="markers = 'beside' is for a rope that starts as measured"):
        Study.load(study(tmp_path, 'markers = "beside"'))
    (tmp_path / "other").mkdir()
    with pytest.raises(InputError, match="leave markers out"):
        Study.load(study(tmp_path / "other", 'start = "measured"\nmarkers = "all"'))
