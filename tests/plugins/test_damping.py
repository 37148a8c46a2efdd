"""Mass- and stiffness-proportional damping against closed forms."""

import numpy as np
import pytest
from effect_objects import BLOCK, SHEET, G, bound, engine, moving, scene_of, vertices

from muslin.core.body import Body, cloth_grid, solid_box
from muslin.core.material import ClothMaterial, SolidMaterial
from muslin.plugins.effects.damping import InternalDamping, ViscousDamping

BODIES = [pytest.param(SHEET, ClothMaterial(), id="cloth"), pytest.param(BLOCK, SolidMaterial(), id="solid")]


def test_viscous_force_is_minus_alpha_m_v():
    force = bound(ViscousDamping(rate=2.0), SHEET)(0.0, SHEET.vertices, moving(SHEET, [1.0, -2.0, 0.5]))
    masses = SHEET.vertex_measures * ClothMaterial().density
    np.testing.assert_allclose(force, -2.0 * masses[:, None] * [1.0, -2.0, 0.5])


@pytest.mark.parametrize("name", ["mujoco", "pybullet"])
@pytest.mark.parametrize(("body", "material"), BODIES)
def test_a_free_body_slows_down_exponentially(name, body, material):
    """v = v0 exp(-alpha t) after a push, to alpha^2 t h / 2 of explicit steps; no gravity."""
    rate, effect = 3.0, ViscousDamping(rate=3.0)
    scene = scene_of(body, material, np.zeros(3))
    world = engine(name, time_step=0.002).open(scene)
    try:
        start = np.array([0.4, 0.3, -0.2])
        world.step(np.zeros((0, 3)), world.masses[:, None] * start / 0.002)
        force = effect.bind(scene, world.masses)
        assert world.state().velocities == pytest.approx(moving(body, start), rel=1e-6)
        for k in range(200):
            world.step(np.zeros((0, 3)), force(0.002 * k, world.state()))
        expected = moving(body, start * np.exp(-rate * 0.4))
        np.testing.assert_allclose(world.state().velocities, expected, rtol=0.5 * rate**2 * 0.4 * 0.002 * 1.1)
        np.testing.assert_allclose(world.state().velocities, moving(body, start * (1 - rate * 0.002) ** 200), rtol=1e-5)
    finally:
        world.close()


def test_a_falling_body_nears_g_over_alpha():
    """g / alpha (t - (1 - exp(-alpha t)) / alpha), to half a step's fall."""
    times, rate = np.array([0.0, 0.2, 0.5, 1.0, 2.0]), 4.0
    fallen = -(vertices(SHEET, ClothMaterial(), times, ViscousDamping(rate=rate)) - SHEET.vertices)[:, :, 2]
    expected = G / rate * (times - (1 - np.exp(-rate * times)) / rate)
    np.testing.assert_allclose(fallen, np.tile(expected[:, None], len(SHEET.vertices)), atol=0.005 * G / rate)


def swing_of_a_beam(*effects):
    """Angular frequency and rate of decay of the first mode of a soft clamped beam, little bent, at 1 ms."""
    body = solid_box(np.zeros(3), np.array([0.1, 0.03, 0.03]), (5, 3, 3))
    held = np.flatnonzero(body.vertices[:, 0] < 1e-9)
    material = SolidMaterial(density=1000.0, youngs_modulus=2e5)
    path = vertices(body, material, np.arange(0.0, 0.8, 0.001), *effects, grasps=(held,), time_step=0.001)
    tip = path[:, -9:, 2].mean(axis=1)
    turn = np.flatnonzero(np.diff(tip[:-1]) * np.diff(tip[1:]) < 0) + 1
    swings = np.abs(np.diff(tip[turn]))
    when = 0.001 * turn
    return np.pi / np.diff(when).mean(), -np.polyfit(0.5 * (when[1:] + when[:-1]), np.log(swings), 1)[0]


def test_a_mode_decays_at_half_alpha_and_at_beta_w2_over_2():
    """Beyond what the engine damps by itself."""
    frequency, own = swing_of_a_beam()
    _, viscous = swing_of_a_beam(ViscousDamping(rate=4.0))
    assert viscous - own == pytest.approx(2.0, rel=0.04)
    _, internal = swing_of_a_beam(InternalDamping(damping_time=0.002))
    assert internal - own == pytest.approx(0.5 * 0.002 * frequency**2, rel=0.04)
    _, both = swing_of_a_beam(ViscousDamping(rate=4.0), InternalDamping(damping_time=0.002))
    assert both - own == pytest.approx(2.0 + 0.5 * 0.002 * frequency**2, rel=0.04)


@pytest.mark.parametrize("material", [ClothMaterial(damping_time=0.01), SolidMaterial()])
def test_internal_damping_adds_to_the_material_and_changes_nothing_else(material):
    changed = InternalDamping(damping_time=0.02).on_material(material)
    assert changed.damping_time == pytest.approx(material.damping_time + 0.02)
    assert {**vars(changed), "damping_time": 0} == {**vars(material), "damping_time": 0}


def test_internal_damping_twice_is_their_sum():
    """As an effect and as a material: the same trajectory bit for bit."""
    times, held = np.linspace(0, 0.2, 5), (np.array([0]),)
    undamped = ClothMaterial(damping_time=0.0)
    effect = vertices(SHEET, undamped, times, InternalDamping(damping_time=0.01), grasps=held)
    natively = vertices(SHEET, ClothMaterial(damping_time=0.01), times, grasps=held)
    np.testing.assert_array_equal(effect, natively)


@pytest.mark.parametrize(("body", "material"), BODIES)
def test_internal_damping_leaves_free_fall_alone(body, material):
    times = np.linspace(0, 0.3, 4)
    damped = vertices(body, material, times, InternalDamping(damping_time=0.05))
    np.testing.assert_allclose(damped, vertices(body, material, times), atol=1e-8)


def test_internal_damping_leaves_a_pendulum_nearly_alone_and_calms_ripples():
    """A strip let go at an angle: the swing stays, the ripple of its stretch goes."""
    body = cloth_grid(0.02, 0.1, 2, 5)
    x, _, z = body.vertices.T
    leaning = Body("cloth", np.stack([x, 0.3 * z, np.sqrt(1 - 0.3**2) * z], axis=1), body.elements, body.grid)
    material = ClothMaterial(stretch_stiffness=20.0, bending_rigidity=1e-3, damping_time=0.0)
    times = np.arange(0, 0.6, 0.001)
    held = (np.array([0, 1]),)
    lengths, reach = [], []
    for effects in ((), (InternalDamping(damping_time=0.02),)):
        tip = vertices(leaning, material, times, *effects, grasps=held, time_step=0.001)[:, -2:].mean(axis=1)
        lengths.append(np.abs(np.diff(np.linalg.norm(tip, axis=1), n=2)).max())
        reach.append(np.ptp(tip[:, 1]))
    assert lengths[1] < 0.6 * lengths[0]
    assert reach[1] == pytest.approx(reach[0], rel=0.05)
