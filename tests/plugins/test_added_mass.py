"""The air that a sheet carries along, against closed forms."""

import numpy as np
import pytest
from effect_objects import LYING, SHEET, G, play, scene_of, vertices

from muslin.core.body import Body, cloth_grid
from muslin.core.material import ClothMaterial
from muslin.core.motion import Motion
from muslin.core.obstacles import Table
from muslin.plugins.effects.added_mass import AddedMass, width
from muslin.plugins.effects.surface import AIR_DENSITY

DENSITY = ClothMaterial().areal_density
engines = pytest.mark.parametrize("name", ["reference", "mujoco", "pybullet"])


def air_of(body, fraction=1.0):
    """Added mass per area [kg/m2]."""
    return fraction * np.pi / 4 * AIR_DENSITY * width(body)


def tilted(body, angle):
    cos, sin = np.cos(angle), np.sin(angle)
    return Body("cloth", body.vertices @ np.array([[1, 0, 0], [0, cos, -sin], [0, sin, cos]]).T, body.elements)


@pytest.mark.parametrize(("across", "down"), [(0.3, 0.2), (0.2, 0.3), (0.5, 0.5), (1.0, 0.1)])
@pytest.mark.parametrize("counts", [(2, 2), (5, 7)])
def test_width_is_the_shorter_side_of_a_rectangle(across, down, counts):
    assert width(tilted(cloth_grid(across, down, *counts), 0.7)) == pytest.approx(min(across, down), rel=1e-9)


def test_a_sheet_of_30_cm_carries_as_much_air_as_cloth_weighs():
    assert air_of(cloth_grid(0.3, 0.3, 3, 3)) == pytest.approx(0.284, abs=5e-4)


@pytest.mark.parametrize("fraction", [0.3, 1.0])
def test_the_load_is_the_added_mass_of_the_area(fraction):
    loads = AddedMass(fraction=fraction).on_loads(SHEET, ClothMaterial(), np.full(20, 0.01))
    np.testing.assert_allclose(loads, 0.01 + air_of(SHEET, fraction) * SHEET.vertex_measures, rtol=1e-12)


@engines
@pytest.mark.parametrize("fraction", [0.5, 1.0])
def test_broadside_it_starts_falling_with_g_m_over_m_plus_added_mass(name, fraction):
    body = cloth_grid(0.3, 0.3, 4, 4)
    flat = Body("cloth", body.vertices[:, [0, 2, 1]], body.elements)
    run = play(name, scene_of(flat), 0.2, AddedMass(fraction=fraction))
    expected = -G * DENSITY / (DENSITY + air_of(body, fraction)) * run.times
    np.testing.assert_allclose(run.velocities[:, :, 2], np.tile(expected[:, None], 16), atol=1e-6)


@engines
def test_edge_on_it_falls_as_if_there_were_no_air(name):
    """After the few steps in which the acceleration becomes known; none of the speed is lost for good."""
    body = cloth_grid(0.3, 0.3, 4, 4)
    run = play(name, scene_of(body), 0.3, AddedMass(fraction=1.0))
    late = run.times > 0.25
    expected = np.tile(-G * run.times[late, None], 16)
    np.testing.assert_allclose(run.velocities[late][:, :, 2], expected, rtol=1e-6)


@engines
@pytest.mark.parametrize("angle", [0.4, 1.0])
def test_aslant_it_glides(name, angle):
    """Across itself with g cos m / (m + m_a), along itself with g sin, until it turns."""
    body = tilted(Body("cloth", LYING.vertices, LYING.elements), angle)
    run = play(name, scene_of(body), 0.2, AddedMass(fraction=1.0))
    down, normal = np.array([0, 0, -1.0]), np.array([0, -np.sin(angle), np.cos(angle)])
    across = (down @ normal) * normal
    expected = G * (across * DENSITY / (DENSITY + air_of(body)) + down - across)
    np.testing.assert_allclose(run.mean_velocity[-1] / run.times[-1], expected, atol=0.02 * G)


def test_a_hanging_sheet_weighs_no_more():
    """The shape at rest is that without air."""
    times, held = [0.0, 0.01], (np.array([0, 4]),)
    soft = ClothMaterial(stretch_stiffness=20.0, damping_time=0.02)
    plain = vertices(SHEET, soft, times, grasps=held, settle=1.5)
    carried = vertices(SHEET, soft, times, AddedMass(fraction=1.0), grasps=held, settle=1.5)
    np.testing.assert_allclose(carried[0], plain[0], atol=2e-4)


def energy(run, body, fraction):
    """Of the cloth and the air, without the elastic one [J]: 1/2 m v^2 + 1/2 m_a (n . v)^2."""
    dry = body.vertex_measures * DENSITY
    corners = run.positions[:, body.elements]
    normals = np.cross(corners[:, :, 1] - corners[:, :, 0], corners[:, :, 2] - corners[:, :, 0])
    normals /= np.linalg.norm(normals, axis=2, keepdims=True)
    through = np.einsum("tfx,tfkx->tfk", normals, run.velocities[:, body.elements])
    share = air_of(body, fraction) * body.measures / 3
    air = 0.5 * np.einsum("f,tfk->t", share, through**2)
    return 0.5 * np.einsum("v,tvx->t", dry, run.velocities**2) + air


@engines
@pytest.mark.parametrize(("spin", "along"), [((0, 0, 0), 2.0), ((6, 1, 2), 0.0), ((6, 1, 2), 2.0), ((0, 10, 0), 2.0)])
def test_a_sheet_thrown_gains_no_energy(name, spin, along):
    """Flying edge-on and spinning, soft, with ripples, no gravity: after the throw its energy never rises."""
    rng = np.random.default_rng(3)
    arm = SHEET.vertices - SHEET.vertices.mean(axis=0)
    push = np.cross(np.array(spin, float), arm) + [along, 0, 0] + 0.05 * rng.normal(size=arm.shape)
    run = play(name, scene_of(SHEET, gravity=np.zeros(3)), 1.0, AddedMass(fraction=1.0), push=push)
    after = energy(run, SHEET, 1.0)[run.times > 0.12]
    assert np.isfinite(after).all()
    assert after.max() < 1.02 * after[0]


@pytest.mark.parametrize("stiffness", [30.0, 3000.0])
def test_a_sheet_carried_to_and_fro_stretches_no_more_than_its_inertia_asks(stiffness):
    """Held by two corners, light and stiff or soft, with six times its mass of air: it neither bounces nor blows up."""
    body = cloth_grid(0.8, 0.8, 7, 7)
    material = ClothMaterial(areal_density=0.11, stretch_stiffness=stiffness)
    times = np.linspace(0.0, 1.0, 101)
    path = np.stack([0.2 * np.sin(8 * times) ** 2, 0.1 * np.sin(6 * times), 0 * times], axis=1)
    more = {"grasps": (np.array([0, 6]),), "motion": Motion.from_positions(times, path[:, None])}
    moved = vertices(body, material, times, AddedMass(fraction=1.0), **more)
    stretch = body.edge_lengths(moved) / body.edge_lengths(body.vertices)
    weight = 0.11 * 0.8 * 0.8 * G / 0.133  # all of it on the two cells at the corners
    assert stretch.max() < 1 + 4 * weight / stiffness + 0.01


def test_a_sheet_dropped_on_a_table_comes_to_rest():
    """On every engine, stiff: contact does not wake what is fed back."""
    for name in ("reference", "mujoco", "pybullet"):
        lifted = Body("cloth", LYING.vertices + np.array([0, 0, 0.05]), LYING.elements)
        scene = scene_of(lifted, ClothMaterial(stretch_stiffness=1000.0), obstacles=[Table(0.0)])
        run = play(name, scene, 0.8, AddedMass(fraction=1.0))
        assert np.abs(run.positions[-1, :, 2]).max() < 0.003, name
        assert np.abs(run.velocities[-1]).max() < 0.05, name
