"""What holds on every engine: closed forms, held vertices, effects that are off, and what the other engine says."""

from dataclasses import replace
from functools import partial
from math import factorial
from typing import ClassVar

import numpy as np
import pytest
from engine_runs import ENGINES, G, rising_zeros, scenario, simulator, turned

from muslin.core.body import cloth_grid, rope_line, solid_box
from muslin.core.errors import InputError
from muslin.core.material import ClothMaterial, RopeMaterial, SolidMaterial
from muslin.core.motion import Motion
from muslin.core.obstacles import Table
from muslin.core.registry import REGISTRY
from muslin.core.rollout import COMMAND_STEP, rollout
from muslin.core.scenarios import preset
from muslin.core.simulator import Simulator
from muslin.plugins.effects.air import AirDrag
from muslin.plugins.effects.surface import AIR_DENSITY

CLOTH = cloth_grid(0.12, 0.12, 4, 4)
ROPE = rope_line(np.array([[0.0, 0.0, 0.0], [0.0, 0.0, -0.15]]), 7)
SOLID = solid_box(np.zeros(3), np.array([0.06, 0.05, 0.04]), (3, 3, 3))
OBJECTS = {
    "cloth": (CLOTH, ClothMaterial(stretch_stiffness=60.0), np.array([0, 3])),
    "rope": (ROPE, RopeMaterial(stretch_stiffness=20.0), np.array([0, 1])),
    "solid": (SOLID, SolidMaterial(youngs_modulus=5e4), np.arange(9)),
}
KINDS = tuple(OBJECTS)

pytestmark = pytest.mark.parametrize("engine", ENGINES)


@pytest.mark.parametrize("kind", KINDS)
def test_free_fall(engine, kind):
    """g t^2 / 2 to half a step, and what it is off by grows evenly: by g t s / 2 where symplectic Euler steps by s."""
    body, material, _ = OBJECTS[kind]
    times = np.array([0.0, 0.1, 0.2, 0.3])
    path = rollout(simulator(engine, time_step=0.005), scenario(body, turned(0.4), times), material).vertices
    moved = path - path[0]
    np.testing.assert_allclose(moved[:, :, :2], 0.0, atol=1e-9)
    fallen, t = -moved[1:, :, 2], times[1:, None]
    assert (np.abs(fallen - 0.5 * G * t**2) <= 0.5 * G * t * 0.005 + 1e-9).all()
    off = 2 * fallen / G - t**2
    assert (off > 0).all() and (off < 0.005 * t + 1e-9).all()
    np.testing.assert_allclose(np.diff(off, 2, axis=0), 0.0, atol=1e-8)


@pytest.mark.parametrize(("areal_density", "drag"), [(0.15, 1.2), (0.3, 0.6)])
def test_terminal_velocity_of_a_broadside_sheet(engine, areal_density, drag):
    """sqrt(2 m g / (rho C_D A)) to 1e-4, and on the way v^2 / g ln cosh(g t / v) to what one step moves."""
    final = np.sqrt(2 * areal_density * G / (AIR_DENSITY * drag))
    times = np.linspace(0.0, 6 * final / G, 61)
    flat = scenario(cloth_grid(0.3, 0.3, 4, 4), turned(np.pi / 2), times)
    effects = [AirDrag(drag_coefficient=drag)]
    path = rollout(simulator(engine), flat, ClothMaterial(areal_density=areal_density), effects).vertices
    fallen = path[0, :, 2] - path[:, :, 2]
    np.testing.assert_allclose(np.diff(fallen[-2:], axis=0) / (times[-1] - times[-2]), final, rtol=1e-4)
    expected = final**2 / G * np.log(np.cosh(G * times / final))
    np.testing.assert_allclose(fallen, np.tile(expected[:, None], len(flat.body.vertices)), atol=final * 0.005)


def test_terminal_velocity_of_a_box(engine):
    """Air meets a closed body on its leading faces alone: A is one face, where a sheet has one for two sides.

    After a second; later the box, pushed from below its centre, tips over, which is physics.
    """
    body = solid_box(np.zeros(3), np.array([0.06, 0.06, 0.02]), (3, 3, 3))
    material = SolidMaterial(density=20.0, youngs_modulus=2e4)
    final = np.sqrt(2 * 20.0 * 0.02 * G / (AIR_DENSITY * 1.2))
    times = np.array([0.0, 0.95, 1.0])
    effects = [AirDrag(drag_coefficient=1.2)]
    height = rollout(simulator(engine), scenario(body, turned(0.0), times), material, effects).vertices[:, :, 2]
    speed = -np.diff(height[1:].mean(axis=1)) / 0.05
    assert speed == pytest.approx(final * np.tanh(G * 0.975 / final), rel=2e-3)


@pytest.mark.parametrize("length", [0.2, 0.1])
def test_pendulum_period(engine, length):
    """A stiff strip that hangs from its top edge: a compound pendulum of the strip's lumped masses.

    2 pi sqrt(I / (m g r)), with (1 + angle^2 / 16) for the amplitude; for a uniform rod that is
    2 pi sqrt(2 L / (3 g)), which the lumping misses by 1 %.
    """
    angle = 0.1
    body = cloth_grid(length / 5, length, 2, 6)
    material = ClothMaterial(stretch_stiffness=3000.0, bending_rigidity=1e-2)
    period = 2 * np.pi * np.sqrt(2 * length / 3 / G)
    below, mass = -body.vertices[:, 2], body.vertex_measures
    expected = 2 * np.pi * np.sqrt((mass @ below**2) / (mass @ below) / G) * (1 + angle**2 / 16)
    assert expected == pytest.approx(period, rel=0.015)
    step = 0.005
    times = np.arange(0.0, 3.3 * period, step)
    path = rollout(simulator(engine), scenario(body, turned(angle), times, ([0, 1],)), material).vertices
    tip = path[:, -2:].mean(axis=1) - [0.0, 0.0, 1.0]
    np.testing.assert_allclose(np.linalg.norm(tip, axis=1), length, rtol=1e-3)
    periods = np.diff(rising_zeros(step, np.arctan2(tip[:, 1], -tip[:, 2])))
    assert len(periods) >= 2
    assert periods.mean() == pytest.approx(expected, rel=0.003)


@pytest.mark.parametrize("length", [0.5, 0.25])
def test_a_hanging_rope_swings_as_a_heavy_chain(engine, length):
    """Its slowest mode: 2 pi / (j / 2) sqrt(L / g) with j = 2.4048, the first zero of J_0; to 1 %.

    From a start in the shape of that mode, J_0(j sqrt(s / L)) at s above the free end, small.
    """
    body = rope_line(np.array([[0.0, 0.0, 0.0], [0.0, 0.0, -length]]), 21)
    material = RopeMaterial(stretch_stiffness=200.0, bending_rigidity=1e-8, twist_rigidity=1e-8)
    period = 4 * np.pi / 2.404826 * np.sqrt(length / G)
    above = 1.0 + body.vertices[:, 2] / length
    mode = sum((-1.4458 * above) ** k / factorial(k) ** 2 for k in range(12))
    step = 0.005
    times = np.arange(0.0, 2.3 * period, step)
    swinging = scenario(body, turned(0.0), times, ([0],), start=partial(bent, mode=0.02 * length * mode))
    path = rollout(simulator(engine), swinging, material).vertices
    middle = path[:, :, 1] @ body.vertex_measures
    periods = np.diff(rising_zeros(step, middle))
    assert len(periods) >= 1
    assert periods.mean() == pytest.approx(period, rel=0.01)


def bent(body, poses, grasps, obstacles, clearance, mode):
    """A rope in its world place, moved along y by ``mode (V,)`` [m]."""
    return body.vertices + np.outer(mode, [0.0, 1.0, 0.0])


@pytest.mark.parametrize("span", [0.8, 0.6])
def test_a_rope_between_two_grippers_hangs_as_a_catenary(engine, span):
    """Of 1 m: its sag a (cosh(span / 2 a) - 1), with 2 a sinh(span / 2 a) = 1 m, to 1 %."""
    low, high = 0.05, 5.0
    for _ in range(60):
        a = 0.5 * (low + high)
        low, high = (a, high) if 2 * a * np.sinh(span / 2 / a) > 1.0 else (low, a)
    base = preset("cable")
    poses = np.zeros((1, 2, 7))
    poses[:, :, 3], poses[:, 1, 1] = 1.0, span
    task = replace(
        base.scenario(vertices=[21]), grasps=(np.array([0]), np.array([20])), motion=Motion(np.zeros(1), poses)
    )
    task = replace(task, times=np.linspace(0.0, 0.5, 6), settle=2.5)
    material = RopeMaterial(stretch_stiffness=200.0, bending_rigidity=1e-7, twist_rigidity=1e-7, damping_time=1e-3)
    path = rollout(simulator(engine), task, material).vertices
    np.testing.assert_allclose(path[:, [0, 20]], np.broadcast_to(poses[0, :, :3], (6, 2, 3)), atol=1e-12)
    assert -path[:, :, 2].min(axis=1).mean() == pytest.approx(a * (np.cosh(span / 2 / a) - 1), rel=0.01)


def carried(kind, **more):
    """An object held and carried to and fro, turning, with the command sampled at the world's steps."""
    body, material, grasp = OBJECTS[kind]
    times = np.arange(61) * 0.005
    phase = np.pi * times / times[-1]
    place = np.stack([0.05 * np.sin(phase), 0.08 * np.sin(phase) ** 2, 1.0 + 0.0 * phase], axis=1)
    half = 0.2 * np.sin(phase)
    turn = np.stack([np.cos(half), np.sin(half), 0 * half, 0 * half], axis=1)
    motion = Motion(times, np.concatenate([place, turn], axis=1)[:, None])
    return scenario(body, motion, times, (grasp,), **more), material


@pytest.mark.parametrize("kind", KINDS)
def test_a_repeated_rollout_is_bit_identical(engine, kind):
    one, other = (rollout(simulator(engine), *carried(kind)).vertices for _ in range(2))
    np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("kind", KINDS)
def test_effects_at_zero_leave_one_that_is_on_alone(engine, kind):
    """All that are installed at once, in any order; what each does by itself is held by the kit of effects."""
    made = simulator(engine)
    installed = [REGISTRY.get("effect", name) for name in REGISTRY.names("effect")]
    others = [e() for e in installed if kind in e.object_kinds and e.needs <= made.capabilities]
    assert len(others) > 10
    wind = REGISTRY.get("effect", "wind")(velocity_x=1.0)
    alone = rollout(made, *carried(kind), [wind]).vertices
    np.testing.assert_array_equal(alone, rollout(made, *carried(kind), [*others, wind, *others]).vertices)
    assert np.abs(alone - rollout(made, *carried(kind)).vertices).max() > 1e-6  # air hardly moves a block


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("lag", [0.0, 0.03])
def test_held_vertices_follow_the_command_exactly(engine, kind, lag):
    """To rounding, at every step, translating and turning; with a lag they follow the lagging command."""
    task, material = carried(kind)
    effect = REGISTRY.get("effect", "actuator-lag")(time_constant=lag)
    done = rollout(simulator(engine), task, material, [effect])
    made = effect.on_command(task.motion, COMMAND_STEP) if lag else task.motion
    expected = replace(task, motion=made).held_positions(task.times, task.world_vertices())
    np.testing.assert_allclose(done.vertices[:, np.concatenate(task.grasps)], expected, rtol=0, atol=1e-12)
    np.testing.assert_array_equal(done.poses, made.at(task.times))
    assert np.ptp(expected, axis=0).max() > 0.05


@pytest.mark.parametrize("kind", KINDS)
def test_the_start_is_the_scenario_even_after_settling(engine, kind):
    """Without settling the first frame is the rest shape; with it the object already hangs, held where it was."""
    body, material, grasp = OBJECTS[kind]
    task = scenario(body, turned(0.0), np.linspace(0.0, 0.1, 11), (grasp,))
    np.testing.assert_array_equal(rollout(simulator(engine), task, material).vertices[0], task.world_vertices())
    settled = rollout(simulator(engine), replace(task, settle=1.0), material).vertices
    np.testing.assert_allclose(settled[0, grasp], task.world_vertices()[grasp], atol=1e-12)
    assert np.abs(settled[0] - task.world_vertices()).max() > 1e-4
    # A tenth of what an unsettled object moves in the same time.
    moved = [np.abs(v - v[0]).max() for v in (settled, rollout(simulator(engine), task, material).vertices)]
    assert moved[0] < 0.1 * moved[1]


def test_a_kind_of_object_it_does_not_have_is_refused_with_the_kinds_it_has(engine):
    class ClothOnly(type(simulator(engine))):
        object_kinds: ClassVar[frozenset[str]] = frozenset({"cloth"})

    body, material, grasp = OBJECTS["solid"]
    only: Simulator = ClothOnly()
    with pytest.raises(InputError, match=f"simulator '{engine}' has no solid; it has cloth"):
        rollout(only, scenario(body, turned(0.0), [0.0, 0.1], (grasp,)), material)


@pytest.mark.parametrize("vertex", [16, -1])
def test_a_grasp_vertex_that_does_not_exist_is_refused_with_its_number(engine, vertex):
    with pytest.raises(InputError, match=f"gripper 0 takes vertex {vertex}, but the mesh has vertices 0 to 15"):
        rollout(simulator(engine), scenario(CLOTH, turned(0.0), [0.0, 0.1], ([0, vertex],)), ClothMaterial())


def test_a_table_carries_vertices_at_its_height(engine):
    """A flat sheet dropped from 1 cm rests with its vertices on the table, to a tenth of a millimetre."""
    body = replace(cloth_grid(0.1, 0.1, 3, 3), vertices=cloth_grid(0.1, 0.1, 3, 3).vertices[:, [0, 2, 1]])
    drop = scenario(body, turned(0.0), [0.0, 1.0], obstacles=(Table(0.99),))
    last = rollout(simulator(engine), drop, ClothMaterial(damping_time=0.005)).vertices[-1]
    np.testing.assert_allclose(last[:, 2], 0.99, atol=1e-4)
