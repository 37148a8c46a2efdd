"""Clinging, against closed forms."""

import numpy as np
import pytest
from effect_objects import BLOCK, LYING, ROPE, G, bound, engine, play, scene_of

from muslin.core.material import ClothMaterial
from muslin.core.obstacles import Table
from muslin.core.simulator import State
from muslin.plugins.effects.adhesion import Adhesion
from muslin.plugins.effects.contact import REACH

WEIGHT = ClothMaterial().areal_density * G  # [Pa]
UP = np.array([0.0, 0.0, 1.0])


def drawn(force, gap, pressed):
    lifted = LYING.vertices + gap * UP
    return force(0.0, State(lifted, np.zeros((20, 3)), lambda: np.tile(pressed * UP, (20, 1))))


def test_traction_falls_linearly_with_the_gap_until_it_lets_go():
    force = Adhesion(traction=4.0).bind(scene_of(LYING, obstacles=[Table(0.0)]), np.ones(20))
    np.testing.assert_array_equal(drawn(force, 0.5 * REACH, 0.0), 0.0)  # has not touched yet
    np.testing.assert_allclose(drawn(force, 0.0, 0.1), -4.0 * LYING.vertex_measures[:, None] * UP)
    for share in (0.25, 0.75):
        expected = -4.0 * (1 - share) * LYING.vertex_measures[:, None] * UP
        np.testing.assert_allclose(drawn(force, share * REACH, 0.0), expected, rtol=1e-9)
    np.testing.assert_array_equal(drawn(force, 1.01 * REACH, 0.0), 0.0)
    np.testing.assert_array_equal(drawn(force, 0.5 * REACH, 0.0), 0.0)  # it has let go


def test_pulling_off_slowly_costs_half_the_traction_times_the_reach():
    force = Adhesion(traction=4.0).bind(scene_of(LYING, obstacles=[Table(0.0)]), np.ones(20))
    drawn(force, 0.0, 0.1)
    gaps = np.linspace(0.0, 1.2 * REACH, 1201)
    work = -sum(drawn(force, gap, 0.0)[:, 2].sum() for gap in gaps) * (gaps[1] - gaps[0])
    assert work == pytest.approx(0.5 * 4.0 * REACH * 0.02, rel=2e-3)


@pytest.mark.parametrize(("body", "area"), [(LYING, 0.02), (ROPE, 0.5 * 0.008), (BLOCK, 2 * (0.02 + 0.03 + 0.06))])
def test_what_clings_is_the_surface(body, area):
    """One side of a sheet, length times diameter of a rope, the outside of a solid."""
    body = type(body)(body.kind, body.vertices * [1, 1, 0], body.elements) if body is not BLOCK else body
    scene = scene_of(body, obstacles=[Table(10.0)])  # all of it is deep inside, so that the gap plays no part
    force = Adhesion(traction=3.0).bind(scene, np.ones(len(body.vertices)))
    pressed = np.tile(UP, (len(body.vertices), 1))
    total = force(0.0, State(body.vertices, 0 * body.vertices, lambda: pressed)).sum(axis=0)
    np.testing.assert_allclose(total, [0, 0, -3.0 * area], rtol=1e-9)


def test_without_obstacles_there_is_nothing_to_cling_to():
    np.testing.assert_array_equal(bound(Adhesion(traction=5.0), LYING)(0.0, LYING.vertices, 0 * LYING.vertices), 0.0)


@pytest.mark.parametrize("name", ["reference", "mujoco", "pybullet"])
def test_it_holds_a_sheet_that_is_pulled_off_with_less_and_lets_it_go_with_more(name):
    """Gravity turned upwards after touching, as a pull: sigma of 2 weights holds one weight, 0.5 do not."""
    moved = []
    for share in (2.0, 0.5):
        scene = scene_of(LYING, ClothMaterial(stretch_stiffness=100.0), obstacles=[Table(0.0)])
        run = _pulled_up(name, scene, Adhesion(traction=share * WEIGHT))
        moved.append(run[-1] - run[0])
    assert moved[0] < REACH
    assert moved[1] > 0.05


def _pulled_up(name, scene, effect):
    """Mean heights while it is pulled up with its weight, after 0.1 s of lying."""
    world = engine(name).open(scene)
    try:
        force, heights = effect.bind(scene, world.masses), []
        for k in range(60):
            state = world.state()
            heights.append(state.positions[:, 2].mean())
            pull = -2.0 * world.masses[:, None] * scene.gravity if k >= 20 else 0.0
            world.step(np.zeros((0, 3)), force(k * world.time_step, state) + pull)
    finally:
        world.close()
    return heights[20:]


@pytest.mark.parametrize("name", ["reference", "mujoco"])
def test_falling_onto_it_gives_no_energy(name):
    """Dropped from 3 mm on a sticky table: never faster than the fall, and at rest in the end."""
    lifted = type(LYING)("cloth", LYING.vertices + 0.003 * UP, LYING.elements)
    scene = scene_of(lifted, ClothMaterial(stretch_stiffness=100.0), obstacles=[Table(0.0)])
    run = play(name, scene, 0.5, Adhesion(traction=20.0))
    energy = 0.5 * np.einsum("v,tvx->t", run.masses, run.velocities**2)
    energy += G * np.einsum("v,tv->t", run.masses, run.positions[:, :, 2])
    assert energy.max() <= run.masses.sum() * G * 0.003 * 1.001 + 1e-9
    assert np.abs(run.velocities[-1]).max() < 0.01
