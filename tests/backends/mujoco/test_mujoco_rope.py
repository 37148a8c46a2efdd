"""Rope against rods, strings, catenaries and pendulums."""

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("mujoco")

from mujoco_scenes import HEAVY_ELASTICA, HEAVY_SAG, G, droop, opened, run, scene, swing

from muslin.core.body import Body, rope_line
from muslin.core.material import RopeMaterial

NO_GRAVITY = np.zeros(3)


def _rope(vertices: np.ndarray) -> Body:
    index = np.arange(len(vertices) - 1)
    return Body("rope", vertices, np.stack([index, index + 1], axis=1))


def _clamped(length: float, segments: int) -> Body:
    """Along x, with one more segment behind x = 0 to be held."""
    return rope_line(np.array([[-length / segments, 0.0, 0.0], [length, 0.0, 0.0]]), segments + 2)


@pytest.mark.parametrize("stiffness", [10.0, 1e5])
def test_a_pull_stretches_it_by_force_over_stiffness(stiffness):
    """1 % of strain, to 0.5 %, of Saint Venant and Kirchhoff: force = E A e (1 + e) (1 + e/2)."""
    body = rope_line(np.array([[0.0, 0.0, 0.0], [0.5, 0.0, 0.0]]), 11)
    forces = np.zeros_like(body.vertices)
    forces[-1, 0] = 0.01 * stiffness
    with opened(scene(body, RopeMaterial(0.05, stiffness), held=np.array([0]), gravity=NO_GRAVITY)) as world:
        stretch = run(world, 1.5, body.vertices[:1], forces, brake=8.0)[-1, 0] / 0.5 - 1.0
    assert stretch * (1 + stretch) * (1 + stretch / 2) == pytest.approx(0.01, rel=0.005)


@pytest.mark.parametrize("rigidity", [1e-6, 1e-2])
def test_a_clamped_rope_sags_as_the_heavy_elastica(rigidity):
    """To 2 % with 8 segments and 0.5 % with 16."""
    material = RopeMaterial(HEAVY_ELASTICA * rigidity / (G * 1e-3), 1e4, rigidity, rigidity)
    coarse, fine = (droop(_clamped(0.1, n), material) / HEAVY_SAG for n in (8, 16))
    assert coarse == pytest.approx(1.0, abs=0.02)
    assert fine == pytest.approx(1.0, abs=0.005)


@pytest.mark.parametrize("time_step", [0.001, 0.005])
def test_period_of_a_clamped_rod(time_step):
    """3.516 / L^2 sqrt(E I / mass per length), to 1.5 %; it decays by less than 3 % of implicit Euler's h w^2 / 2."""
    length, rigidity, density = 0.3, 1e-2, 0.05
    body, path = _clamped(length, 12), []
    material = RopeMaterial(density, 1e4, rigidity, rigidity)
    down = np.array([0.0, 0.0, -0.5])
    with opened(scene(body, material, held=np.array([0, 1]), gravity=down), time_step=time_step) as world:
        for _ in range(round(1.0 / time_step)):
            world.step(body.vertices[:2], None)
            path.append(world.state().positions[-1, 2])
    frequency, rate = swing(time_step, np.array(path))
    assert frequency == pytest.approx(3.516 / length**2 * np.sqrt(rigidity / density), rel=0.015)
    assert abs(rate) < 0.03 * time_step * frequency**2 / 2


def test_a_slack_rope_hangs_as_a_catenary():
    """1 m between points 0.8 m apart: the sag to 1 %, started from a bow."""
    half = 0.4
    scale = np.array([0.1, 1.0])
    for _ in range(60):  # bisection of 2 a sinh(half / a) = 1
        a = scale.mean()
        scale = np.array([a, scale[1]]) if 2 * a * np.sinh(half / a) > 1.0 else np.array([scale[0], a])
    body = rope_line(np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]), 21)
    share = np.linspace(0.0, 1.0, 21)
    start = np.stack([0.8 * share, 0 * share, -1.2 * share * (1 - share)], axis=1)
    held = np.array([0, 20])
    material = RopeMaterial(0.05, 5000.0, 1e-7, 1e-7, damping_time=1e-3)
    with opened(scene(body, material, held=held, start=start)) as world:
        sag = -run(world, 4.0, start[held], brake=4.0)[:, 2].min()
    assert sag == pytest.approx(a * (np.cosh(half / a) - 1), rel=0.01)


def test_pendulum_period():
    """A stiff rope from one held vertex: sqrt(3 g / 2 L), to 1 % for the lumped masses."""
    body, path = rope_line(np.array([[0.0, 0.0, 0.0], [0.0, 0.05, -0.4975]]), 11), []
    with opened(scene(body, RopeMaterial(0.05, 1e4, 1.0, 1.0), held=np.array([0]))) as world:
        for _ in range(800):
            world.step(body.vertices[:1], None)
            path.append(world.state().positions[-1, 1])
    assert swing(0.005, np.array(path))[0] == pytest.approx(np.sqrt(1.5 * G / 0.5), rel=0.01)


@pytest.mark.parametrize("tension", [5.0, 2000.0])
def test_a_taut_string_stays_put(tension):
    """Also where a wave crosses a segment in a hundredth of a step."""
    body = rope_line(np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]), 41)
    start = body.vertices * [1.02, 0.0, 0.0] + 0.01 * np.sin(np.pi * body.vertices[:, :1]) * [0.0, 0.0, 1.0]
    held = np.array([0, 40])
    material = RopeMaterial(0.005, tension / 0.02, 1e-6, 1e-6)
    with opened(scene(body, material, held=held, start=start)) as world:
        final = run(world, 2.0, start[held], brake=8.0)
    sag = 0.005 * G / (8 * tension)
    assert -final[20, 2] == pytest.approx(sag, rel=0.06)


@pytest.mark.parametrize(("bending", "twist"), [(1e-3, 1e-2), (1e-3, 1e-3), (1e-3, 1e-4)])
def test_a_quarter_circle_pushed_out_of_its_plane_bends_and_twists(bending, twist):
    """Its end yields by P R^3 (pi / (4 E I) + (3 pi / 4 - 2) / (G J)); to 3 %."""
    radius, segments = 0.1, 16
    angle = np.linspace(0.0, np.pi / 2, segments + 1)
    arc = radius * np.stack([np.sin(angle), 1 - np.cos(angle), 0 * angle], axis=1)
    body = _rope(np.concatenate([[[-radius * np.pi / 2 / segments, 0.0, 0.0]], arc]))
    forces = np.zeros_like(body.vertices)
    expected = 0.01 * radius
    forces[-1, 2] = expected / (radius**3 * (np.pi / 4 / bending + (0.75 * np.pi - 2) / twist))
    material = RopeMaterial(0.05, 1e4, bending, twist, damping_time=0.01)
    with opened(scene(body, material, held=np.array([0, 1]), gravity=NO_GRAVITY)) as world:
        moved = run(world, 5.0, body.vertices[:2], forces, brake=8.0)
    assert moved[-1, 2] == pytest.approx(expected, rel=0.03)


def _helix() -> Body:
    angle = np.linspace(0.0, 4 * np.pi, 60)
    return _rope(np.stack([0.05 * np.cos(angle), 0.05 * np.sin(angle), 0.01 * angle], axis=1))


@pytest.mark.parametrize("turned", [False, True])
def test_a_helix_is_at_rest_where_it_was_made_and_wherever_it_was_taken(turned):
    body = _helix()
    turn = np.array([[0.0, -0.6, 0.8], [1.0, 0.0, 0.0], [0.0, 0.8, 0.6]])
    start = body.vertices @ turn.T + [0.1, 0.2, 0.3] if turned else body.vertices
    material = RopeMaterial(bending_rigidity=1e-2, twist_rigidity=1e-2)
    with opened(scene(body, material, gravity=NO_GRAVITY, start=start)) as world:
        np.testing.assert_allclose(run(world, 0.5), start, atol=1e-9)


def test_a_clamp_says_how_a_bent_rope_is_turned_and_not_how_it_starts():
    """Started in another plane than that in which it is bent at rest, it comes back into its own."""
    angle = np.linspace(0.0, 1.2, 13)
    arc = 0.2 * np.stack([np.sin(angle), 1 - np.cos(angle), 0 * angle], axis=1)
    body = _rope(np.concatenate([[[-0.02, 0.0, 0.0]], arc]))
    start = body.vertices[:, [0, 1, 1]] * [1.0, np.cos(0.9), np.sin(0.9)]
    material = RopeMaterial(0.05, 1e4, 1e-2, 1e-2, damping_time=0.01)
    with opened(scene(body, material, held=np.array([0, 1]), gravity=NO_GRAVITY, start=start)) as world:
        final = run(world, 3.0, body.vertices[:2], brake=8.0)
    np.testing.assert_allclose(final, body.vertices, atol=0.004)


def test_a_straight_rope_started_bent_straightens():
    straight = rope_line(np.array([[0.0, 0.0, 0.0], [0.4, 0.0, 0.0]]), 17)
    angle = straight.vertices[:, 0] / 0.2
    start = 0.2 * np.stack([np.sin(angle), 0 * angle, 1 - np.cos(angle)], axis=1)
    what = scene(straight, RopeMaterial(bending_rigidity=1e-2), gravity=NO_GRAVITY, start=start)
    with opened(what) as world:
        np.testing.assert_allclose(world.state().positions, start, atol=1e-15)
        ends = run(world, 4.0, brake=4.0)[[0, -1]]
    assert np.linalg.norm(ends[1] - ends[0]) == pytest.approx(0.4, rel=1e-3)


def test_a_rope_that_starts_twisted_stays_where_turning_its_end_has_taken_it():
    """Slack between two grippers, of which the second turns it about itself by 4 rad: it comes out of its plane."""
    x, count, twist = np.linspace(-0.15, 0.15, 21), 21, 4.0
    body = _rope(np.stack([x, 0 * x, 0.35 * np.cosh(x / 0.1) / np.cosh(1.5)], axis=1))
    straight = rope_line(np.array([[0.0, 0.0, 0.0], [body.measures.sum(), 0.0, 0.0]]), count)
    held = np.array([0, 1, count - 2, count - 1])
    material = RopeMaterial(0.05, 1e4, 1e-3, 1e-3, damping_time=0.01)
    ends = body.vertices[held]
    what = scene(straight, material, held=held, start=body.vertices)
    with opened(what, time_step=0.0025) as world:
        for t in np.linspace(0.0, 1.0, 400):
            world.step(ends, None, None, np.array([0.0, twist * t]))
        for _ in range(2000):
            world.step(ends, -8.0 * world.masses[:, None] * world.state().velocities, None, np.array([0.0, twist]))
        turned = world.state().positions.copy()
    assert np.abs(turned[:, 1]).max() > 0.005

    def moved(start_twist):
        with opened(replace(what, start=turned, start_twist=start_twist), time_step=0.0025) as world:
            return np.abs(run(world, 0.5, ends) - turned).max()

    assert moved(0.0) > 0.005
    assert moved(twist) < 0.1 * moved(0.0)


@pytest.mark.parametrize("vertices", [2, 3])
def test_the_shortest_ropes_fall(vertices):
    """By g t^2 / 2, and 3/2 of what the first step is off by, which is thrown on from 1 / 1.7 of it."""
    body = rope_line(np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0]]), vertices)
    with opened(scene(body, replace(RopeMaterial(), bending_rigidity=0.0, twist_rigidity=0.0))) as world:
        fallen = 0.1**2 / 2 + 1.5 * (1 / 1.7 - 1 / 2) * 0.005**2
        np.testing.assert_allclose(run(world, 0.1)[:, 2], -G * fallen, rtol=1e-8)
