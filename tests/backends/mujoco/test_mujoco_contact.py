"""Tables, spools and meshes: who carries the weight, friction, and that nothing goes through."""

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("mujoco")

from mujoco_scenes import DOWN, NOWHERE, G, opened, run, scene

from muslin.core.body import Body, cloth_grid, rope_line, solid_box
from muslin.core.material import ClothMaterial, Material, RopeMaterial, SolidMaterial
from muslin.core.obstacles import Cylinder, StaticMesh, Table

TABLE = (Table(0.0),)


def _level_sheet(size: float, count: int, height: float) -> Body:
    sheet = cloth_grid(size, size, count, count)
    vertices = sheet.vertices[:, [0, 2, 1]]
    return replace(sheet, vertices=vertices - vertices.mean(axis=0) + [0.0, 0.0, height], warp=None)


def _lying(kind: str, friction: float = 0.5, height: float = 0.0) -> tuple[Body, Material, float]:
    """An object on a table, its material, and how high its vertices lie above the surface."""
    if kind == "cloth":
        return _level_sheet(0.2, 6, height), ClothMaterial(friction=friction), 0.0
    if kind == "rope":
        ends = np.array([[0.0, 0.0, height + 0.004], [0.3, 0.0, height + 0.004]])
        return rope_line(ends, 10), RopeMaterial(diameter=0.008, friction=friction), 0.004
    low, high = np.array([0.0, 0.0, height]), np.array([0.06, 0.06, height + 0.02])
    return solid_box(low, high, (3, 3, 3)), SolidMaterial(friction=friction), 0.0


@pytest.mark.parametrize("kind", ["cloth", "rope", "solid"])
def test_a_table_carries_the_weight_at_its_height(kind):
    """Dropped from 1 cm: at rest the contact forces add up to the weight, and vertices touch to 0.2 mm."""
    body, material, above = _lying(kind, height=0.01)
    with opened(scene(body, material, obstacles=TABLE)) as world:
        assert not world.state().contact_forces().any()
        lowest = run(world, 1.0)[:, 2].min()
        total = world.state().contact_forces().sum(axis=0)
        np.testing.assert_allclose(total, [0.0, 0.0, world.masses.sum() * G], atol=2e-3 * world.masses.sum() * G)
    assert lowest == pytest.approx(above, abs=2e-4)


def test_contact_forces_are_those_on_each_vertex():
    """Of a level sheet at rest every vertex is carried with its own weight; without obstacles there are none."""
    body, material, _ = _lying("cloth")
    with opened(scene(body, material, obstacles=TABLE)) as world:
        run(world, 1.0)
        np.testing.assert_allclose(world.state().contact_forces()[:, 2], world.masses * G, rtol=0.02)
    with opened(scene(body, material)) as world:
        run(world, 0.1)
        assert not world.state().contact_forces().any()


@pytest.mark.parametrize("kind", ["cloth", "rope", "solid"])
@pytest.mark.parametrize("obstacle_friction", [1.0, 0.4])
def test_an_incline_holds_below_and_lets_slide_above_the_product_of_frictions(kind, obstacle_friction):
    """At 95 % and 105 % of the angle of friction. What is held creeps by less than 0.1 mm/s."""
    body, material, _ = _lying(kind)
    speeds = []
    for share in (0.95, 1.05):
        angle = np.arctan(share * material.friction * obstacle_friction)
        down = G * np.array([np.sin(angle), 0.0, -np.cos(angle)])
        with opened(scene(body, material, gravity=down, obstacles=(Table(0.0, obstacle_friction),))) as world:
            before = run(world, 0.3)[:, 0].mean()
            speeds.append((run(world, 0.7)[:, 0].mean() - before) / 0.7)
    assert speeds[0] < 1e-4
    assert speeds[1] > 0.02


def test_sliding_costs_friction_times_the_normal_force():
    """A sheet pulled over the table at 5 cm/s, to 1 %; its normal force is its weight to 2 %."""
    body = _level_sheet(0.2, 9, 0.0)
    held = np.flatnonzero(body.vertices[:, 1] > 0.1 - 1e-9)
    free = np.setdiff1d(np.arange(len(body.vertices)), held)
    forces = []
    with opened(scene(body, ClothMaterial(friction=0.5, damping_time=5e-3), held=held, obstacles=TABLE)) as world:
        for k in range(160):
            world.step(body.vertices[held] + [0.0, 0.05 * max(0.0, 0.005 * (k + 1) - 0.1), 0.0], None)
            if k > 80:
                forces.append(world.state().contact_forces()[free].sum(axis=0))
        weight = world.masses[free].sum() * G
    pull, normal = np.mean(forces, axis=0)[1:]
    assert -pull / normal == pytest.approx(0.5, rel=0.01)
    assert normal == pytest.approx(weight, rel=0.02)


@pytest.mark.slow
@pytest.mark.parametrize("friction", [0.1, 0.3])
@pytest.mark.parametrize("tension", [0.1, 1.0])
def test_capstan(friction, tension):
    """Half a turn round a spool at 2 cm/s: the tensions' ratio is exp(mu pi), to 5 %."""
    spool, segment, leg, thick = 0.03, 0.005, 0.08, 0.004
    radius = spool + thick / 2
    angle = np.linspace(np.pi, 0.0, round(np.pi * radius / segment) + 1)
    arc = radius * np.stack([np.cos(angle), 0 * angle, np.sin(angle)], axis=1)
    down = np.stack([np.full(16, -radius), np.zeros(16), np.linspace(-leg, -segment, 16)], axis=1)
    start = np.concatenate([down, arc, down[::-1] * [-1.0, 1.0, 1.0]])
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(start, axis=0), axis=1))])
    index = np.arange(len(start) - 1)
    straight = np.stack([along, 0 * along, 0 * along], axis=1)
    body = Body("rope", straight, np.stack([index, index + 1], axis=1))
    forces, held, pulls = np.zeros_like(start), np.array([len(start) - 1]), []
    forces[0, 2] = -tension
    material = RopeMaterial(0.02, 500.0, 1e-6, 1e-6, thick, 0.01, friction)
    cylinder = Cylinder(np.zeros(3), np.array([0.0, 1.0, 0.0]), spool, 0.2)
    with opened(scene(body, material, held=held, start=start, gravity=np.zeros(3), obstacles=(cylinder,))) as world:
        for k in range(240):
            world.step(start[held] + [0.0, 0.0, -0.02 * max(0.0, 0.005 * (k + 1) - 0.2)], forces)
            if k > 150:
                pulls.append(world.state().contact_forces()[:, 2].sum() - tension)
        depth = cylinder.signed_distance(world.state().positions)[0].min() - thick / 2
    assert np.mean(pulls) / tension == pytest.approx(np.exp(friction * np.pi), rel=0.05)
    assert depth > -1e-3


def _octahedron(radius: float) -> StaticMesh:
    corners = radius * np.array([[1.0, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]])
    faces = [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]]
    return StaticMesh(corners, np.array(faces))


def _corner_block() -> StaticMesh:
    """An L seen from above, 5 cm high with its top at z = 0: its hull would cover the missing quarter."""
    outline = np.array([[0.0, 0], [0.12, 0], [0.12, 0.04], [0.04, 0.04], [0.04, 0.12], [0, 0.12]]) - 0.06
    vertices = np.concatenate([np.c_[outline, np.full(6, -0.05)], np.c_[outline, np.zeros(6)]])
    top = [[0, 1, 2], [0, 2, 3], [0, 3, 5], [3, 4, 5]]
    faces = [[a + 6, b + 6, c + 6] for a, b, c in top] + [[a, c, b] for a, b, c in top]
    for i in range(6):
        j = (i + 1) % 6
        faces += [[i, j, j + 6], [i, j + 6, i + 6]]
    return StaticMesh(vertices, np.array(faces))


@pytest.mark.parametrize(
    ("obstacle", "top"),
    [
        pytest.param(Cylinder(np.zeros(3), np.array([0.0, 1.0, 0.0]), 0.03, 0.3), 0.03, id="lying-cylinder"),
        pytest.param(Cylinder(np.zeros(3), np.array([0.0, 0.0, 1.0]), 0.06, 0.03), 0.015, id="disc"),
        pytest.param(Cylinder(np.zeros(3), np.array([0.0, 1.0, 0.0]), 0.004, 0.3), 0.004, id="thin-rod"),
        pytest.param(_octahedron(0.08), 0.08, id="convex-mesh"),
        pytest.param(_corner_block(), 0.0, id="mesh-that-is-not-convex"),
    ],
)
@pytest.mark.parametrize("kind", ["cloth", "rope"])
def test_falling_on_an_obstacle_it_stays_outside(obstacle, top, kind):
    """Let fall from 3 cm, on the rod from 1 cm: hardly deeper than one step of its fall (4 mm), and its fall is broken.

    A rod of 8 mm would be passed at 0.8 m/s, where half its thickness is one step.
    """
    fall = 0.01 if top == 0.004 else 0.03
    if kind == "cloth":
        body, material = _level_sheet(0.2, 9, top + fall), ClothMaterial(friction=1.0, damping_time=2e-3)
    else:
        height = top + fall + 0.003
        body = rope_line(np.array([[-0.1, -0.03, height], [0.1, -0.03, height]]), 15)
        material = RopeMaterial(friction=1.0, diameter=0.006)
    worst, carried = 0.0, 0.0
    with opened(scene(body, material, obstacles=(obstacle,))) as world:
        for k in range(70):
            world.step(NOWHERE, None)
            carried += world.state().contact_forces()[:, 2].sum() / (70 * world.masses.sum() * G)
            if k % 5 == 0:
                worst = min(worst, float(obstacle.signed_distance(world.state().positions)[0].min()))
    assert worst > -0.008
    assert carried > 0.2


def test_a_mesh_that_is_not_convex_leaves_its_hollow_free():
    """A small block falls past the missing quarter of the L."""
    body = solid_box(np.array([0.015, 0.015, 0.01]), np.array([0.045, 0.045, 0.03]), (3, 3, 3))
    with opened(scene(body, SolidMaterial(), obstacles=(_corner_block(),))) as world:
        assert run(world, 0.2)[:, 2].max() < -0.1
    with opened(
        scene(replace(body, vertices=body.vertices - [0.06, 0.06, 0.0]), SolidMaterial(), obstacles=(_corner_block(),))
    ) as world:
        assert run(world, 0.4)[:, 2].min() > -2e-3


def test_two_obstacles_have_frictions_of_their_own():
    """Two tables cannot be told apart by place, but the higher one is the one that is met."""
    body, material, _ = _lying("cloth", friction=1.0)
    slides = []
    for frictions in ((0.0, 1.0), (1.0, 0.0)):
        both = (Table(0.0, frictions[0]), Table(-0.1, frictions[1]))
        with opened(scene(body, material, gravity=DOWN + np.array([2.0, 0.0, 0.0]), obstacles=both)) as world:
            slides.append((run(world, 0.3) - body.vertices)[:, 0].mean())
    assert slides[0] == pytest.approx(0.5 * 2.0 * 0.3**2, rel=0.05)
    assert abs(slides[1]) < 1e-3
