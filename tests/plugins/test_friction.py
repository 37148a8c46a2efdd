"""Friction beyond one Coulomb coefficient, against closed forms."""

from dataclasses import replace

import numpy as np
import pytest
from effect_objects import LYING, G, cases, engine, play, scene_of
from hypothesis import given
from hypothesis import strategies as st

from muslin.core.body import Body, cloth_grid, rope_line
from muslin.core.material import ClothMaterial, RopeMaterial
from muslin.core.obstacles import Cylinder, Table
from muslin.core.scene import Scene
from muslin.core.simulator import State
from muslin.plugins.effects.contact import MEMORY, REACH, Bristles, Contacts, NormalLoad
from muslin.plugins.effects.friction import STRIBECK_SPEED, AnisotropicFriction, CapstanFriction, StickSlip

FRICTION, STEP = 0.3, 0.005
GRID = cloth_grid(0.1, 0.1, 3, 3)
FLAT = Body("cloth", GRID.vertices[:, [0, 2, 1]], GRID.elements, GRID.grid)  # its warp runs along x
CLOTH = ClothMaterial(friction=FRICTION, stretch_stiffness=100.0)
UP = np.array([0.0, 0.0, 1.0])


def on_table(slope=0.0, material=CLOTH):
    """Gravity leans along x instead of the table."""
    gravity = G * np.array([np.sin(slope), 0.0, -np.cos(slope)])
    return scene_of(FLAT, material, gravity, [Table(0.0)])


def pulled(effect, velocities, pressure=1.0):
    """The force ``(V, 3)`` once it knows the step and has settled, every vertex pressed with ``pressure`` [N]."""
    force = effect.bind(on_table(), np.full(9, 0.01))
    state = State(FLAT.vertices, np.asarray(velocities, float), lambda: np.tile(pressure * UP, (9, 1)))
    for k in range(200):
        out = force(k * STEP, state)
    return out


@pytest.mark.parametrize("degrees", [0, 30, 60, 90])
@pytest.mark.parametrize(("excess", "axis"), [(0.5, 0), (-0.4, 1)])
def test_the_extra_friction_goes_by_the_part_of_the_sliding_along_the_threads(degrees, excess, axis):
    """-N mu |e| d (d . v) / |v|, with d the warp (x) for positive e and the weft (y) for negative."""
    angle = np.radians(degrees)
    velocity = 2.0 * np.array([np.cos(angle), np.sin(angle), 0.0])
    expected = np.zeros(3)
    expected[axis] = -abs(excess) * FRICTION * 1.5 * velocity[axis] / 2.0
    got = pulled(AnisotropicFriction(excess=excess), np.tile(velocity, (9, 1)), 1.5)
    np.testing.assert_allclose(got, np.tile(expected, (9, 1)), atol=1e-12)


@pytest.mark.parametrize("speed", [0.01, 0.05, 0.5])
def test_extra_static_friction_fades_with_the_sliding_speed(speed):
    expected = -0.4 * FRICTION * 1.5 / (1 + (speed / STRIBECK_SPEED) ** 2)
    got = pulled(StickSlip(excess=0.4), np.tile([0.0, speed, 0.0], (9, 1)), 1.5)
    np.testing.assert_allclose(got, np.tile([0.0, expected, 0.0], (9, 1)), atol=1e-12)


@pytest.mark.parametrize("effect", [AnisotropicFriction(excess=1.0), StickSlip(excess=1.0)])
def test_what_does_not_touch_or_does_not_move_feels_nothing(effect):
    np.testing.assert_array_equal(pulled(effect, np.ones((9, 3)), 0.0), 0.0)
    np.testing.assert_array_equal(pulled(effect, np.zeros((9, 3)), 1.0), 0.0)


@cases
@given(st.integers(0, 10_000))
def test_bristles_give_back_no_more_than_they_took(seed):
    """Free masses on bristles that move and are pressed at random: the kinetic energy never exceeds what it was."""
    rng = np.random.default_rng(seed)
    masses = rng.uniform(0.001, 0.1, 6)
    v = rng.normal(0, rng.choice([0.001, 0.1, 3.0]), (6, 3)) * [1, 1, 0]
    bristles = Bristles(masses)
    started = np.sum(masses[:, None] * v**2, axis=1)
    for k in range(60):
        limit = masses * G * rng.uniform(0, 2, 6) * rng.integers(0, 2, 6)
        v = v + STEP * bristles(k * STEP, v, np.tile(UP, (6, 1)), limit) / masses[:, None]
        assert (np.sum(masses[:, None] * v**2, axis=1) <= started * (1 + 1e-9)).all()
    np.testing.assert_array_equal(v[:, 2], 0.0)


@pytest.mark.parametrize("share", [0.3, 0.9])
def test_bristles_hold_still_what_they_can_hold(share):
    masses, limit, x = np.full(1, 0.02), np.full(1, 0.1), np.zeros(3)
    bristles, v = Bristles(masses), np.zeros((1, 3))
    places = []
    for k in range(400):
        push = np.array([share * 0.1, 0, 0]) + bristles(k * STEP, v, UP[None], limit)
        v = v + STEP * push / 0.02
        x = x + STEP * v[0]
        places.append(x[0])
    assert abs(v).max() < 1e-9
    stretch = share * 0.1 * STEP**2 / (0.1 * 0.02)  # F h^2 / (0.1 m), more if it slipped on its way there
    assert stretch * (1 - 1e-6) < places[-1] < 1.3 * stretch


def test_bristles_yield_to_more():
    bristles, v = Bristles(np.full(1, 0.02)), np.zeros((1, 3))
    for k in range(200):
        v = v + STEP * (np.array([[0.15, 0, 0]]) + bristles(k * STEP, v, UP[None], np.full(1, 0.1))) / 0.02
    assert v[0, 0] == pytest.approx(0.05 / 0.02 * 1.0, rel=0.03)


def test_a_hopping_contact_presses_with_its_mean():
    load, normal, gap = NormalLoad(1), UP[None], np.zeros(1)
    got = [load(k * STEP, (3.0 if k % 3 == 0 else 0.0) * normal, normal, gap)[0] for k in range(60)]
    assert np.mean(got[-3:]) == pytest.approx(1.0, rel=0.05)
    assert load(60 * STEP, 3.0 * normal, normal, np.full(1, 1.1 * REACH))[0] == 0.0
    gone = [load((61 + k) * STEP, 0.0 * normal, normal, gap)[0] for k in range(20)]
    assert gone[-1] < 2 * np.exp(-20 * STEP / MEMORY)


def test_friction_is_that_of_the_nearest_obstacle():
    rope = RopeMaterial(friction=0.2, diameter=0.01)
    obstacles = (Table(0.0, friction=0.5), Cylinder(np.array([0.0, 0, 1]), np.array([0.0, 1, 0]), 0.1, 1.0, 2.0))
    body = rope_line(np.array([[0.0, 0, 0.02], [0, 0, 0.88]]), 2)
    gap, normal, friction = Contacts(scene_of(body, rope, obstacles=obstacles)).nearest(body.vertices)
    np.testing.assert_allclose(gap, [0.015, 0.015])
    np.testing.assert_allclose(normal, [[0, 0, 1], [0, 0, -1]], atol=1e-12)
    np.testing.assert_allclose(friction, [0.1, 0.4])


engines = pytest.mark.parametrize("name", ["reference", "mujoco", "pybullet"])


def stopping(name, direction, *effects, material=CLOTH):
    """Speed lost in 0.1 s of sliding from 1 m/s, over g t."""
    run = play(name, on_table(material=material), 0.1, *effects, push=np.tile(direction, (9, 1)), lie=0.1)
    speed = run.mean_velocity @ np.asarray(direction)
    at = np.searchsorted(run.times, 0.02)
    return (speed[at] - speed[-1]) / (G * (run.times[-1] - run.times[at]))


@pytest.mark.parametrize("name", ["reference", "pybullet"])
@pytest.mark.parametrize("excess", [0.5, -0.5])
def test_sliding_stops_sooner_along_the_threads_as_with_a_rougher_material(name, excess):
    """(1 + |e|) mu g along them, mu g across: the same as the engine's own friction with that coefficient."""
    effect = AnisotropicFriction(excess=excess)
    along, across = ([1.0, 0, 0], [0, 1.0, 0])[:: 1 if excess > 0 else -1]
    rough = replace(CLOTH, friction=1.5 * FRICTION)
    assert stopping(name, along, effect) == pytest.approx(1.5 * FRICTION, rel=0.02)
    assert stopping(name, across, effect) == pytest.approx(FRICTION, rel=0.02)
    assert stopping(name, along, effect) == pytest.approx(stopping(name, along, material=rough), rel=0.02)


@engines
def test_what_lies_holds_on_a_slope_on_which_it_would_slide(name):
    """On a slope tan 0.4 between mu = 0.3 and mu_s = 0.45 it holds; on one above it starts as without."""
    slopes = np.arctan([0.4, 0.55])
    held = play(name, on_table(slopes[0]), 0.4, StickSlip(excess=0.5), lie=0.1)
    free = play(name, on_table(slopes[0]), 0.4, lie=0.1)
    steep = play(name, on_table(slopes[1]), 0.4, StickSlip(excess=0.5), lie=0.1)
    moved = [(r.positions[-1] - r.positions[0])[:, 0].mean() for r in (held, free, steep)]
    assert moved[0] < 0.002
    assert moved[1] > 0.05
    assert moved[2] > 0.1
    assert moved[2] < 0.5 * G * (np.sin(slopes[1]) - FRICTION * np.cos(slopes[1])) * 0.4**2


@engines
@pytest.mark.parametrize("effect", [AnisotropicFriction(excess=1.0), StickSlip(excess=1.0)])
def test_friction_gives_no_energy(name, effect):
    """A crumpling sheet thrown along the table: at no time faster as a whole than without, and it comes to rest."""
    push = np.tile([0.6, 0.3, 0.0], (9, 1)) + np.random.default_rng(1).normal(0, 0.1, (9, 3)) * [1, 1, 0]
    run = play(name, on_table(), 0.5, effect, push=push, lie=0.1)
    kinetic = 0.5 * np.einsum("v,tvx->t", run.masses, run.velocities**2)
    assert kinetic[1:].max() <= 1.001 * 0.5 * np.sum(run.masses[:, None] * push**2)
    assert kinetic[-1] < 1e-3 * kinetic[1]


def over_a_spool(ratio, *effects):
    """How far the heavier end of a rope over a quarter-metre of fixed spool falls within 0.4 s [m]."""
    radius, r = 0.05, 0.053
    around = np.linspace(np.pi, 0.0, 33)
    arc = np.stack([r * np.cos(around), 0 * around, r * np.sin(around)], axis=1)
    bent = rope_line(np.concatenate([[[-r, 0, -0.15]], arc, [[r, 0, -0.15]]]), 49)
    straight = rope_line(np.array([[0.0, 0, 0], [bent.measures.sum(), 0, 0]]), 49)
    material = RopeMaterial(0.02, 300.0, 1e-6, 1e-6, 0.006, 0.002, FRICTION)
    for effect in effects:
        material = effect.on_material(material)
    loads = np.zeros(49)
    loads[0], loads[-1] = 0.05, 0.05 * ratio
    spool = Cylinder(np.zeros(3), np.array([0.0, 1.0, 0.0]), radius, 0.2)
    scene = Scene(straight, material, np.array([0, 0, -G]), (), loads, (spool,), bent.vertices)
    world = engine("mujoco").open(scene)
    try:
        start = world.state().positions[-1, 2]
        for _ in range(round(0.4 / world.time_step)):
            world.step(np.zeros((0, 3)), -2.0 * world.masses[:, None] * world.state().velocities)
        return start - world.state().positions[-1, 2]
    finally:
        world.close()


@pytest.mark.parametrize(("added", "largest"), [(0.0, np.exp(0.3 * np.pi)), (0.2, np.exp(0.5 * np.pi))])
def test_a_rope_over_half_a_turn_holds_up_to_exp_mu_pi(added, largest):
    """Euler's ratio of the two weights: 10 % under it the rope holds, 15 % over it slides."""
    effect = CapstanFriction(friction=added)
    assert over_a_spool(0.9 * largest, effect) < 0.01
    assert over_a_spool(1.15 * largest, effect) > 0.02


def test_capstan_friction_adds_to_the_material_and_changes_nothing_else():
    before = RopeMaterial(friction=0.2)
    after = CapstanFriction(friction=0.15).on_material(before)
    assert after == replace(before, friction=0.35)
    assert LYING.kind not in CapstanFriction.object_kinds
