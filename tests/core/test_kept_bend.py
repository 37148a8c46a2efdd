"""The bend that a rope keeps, as it follows from states that it was seen in."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from muslin.core.arrays import FloatArray
from muslin.core.bending import RopeBending, rope_rigidities
from muslin.core.beside import untwisted_frames
from muslin.core.body import rope_line
from muslin.core.kept_bend import StateBend, common_bend, kept_in
from muslin.core.material import RopeMaterial
from muslin.core.measurement import Recording
from muslin.core.motion import Motion, rotate
from muslin.core.scenario import Scenario
from muslin.core.scenarios import preset
from muslin.core.scenarios.kept import bent, told_bend
from muslin.core.scenarios.measured import measured_start
from muslin.core.scene import Scene
from muslin.core.series import PointSeries

MATERIAL = RopeMaterial(linear_density=0.05, stretch_stiffness=2000.0, bending_rigidity=2e-3, twist_rigidity=2e-3)
ROPE = rope_line(np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]), 26)


def test_an_arc_without_weight_is_all_natural_curvature_or_none() -> None:
    body = rope_line(np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]), 21)
    # segments that are held at both ends are straight, so the arc turns there by what half a segment turns
    turn = np.concatenate([[0.0, 0.5], np.ones(17), [0.5]])
    angle = 0.05 * np.cumsum(turn)
    steps = 0.05 * np.stack([np.cos(angle), 0 * angle, np.sin(angle)], axis=1)
    arc = np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])
    free = Scene(body, MATERIAL, np.zeros(3), (np.array([0, 1]),), np.zeros(21), (), arc)
    held = replace(free, grasps=(np.array([0, 1]), np.array([19, 20])))

    def bend_of(scene: Scene) -> FloatArray:
        bending = RopeBending(body, scene.held)
        bending.follow(arc)
        return kept_in(scene, bending).least.curvature(MATERIAL, scene.gravity)

    # clamped at one end alone nothing but its own bend can hold it in this shape; clamped at both the ends can
    np.testing.assert_allclose(np.linalg.norm(bend_of(free), axis=1)[:-1], 1.0, rtol=1e-6)
    assert np.abs(bend_of(held)).max() < 1e-6


def test_what_moves_freely_needs_no_bend() -> None:
    """In free fall the acceleration is the weight's, so a straight rope is in balance however light it is."""
    body = rope_line(np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]), 21)
    gravity = np.array([0.0, 0.0, -9.81])
    held = (np.array([0, 1]),)
    falling = Scene(body, MATERIAL, gravity, held, np.zeros(21), start_accelerations=np.tile(gravity, (21, 1)))
    bending = RopeBending(body, falling.held)
    assert np.abs(kept_in(falling, bending).least.curvature(MATERIAL, gravity)).max() < 1e-9
    still = replace(falling, start_accelerations=None)
    # at rest, sticking out from the clamp, its bend carries the weight of all that is beyond: m = w (l - x)^2 / 2
    moment = 2e-3 * np.linalg.norm(kept_in(still, bending).least.curvature(MATERIAL, gravity), axis=1)
    np.testing.assert_allclose(moment, 0.05 * 9.81 * 0.5 * (1.0 - np.arange(1, 20) / 20) ** 2, rtol=1e-6)


def test_what_damping_gives_is_no_bend() -> None:
    """A straight rope without weight that starts to bend, with the acceleration that its damping then gives it."""
    body = rope_line(np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]), 21)
    masses, beta = 0.05 * body.vertex_measures, 0.02
    held = (np.array([0, 1]),)
    bending = RopeBending(body, held[0])
    x = body.vertices[:, 0]
    velocities = np.stack([0 * x, 0 * x, np.maximum(x - 0.1, 0.0) ** 2 * (1.0 - x)], axis=1)
    forces = bending.forces(2e-3 * beta * bending.rates(velocities))
    bent = Scene(
        body,
        replace(MATERIAL, damping_time=beta),
        np.zeros(3),
        held,
        np.zeros(21),
        start_velocities=velocities,
        start_accelerations=forces / masses[:, None],
    )
    kept = kept_in(bent, bending).least
    assert np.abs(kept.curvature(replace(MATERIAL, damping_time=beta), bent.gravity)).max() < 1e-9
    undamped = kept.curvature(MATERIAL, bent.gravity)
    assert np.abs(undamped).max() > 0.5 * beta * np.abs(bending.rates(velocities)).max()


def carried(turn: FloatArray) -> tuple[Scenario, Recording]:
    """An arc of 0.4 rad without weight, held at the first end alone, turned as a whole by ``turn`` (w x y z)."""
    steps = np.linspace(0.0, 0.4, 12)
    segments = 0.05 * np.stack([np.cos(steps), np.sin(steps), 0 * steps], axis=1)
    points = rotate(turn, np.concatenate([np.zeros((1, 3)), np.cumsum(segments, axis=0)]))
    time = np.arange(0.0, 1.2, 0.02)
    poses = np.tile(np.concatenate([points[0], turn]), (len(time), 1, 1))
    recording = Recording("arc", PointSeries(time, np.tile(points, (len(time), 1, 1))), Motion(time, poses))
    plain = replace(preset("cable").scenario((1.0,), (25,)), grasps=(np.array([0, 1]),))
    return measured_start(plain.for_recording(recording), recording), recording


@settings(max_examples=10)
@given(st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda q: np.linalg.norm(q) > 0.1))
def test_it_turns_with_the_gripper(turn: tuple[float, ...]) -> None:
    """So however a rope is held, all its recordings tell the same."""
    unit = np.array(turn) / np.linalg.norm(turn)
    weightless = np.zeros(3)
    level = told_bend(*([x] for x in carried(np.array([1.0, 0.0, 0.0, 0.0]))))
    turned = told_bend(*([x] for x in carried(unit)))
    assert level is not None
    assert turned is not None
    found = level.curvature(MATERIAL, weightless)
    # the z axis of the gripper stands across the arc, about which it turns to the left
    np.testing.assert_allclose(np.median(found, axis=0), [0.4 / 0.55, 0.0], atol=0.03)
    np.testing.assert_allclose(turned.curvature(MATERIAL, weightless), found, atol=1e-6)


@pytest.mark.parametrize("size", [0.5, 4.0])
def test_a_bent_body_has_the_curvature_that_it_was_given(size: float) -> None:
    scenario, _ = carried(np.array([0.8, 0.0, 0.6, 0.0]))
    wanted = size * np.random.default_rng(0).normal(size=(23, 2))
    body = bent(scenario, wanted)
    np.testing.assert_allclose(body.measures, scenario.body.measures, rtol=1e-9)
    world = replace(scenario, body=body).world_vertices()
    start = scenario.start_vertices()
    np.testing.assert_allclose(world[1] - world[0], start[1] - start[0], atol=1e-4)
    bending = RopeBending(replace(body, vertices=world), scenario.grasps[0])
    frames = untwisted_frames(world[None], scenario.motion.at(scenario.times[:1])[:, [0, 0]])[0, 1:-1]
    got = np.einsum("na,nax,nbx->nb", bending.rest, bending.axes, frames)
    np.testing.assert_allclose(got, wanted, atol=0.02 * size)


def states_of(kept: FloatArray, count: int, errors: float = 0.0, material: RopeMaterial = MATERIAL) -> list[StateBend]:
    """What random states of a rope that two clamps hold, in balance with its own bend ``kept``, tell of it."""
    rng = np.random.default_rng(2)
    grasps = (np.array([0, 1]), np.array([24, 25]))
    gravity = np.array([0.0, 0.0, -9.81])
    out = []
    for turn in rng.normal(size=(count, 4)):
        pose = np.concatenate([np.zeros(3), turn / np.linalg.norm(turn)])
        along = np.linspace(0.0, 1.0, 25)[:, None, None]
        waves = np.sum(rng.normal(size=(1, 3, 2)) * np.sin(np.pi * along * np.arange(1, 4)[:, None]), axis=1)
        directions = np.concatenate([np.ones((25, 1)), waves], axis=1)
        directions *= 0.04 / np.linalg.norm(directions, axis=1, keepdims=True)
        points = np.concatenate([np.zeros((1, 3)), np.cumsum(rotate(pose[3:], directions), axis=0)])
        bending = RopeBending(ROPE, np.concatenate(grasps))
        bending.follow(points)
        frames = untwisted_frames(points[None], np.tile(pose, (1, 2, 1)))[0, 1:-1]
        own = np.einsum("na,nax,nbx->nb", kept, frames, bending.axes)
        own += errors * rng.normal(size=own.shape)
        rigidity = rope_rigidities(ROPE, material)[:, None]
        forces = bending.forces(rigidity * (bending.curvature - own))
        accelerations = forces / (0.05 * ROPE.vertex_measures)[:, None] + gravity
        scene = Scene(ROPE, MATERIAL, gravity, grasps, np.zeros(26), (), points, start_accelerations=accelerations)
        out.append(kept_in(scene, bending).turned(bending.axes, frames))
    return out


def rms(curvature: FloatArray) -> float:
    return float(np.sqrt(np.mean(curvature**2)))


def test_states_tell_together_what_each_leaves_open() -> None:
    """Clamped at both ends, a rope may owe much of its shape in any one state to what the grippers give."""
    gravity = np.array([0.0, 0.0, -9.81])
    kept = np.outer(3.0 * np.cos(2 * np.pi * np.linspace(0.0, 1.0, 24)), [1.0, 1.0])
    states = states_of(kept, 40)
    each = np.array([s.least.curvature(MATERIAL, gravity) for s in states])
    np.testing.assert_allclose(common_bend(states[:1], gravity).curvature(MATERIAL, gravity), each[0], atol=1e-9)
    np.testing.assert_allclose(common_bend(states[:1] * 20, gravity).curvature(MATERIAL, gravity), each[0], atol=1e-9)
    assert rms(each.mean(axis=0) - kept) > 0.2 * rms(kept)
    assert rms(common_bend(states, gravity).curvature(MATERIAL, gravity) - kept) < 0.05 * rms(kept)


def test_it_is_told_of_a_rope_that_is_not_as_stiff_everywhere() -> None:
    gravity = np.array([0.0, 0.0, -9.81])
    kept = np.outer(3.0 * np.cos(2 * np.pi * np.linspace(0.0, 1.0, 24)), [1.0, 1.0])
    uneven = replace(MATERIAL, end_bending_ratio=0.3, far_bending_ratio=1.5)
    told = common_bend(states_of(kept, 40, material=uneven), gravity)

    def off(rope: RopeMaterial) -> float:
        """But for an even moment, which the clamps take up."""
        moment = rope_rigidities(ROPE, rope)[:, None] * (told.curvature(rope, gravity) - kept)
        return rms(moment - moment.mean(axis=0)) / (2e-3 * rms(kept))

    assert off(uneven) < 0.05
    assert off(MATERIAL) > 0.2


def test_what_hardly_any_state_tells_is_not_filled_with_their_errors() -> None:
    """An even bend of a rope that two clamps hold is such: they take it up, however the rope lies."""
    gravity = np.array([0.0, 0.0, -9.81])
    told = common_bend(states_of(np.tile([0.0, 1.0], (24, 1)), 40, errors=1.0), gravity)
    assert rms(told.curvature(MATERIAL, gravity)) < 0.5


def test_states_that_are_far_off_hardly_count() -> None:
    """As those in which a rope whips: they must not take away from what the others tell."""
    gravity = np.array([0.0, 0.0, -9.81])
    kept = np.outer(3.0 * np.cos(2 * np.pi * np.linspace(0.0, 1.0, 24)), [1.0, 1.0])
    good, wild = states_of(kept, 40), states_of(kept, 10, errors=10.0)
    alone = rms(common_bend(wild, gravity).curvature(MATERIAL, gravity) - kept)
    together = rms(common_bend(good + wild, gravity).curvature(MATERIAL, gravity) - kept)
    assert together < 0.1 * rms(kept)  # of equal weight, they would add a fifth of what they are off by themselves
    assert 0.2 * alone > 0.2 * rms(kept)


def test_a_rope_that_no_gripper_holds_tells_nothing() -> None:
    """There is then nothing that its recordings have in common about which way it is bent."""
    scenario, recording = carried(np.array([1.0, 0.0, 0.0, 0.0]))
    assert told_bend([replace(scenario, grasps=())], [recording]) is None


def test_states_are_looked_at_all_along_a_recording() -> None:
    """What friction and markers put in differs from state to state; frames that miss a marker are passed over."""
    scenario, recording = carried(np.array([1.0, 0.0, 0.0, 0.0]))
    series = recording.series
    points = series.points.copy()
    points[series.time > 0.45] += 0.002 * np.random.default_rng(0).normal(size=points[0].shape)
    missed = points.copy()
    missed[np.isclose(series.time, 0.5), 3] = np.nan
    first, mixed, passed = (
        told_bend([scenario], [replace(recording, series=replace(series, points=x))])
        for x in (series.points, points, missed)
    )
    assert first is not None
    assert mixed is not None
    assert passed is not None
    assert np.abs(mixed.shapes.sum(axis=0) - first.shapes.sum(axis=0)).max() > 0.01
    np.testing.assert_allclose(passed.shapes, mixed.shapes, atol=1e-9)


def test_a_state_of_swapped_markers_tells_nothing() -> None:
    scenario, recording = carried(np.array([1.0, 0.0, 0.0, 0.0]))
    series = recording.series
    rng = np.random.default_rng(1)
    noise = 0.0005 * rng.normal(size=(3, len(series.time), *series.points.shape[1:]))
    takes = series.points + noise[:, ::5].repeat(5, axis=1)
    swapped = takes.copy()
    swapped[0, 25, [4, 5]] = takes[0, 25, [5, 4]]  # the second state that is looked at

    def told(points: FloatArray) -> FloatArray:
        recordings = [replace(recording, series=replace(series, points=p)) for p in points]
        made = told_bend([measured_start(scenario, r) for r in recordings], recordings)
        assert made is not None
        return made.shapes.sum(axis=0)

    assert np.abs(told(swapped) - told(takes)).max() < 0.3
