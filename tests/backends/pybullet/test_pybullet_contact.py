"""Contact and friction against closed forms."""

import numpy as np
import pytest

pytest.importorskip("pybullet")

from pybullet_scenes import GRAVITY, NOWHERE, flat, opened, run, scene

from muslin.backends.pybullet.tables import Tables
from muslin.core.body import cloth_grid, rope_line, solid_box
from muslin.core.material import ClothMaterial, RopeMaterial, SolidMaterial
from muslin.core.obstacles import Cylinder, StaticMesh, Table

G = -GRAVITY[2]
OBJECTS = [
    pytest.param(flat(cloth_grid(0.1, 0.1, 5, 5), 0.3), ClothMaterial(damping_time=2e-3), id="cloth"),
    pytest.param(rope_line(np.array([[0, 0, 0.304], [0.3, 0, 0.304]]), 9), RopeMaterial(damping_time=1e-3), id="rope"),
    pytest.param(
        solid_box(np.array([0, 0, 0.3]), np.array([0.06, 0.05, 0.34]), (4, 3, 3)),
        SolidMaterial(damping_time=1e-3),
        id="solid",
    ),
]


def _mean_contact(world, seconds, held=NOWHERE):
    """Contact forces ``(V, 3)`` averaged over ``seconds``."""
    total, steps = 0.0, round(seconds / world.time_step)
    for _ in range(steps):
        world.step(held, None)
        total = total + world.state().contact_forces() / steps
    return total


@pytest.mark.parametrize(("body", "material"), OBJECTS)
def test_a_table_carries_the_weight_and_nothing_creeps(body, material):
    with opened(scene(body, material, obstacles=(Table(0.3),))) as world:
        run(world, 0.3)
        force = _mean_contact(world, 0.2)
        moved = world.state().positions - body.vertices
    np.testing.assert_allclose(force.sum(axis=0) / (world.masses.sum() * G), [0.0, 0.0, 1.0], atol=2e-3)
    assert np.abs(moved[body.vertices[:, 2] < 0.305]).max() < 2e-4


@pytest.mark.parametrize("count", [1, 2, 9, 50])
@pytest.mark.parametrize("radius", [0.0, 0.004])
def test_vertices_that_touch_together_each_do_what_one_alone_would(count, radius):
    """On the surface at the end of the step, and slowed by mu times the push, or to rest."""
    height, friction, time, rng = 0.7, 0.4, 3e-4, np.random.default_rng(count)
    tables = Tables((Table(height, 0.8),), friction / 0.8, radius, 60)
    try:
        for _ in range(5):
            gap = rng.uniform(0.0, 5e-5, count)
            x = np.stack([*rng.uniform(-0.3, 0.3, (2, count)), height + radius + gap], axis=1)
            v = np.stack([*rng.uniform(-0.3, 0.3, (2, count)), -rng.uniform(0.2, 0.4, count)], axis=1)
            expected = v.copy()
            expected[:, 2] = -gap / time
            push, slide = expected[:, 2] - v[:, 2], np.hypot(v[:, 0], v[:, 1])
            expected[:, :2] *= np.maximum(1.0 - friction * push / slide, 0.0)[:, None]
            place, velocity = tables.step(x, v, time)
            np.testing.assert_allclose(velocity, expected, atol=1e-9)
            np.testing.assert_allclose(place, x + time * expected, atol=1e-12)
    finally:
        tables.close()


def test_penetration_is_taken_back_without_a_bounce():
    body = flat(cloth_grid(0.1, 0.1, 3, 3), 0.299)
    with opened(scene(body, ClothMaterial(), obstacles=(Table(0.3),))) as world:
        run(world, 0.2)
        assert np.abs(world.state().positions[:, 2] - 0.3).max() < 1e-6
        assert np.abs(world.state().velocities).max() < 1e-6


def test_nearly_the_same_landing_is_nearly_the_same():
    """A tilted sheet falls on its corner; 3e-11 m between two starts are no more than 1e-8 m at the end."""
    sheet = flat(cloth_grid(0.2, 0.2, 7, 7))
    tilted = sheet.vertices + np.outer(sheet.vertices @ [0.15, 0.1, 0.0], [0.0, 0.0, 1.0])
    tilted[:, 2] += 0.005 - tilted[:, 2].min()
    body = type(sheet)("cloth", tilted, sheet.elements)
    noise = 3e-11 * np.random.default_rng(0).normal(size=tilted.shape)
    ends = []
    for start in (tilted, tilted + noise):
        with opened(scene(body, ClothMaterial(), start=start, obstacles=(Table(0.0),))) as world:
            ends.append(run(world, 0.25))
            assert ends[-1][:, 2].min() > -1e-9
    assert np.abs(ends[1] - ends[0]).max() < 1e-8


@pytest.mark.parametrize(("body", "material"), OBJECTS[:2])
@pytest.mark.parametrize("friction", [0.15, 0.4])
def test_incline(body, material, friction):
    """Friction of both sides multiplied: nothing moves below its angle, and it slides by the rest above it."""
    own = type(material)(friction=friction / 0.8)
    for share in (0.95, 1.05):
        angle = np.arctan(friction * share)
        gravity = G * np.array([np.sin(angle), 0.0, -np.cos(angle)])
        with opened(scene(body, own, gravity=gravity, obstacles=(Table(0.3, 0.8),))) as world:
            slid = (run(world, 0.4) - body.vertices)[:, 0].mean()
        free = 0.5 * gravity[0] * 0.4**2
        expected = max(0.0, 0.5 * (gravity[0] + friction * gravity[2]) * 0.4**2)
        assert abs(slid - expected) < 0.004 * free


def _sphere(radius: float) -> StaticMesh:
    """A ball of 8 x 12 facets."""
    polar, round_ = np.linspace(0, np.pi, 9)[1:-1], np.linspace(0, 2 * np.pi, 13)[:-1]
    ring = [[np.sin(p) * np.cos(r), np.sin(p) * np.sin(r), np.cos(p)] for p in polar for r in round_]
    points = radius * np.array([[0.0, 0.0, 1.0], *ring, [0.0, 0.0, -1.0]])
    last = len(points) - 1
    faces = [[0, 1 + k, 1 + (k + 1) % 12] for k in range(12)]
    faces += [[last, last - 12 + (k + 1) % 12, last - 12 + k] for k in range(12)]
    for row in range(6):
        for k in range(12):
            a, b = 1 + 12 * row + k, 1 + 12 * row + (k + 1) % 12
            faces += [[a, a + 12, b], [b, a + 12, b + 12]]
    return StaticMesh(points, np.array(faces))


@pytest.mark.parametrize(
    "obstacle", [_sphere(0.05), Cylinder(np.zeros(3), np.array([0.0, 1.0, 0.0]), 0.05, 0.3)], ids=["ball", "cylinder"]
)
def test_cloth_falls_on_a_round_thing_and_stays_outside(obstacle):
    body = flat(cloth_grid(0.12, 0.12, 7, 7), 0.08)
    body = type(body)(body.kind, body.vertices + np.array([0.0, 0.06, 0.0]), body.elements, body.grid)
    with opened(scene(body, ClothMaterial(damping_time=1e-3), obstacles=(obstacle,))) as world:
        for _ in range(50):
            world.step(NOWHERE, -2.0 * world.masses[:, None] * world.state().velocities)
            assert obstacle.signed_distance(world.state().positions)[0].min() > -2e-4
        assert np.abs(world.state().positions[:, 2]).max() < 0.08
        assert _mean_contact(world, 0.05)[:, 2].sum() > 0.3 * world.masses.sum() * G


def test_a_fast_vertex_does_not_tunnel():
    """At 5 m/s, onto a thin disc."""
    disc = Cylinder(np.zeros(3), np.array([0.0, 0.0, 1.0]), 0.1, 0.01)
    body = flat(cloth_grid(0.06, 0.06, 3, 3), 0.25)
    body = type(body)(body.kind, body.vertices + np.array([0.0, 0.03, 0.0]), body.elements, body.grid)
    with opened(scene(body, ClothMaterial(), gravity=5.0 * GRAVITY, obstacles=(disc,))) as world:
        for _ in range(60):
            world.step(NOWHERE, None)
            assert world.state().positions[:, 2].min() > 0.0049


@pytest.mark.slow
@pytest.mark.parametrize("friction", [0.1, 0.3])
def test_capstan(friction):
    """A rope that slides over half a turn: what holds is exp(-mu pi) of what pulls. And it lies on the surface."""
    radius, side, count, stiffness = 0.03, 0.1, 37, 50.0
    around = radius + 0.004
    arc = np.linspace(0.0, 2 * side + np.pi * around, count)
    turn = np.pi - (np.clip(arc, side, side + np.pi * around) - side) / around
    down = np.minimum(0.0, arc - side) + np.minimum(0.0, side + np.pi * around - arc)
    start = np.stack([around * np.cos(turn), 0 * arc, around * np.sin(turn) + down], axis=1)
    body = rope_line(np.array([[0.0, 0.0, 0.0], [arc[-1], 0.0, 0.0]]), count)
    material = RopeMaterial(0.02, stretch_stiffness=stiffness, bending_rigidity=1e-7, diameter=0.008, friction=friction)
    loads = np.zeros(count)
    loads[-1] = 0.05
    spool = Cylinder(np.zeros(3), np.array([0.0, 1.0, 0.0]), radius, 0.2)
    tensions = []
    with opened(scene(body, material, held=np.array([0]), loads=loads, start=start, obstacles=(spool,))) as world:
        for k in range(200):
            rate = 30.0 * world.masses[:, None] * world.state().velocities
            rate[loads > 0] = 0.0
            world.step(start[:1] + np.array([0.0, 0.0, 0.05 * 0.005 * (k + 1)]), -rate)
            place = world.state().positions
            tensions.append(stiffness * (np.linalg.norm(np.diff(place, axis=0), axis=1) / body.measures - 1))
    mean = np.mean(tensions[100:], axis=0)
    touching = place[place[:, 2] > 0.005]
    assert np.abs(np.hypot(touching[:, 0], touching[:, 2]) - around).max() < 1e-4
    assert mean[:2].mean() / mean[-2:].mean() == pytest.approx(np.exp(-friction * np.pi), rel=0.08)
