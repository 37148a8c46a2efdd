"""Ropes against closed forms."""

import numpy as np
import pytest

pytest.importorskip("pybullet")

from pybullet_scenes import GRAVITY, NOWHERE, WEIGHTLESS, opened, run, scene

from muslin.core.body import Body, rope_line
from muslin.core.errors import RolloutFailed
from muslin.core.material import RopeMaterial

G = -GRAVITY[2]


def _rope(length: float, count: int, start: float = 0.0) -> Body:
    return rope_line(np.array([[start, 0.0, 0.0], [length, 0.0, 0.0]]), count)


def test_tension():
    """F = EA e, and a factor on the stiffness of every element divides the strain."""
    body = _rope(0.5, 11)
    forces = np.zeros_like(body.vertices)
    forces[-1, 0] = 4.0
    material = RopeMaterial(stretch_stiffness=200.0, damping_time=5e-3)
    with opened(scene(body, material, held=np.array([0]), gravity=WEIGHTLESS)) as world:
        stretched = run(world, 0.4, body.vertices[:1], forces, brake=10.0)[-1, 0]
        assert stretched / 0.5 - 1 == pytest.approx(4.0 / 200.0, rel=1e-3)
        for _ in range(80):
            brake = -10.0 * world.masses[:, None] * world.state().velocities
            world.step(body.vertices[:1], forces + brake, np.full(10, 4.0))
        assert world.state().positions[-1, 0] / 0.5 - 1 == pytest.approx(4.0 / 800.0, rel=1e-2)


@pytest.mark.parametrize(("count", "error"), [(7, 0.06), (13, 0.02)])
def test_cantilever_sags_like_an_elastica(count, error):
    """rho g L^3 / EI = 3: 0.10190 m of 0.3 m from the boundary value problem of the heavy elastica."""
    cell = 0.3 / (count - 1)
    body = _rope(0.3, count + 1, -cell)
    rigidity = 1e-3
    density = 3.0 * rigidity / (G * 0.3**3)
    material = RopeMaterial(linear_density=density, stretch_stiffness=200.0, bending_rigidity=rigidity)
    with opened(scene(body, material, held=np.array([0, 1]))) as world:
        sag = -run(world, 2.0, body.vertices[:2], brake=8.0)[-1, 2]
    assert sag == pytest.approx(0.10190, rel=error)


def _period(path: np.ndarray, step: float) -> float:
    swing = path - 0.5 * (path.max() + path.min())
    up = np.flatnonzero((swing[:-1] < 0) & (swing[1:] >= 0))
    return float(np.diff(up + swing[up] / (swing[up] - swing[up + 1])).mean() * step)


def test_beam_period():
    """Clamped and free: 2 pi / 1.8751^2 sqrt(rho L^4 / EI)."""
    count, length, density, rigidity = 13, 0.3, 0.05, 1e-2
    cell = length / (count - 1)
    body = _rope(length, count + 1, -cell)
    material = RopeMaterial(linear_density=density, stretch_stiffness=500.0, bending_rigidity=rigidity)
    expected = 2 * np.pi / 1.87510**2 * np.sqrt(density * length**4 / rigidity)
    with opened(scene(body, material, held=np.array([0, 1]), gravity=np.array([0.0, 0.0, -0.1]))) as world:
        tip = []
        for _ in range(round(3 * expected / world.time_step)):
            world.step(body.vertices[:2], None)
            tip.append(world.state().positions[-1, 2])
    assert _period(np.array(tip), 0.005) == pytest.approx(expected, rel=0.03)


def test_pendulum_period():
    """A limp rope that hangs from its end: 2 pi / (j0 / 2) sqrt(L / g) with j0 = 2.4048, the heavy chain."""
    length = 0.3
    body = rope_line(np.array([[0.0, 0.0, 0.0], [0.0, 0.0, -length]]), 13)
    gravity = G * np.array([np.sin(0.03), 0.0, -np.cos(0.03)])
    material = RopeMaterial(stretch_stiffness=100.0, bending_rigidity=1e-7)
    with opened(scene(body, material, held=np.array([0]), gravity=gravity)) as world:
        middle = []
        for _ in range(700):
            world.step(body.vertices[:1], None)
            middle.append(world.state().positions[:, 0] @ world.masses)
    expected = 4 * np.pi / 2.40483 * np.sqrt(length / G)
    assert _period(np.array(middle), 0.005) == pytest.approx(expected, rel=0.03)


def test_catenary():
    """Length 0.5 m over a span of 0.4 m: y = a cosh(x / a) with 2 a sinh(span / 2 a) = length."""
    length, span, count = 0.5, 0.4, 21
    low, high = 0.05, 5.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if 2 * middle * np.sinh(span / 2 / middle) > length else (low, middle)
    sag = low * (np.cosh(span / 2 / low) - 1)
    body = _rope(length, count)
    corner = np.sqrt((length / 2) ** 2 - (span / 2) ** 2)
    start = rope_line(np.array([[0.0, 0, 0], [span / 2, 0, -corner], [span, 0, 0]]), count).vertices
    material = RopeMaterial(stretch_stiffness=100.0, bending_rigidity=1e-7, damping_time=1e-3)
    with opened(scene(body, material, held=np.array([0, count - 1]), start=start)) as world:
        found = run(world, 1.0, start[[0, -1]], brake=6.0)
    assert -found[:, 2].min() == pytest.approx(sag, rel=0.02)


def test_a_curved_rest_shape_stays_and_opens_under_a_load():
    """A quarter circle, clamped: at rest nothing moves; a small end load opens it by pi F R^3 / (4 EI)."""
    radius, count, rigidity, force = 0.1, 9, 1e-3, 2e-3
    angle = np.linspace(0.0, np.pi / 2, count)
    step = angle[1]
    angle = np.concatenate([[-step], angle])
    points = radius * np.stack([np.sin(angle), 0 * angle, 1 - np.cos(angle)], axis=1)
    chain = np.arange(count)
    body = Body("rope", points, np.stack([chain, chain + 1], axis=1))
    material = RopeMaterial(stretch_stiffness=100.0, bending_rigidity=rigidity)
    held = np.array([0, 1])
    with opened(scene(body, material, held=held, gravity=WEIGHTLESS)) as world:
        assert np.abs(run(world, 0.2, points[held]) - points).max() < 1e-9
        forces = np.zeros_like(points)
        forces[-1, 0] = force
        moved = run(world, 0.6, points[held], forces, brake=12.0) - points
    # Castigliano with M = F (height of the end - z): R^3 F / EI times the integral of cos^2 over the quarter: pi / 4.
    assert moved[-1, 0] == pytest.approx(np.pi / 4 * force * radius**3 / rigidity, rel=0.05)


@pytest.mark.parametrize("density", [0.005, 0.3])
@pytest.mark.parametrize("rigidity", [1e-6, 1e-2])
@pytest.mark.parametrize("stiffness", [10.0, 1e5])
@pytest.mark.parametrize("per_metre", [10, 40])
def test_extremes_run_or_are_refused_with_a_reason(density, rigidity, stiffness, per_metre):
    body = _rope(0.5, per_metre // 2 + 1)
    material = RopeMaterial(linear_density=density, bending_rigidity=rigidity, stretch_stiffness=stiffness)
    try:
        with opened(scene(body, material, held=np.array([0]))) as world:
            for k in range(10):
                world.step(body.vertices[:1] + np.array([0.0, 0.0, 0.005 * k]), None)
            assert np.isfinite(world.state().positions).all()
            stretch = np.linalg.norm(np.diff(world.state().positions, axis=0), axis=1) / body.measures
            assert stretch.max() < 3.0
    except RolloutFailed as failed:
        assert "substeps" in str(failed)
        assert stiffness == 1e5 or rigidity == 1e-2


def test_two_vertices_are_a_rope():
    body = _rope(0.1, 2)
    with opened(scene(body, RopeMaterial(), gravity=GRAVITY)) as world:
        assert run(world, 0.1, NOWHERE)[0, 2] < -0.04
