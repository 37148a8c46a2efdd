"""Cloth against closed forms."""

import numpy as np
import pytest

pytest.importorskip("pybullet")

from pybullet_scenes import GRAVITY, NONE_HELD, SMALL_CLOTH, WEIGHTLESS, flat, opened, run, scene

from muslin.backends.pybullet.bending import CurvedBending, FlatBending
from muslin.core.body import Body, cloth_grid
from muslin.core.material import ClothMaterial
from muslin.core.obstacles import Table
from muslin.core.plate import bending_matrix, is_flat


@pytest.mark.parametrize("poisson", [0.1, 0.4])
def test_tensile_strip(poisson):
    columns, rows, width, length, strain = 5, 13, 0.05, 0.15, 0.01
    body = cloth_grid(width, length, columns, rows)
    top, bottom, middle = np.arange(columns), np.arange(-columns, 0), columns * (rows // 2)
    share = np.array([0.5, 1, 1, 1, 0.5]) / (columns - 1)
    forces = np.zeros_like(body.vertices)
    forces[bottom, 2] = -300.0 * width * strain * share
    material = ClothMaterial(stretch_stiffness=300.0, poisson_ratio=poisson, damping_time=0.02)
    with opened(scene(body, material, held=top, gravity=WEIGHTLESS)) as world:
        moved = run(world, 0.1, body.vertices[top], forces) - body.vertices
    stretch = -moved[bottom, 2].mean() / length
    narrowing = (moved[middle, 0] - moved[middle + columns - 1, 0]) / width
    # Saint Venant-Kirchhoff: force = E t w e (1 + e) (1 + e/2). The clamp costs what lateral strain it forbids.
    assert stretch * (1 + stretch) * (1 + stretch / 2) == pytest.approx(strain, rel=0.02)
    assert narrowing / stretch == pytest.approx(poisson, rel=0.06)


@pytest.mark.parametrize(("columns", "rows", "angle"), [(33, 5, 0.0), (17, 17, 0.0), (17, 17, 90.0), (17, 17, 45.0)])
def test_energy_of_a_cylinder(columns, rows, angle):
    """D k^2 / 2 per area; what is missing is the half-cell or so at the free ends, where a moment vanishes."""
    body = cloth_grid(0.01 * (columns - 1), 0.01 * (rows - 1), columns, rows)
    radius = 2.0
    arc = body.vertices @ [np.cos(np.radians(angle)), 0.0, np.sin(np.radians(angle))]
    offset = np.stack([arc - radius * np.sin(arc / radius), radius * (1 - np.cos(arc / radius))])
    along = np.array([np.cos(np.radians(angle)), 0.0, np.sin(np.radians(angle))])
    bent = body.vertices - offset[0][:, None] * along + offset[1][:, None] * [0.0, 1.0, 0.0]
    energy = 0.5 * np.einsum("va,vw,wa", bent, bending_matrix(body, NONE_HELD), bent)
    cells = columns - 1 if angle != 90.0 else rows - 1
    lost = 1.5 / cells if angle != 45.0 else 0.0
    assert energy / (0.5 / radius**2 * body.measures.sum()) == pytest.approx(1 - lost, rel=0.03)


def test_bending_feels_neither_rigid_motion_nor_stretch():
    matrix = bending_matrix(SMALL_CLOTH, NONE_HELD)
    affine = SMALL_CLOTH.vertices @ np.random.default_rng(0).normal(size=(3, 3)) + 1.0
    assert np.abs(matrix @ affine).max() < 1e-9 * np.abs(matrix).max()
    assert np.linalg.eigvalsh(matrix)[3] > 0


def _droop(rigidity: float, rows: int = 9) -> float:
    """Tip sag [m] of a 0.1 m strip of 0.15 kg/m2 between rows clamped one cell deep."""
    cell = 0.1 / (rows - 1)
    sheet = cloth_grid(2 * cell, 0.1 + cell, 3, rows + 1)
    turned = np.stack([-sheet.vertices[:, 2] - cell, sheet.vertices[:, 0], np.zeros(len(sheet.vertices))], axis=1)
    body = Body("cloth", turned, sheet.elements, sheet.grid)
    held = np.flatnonzero(turned[:, 0] < 1e-9)
    material = ClothMaterial(stretch_stiffness=20.0, bending_rigidity=rigidity, damping_time=1e-3)
    with opened(scene(body, material, held=held)) as world:
        return float(-run(world, 0.8, turned[held], brake=8.0)[-3:, 2].mean())


def test_cantilever_droops_like_an_elastica():
    """rho g L^3 / D = 7.35: 0.0616 m from the boundary value problem of the heavy elastica."""
    sag = _droop(2e-4)
    assert sag == pytest.approx(0.0616, rel=0.06)
    assert _droop(4e-4) < 0.85 * sag


def test_narrow_stiff_sheet_swings_like_a_rod():
    length, columns, rows = 0.2, 2, 9
    body = cloth_grid(0.025, length, columns, rows)
    held = np.arange(columns)
    gravity = 9.80665 * np.array([0.0, np.sin(0.05), -np.cos(0.05)])
    with opened(scene(body, ClothMaterial(bending_rigidity=5e-2), held=held, gravity=gravity)) as world:
        tip = []
        for _ in range(400):
            world.step(body.vertices[held], None)
            tip.append(world.state().positions[-1, 1])
    swing = np.array(tip) - np.mean([np.max(tip), np.min(tip)])
    up = np.flatnonzero((swing[:-1] < 0) & (swing[1:] >= 0))
    crossings = up + swing[up] / (swing[up] - swing[up + 1])
    period = np.diff(crossings).mean() * 0.005
    # A physical pendulum of the lumped masses: I / (m g l).
    mass, depth = body.vertex_measures, -body.vertices[:, 2]
    expected = 2 * np.pi * np.sqrt((mass @ depth**2) / (9.80665 * mass @ depth))
    assert period == pytest.approx(expected, rel=0.01)


@pytest.mark.parametrize("friction", [0.0, 0.2])
def test_table_holds_the_sheet_and_brakes_it(friction):
    body = flat(SMALL_CLOTH, 0.3)
    material = ClothMaterial(friction=friction)
    gravity = np.array([0.3 * 9.80665, 0.0, -9.80665])
    with opened(scene(body, material, gravity=gravity, obstacles=(Table(0.3),))) as world:
        moved = run(world, 0.25) - body.vertices
    np.testing.assert_allclose(moved[:, 2], 0.0, atol=1e-4)
    np.testing.assert_allclose(moved[:, 0], 0.5 * 9.80665 * (0.3 - friction) * 0.25**2, rtol=0.03)


def test_table_friction_holds_below_its_angle():
    body = flat(SMALL_CLOTH, 0.3)
    gravity = np.array([0.3 * 9.80665, 0.0, -9.80665])
    with opened(scene(body, ClothMaterial(friction=0.5), gravity=gravity, obstacles=(Table(0.3),))) as world:
        assert np.abs(run(world, 0.25) - body.vertices).max() < 1e-3


def test_damping_lets_a_sheet_turn():
    body = SMALL_CLOTH
    with opened(scene(body, ClothMaterial(damping_time=5e-3), gravity=WEIGHTLESS)) as world:
        spin = np.cross([0.0, 2.0, 0.0], body.vertices - body.vertices.mean(axis=0))
        world._velocities = spin + 0.0
        run(world, 0.4)
        centre = body.vertices.mean(axis=0)
        arm = world.state().positions - centre
        turning = (world.masses[:, None] * np.cross(arm, world.state().velocities)).sum(axis=0)
        before = (world.masses[:, None] * np.cross(body.vertices - centre, spin)).sum(axis=0)
    assert turning[1] == pytest.approx(before[1], rel=0.01)


def test_gravity_hangs_all_weight_on_the_held_row():
    """Hanging stretch of a sheet: rho g L^2 / (2 E t) at its lower edge."""
    body = cloth_grid(0.1, 0.2, 5, 9)
    held = np.arange(5)
    material = ClothMaterial(stretch_stiffness=30.0, areal_density=0.1, poisson_ratio=0.0, damping_time=0.02)
    with opened(scene(body, material, held=held)) as world:
        moved = run(world, 0.3, body.vertices[held]) - body.vertices
    expected = 0.1 * -GRAVITY[2] * 0.2**2 / (2 * 30.0)
    assert -moved[-5:, 2].mean() == pytest.approx(expected, rel=0.02)


def test_flatness():
    assert is_flat(SMALL_CLOTH)
    bent = SMALL_CLOTH.vertices.copy()
    bent[3, 1] = 0.01
    assert not is_flat(Body("cloth", bent, SMALL_CLOTH.elements))


def test_a_stiffer_weft_stretches_less():
    """Ratio 4: half of S along the warp, twice along the weft, under the same pull along either."""
    strains = []
    for along_warp in (True, False):
        sheet = cloth_grid(0.04, 0.08, 3, 5)
        share = np.tile([0.0, 1.0], (len(sheet.elements), 1))
        body = Body("cloth", sheet.vertices, sheet.elements, sheet.grid)
        down = body.warp_directions(body.vertices)[:, 2]
        assert np.abs(np.abs(down) - 1).max() < 1e-9
        if not along_warp:
            edges = body.vertices[body.elements[:, 1:]] - body.vertices[body.elements[:, :1]]
            plane = edges[:, :, [0, 2]]
            share = np.linalg.solve(plane.transpose(0, 2, 1), np.tile([1.0, 0.0], (len(plane), 1))[:, :, None])[:, :, 0]
            body = Body("cloth", sheet.vertices, sheet.elements, sheet.grid, share)
        forces = np.zeros_like(body.vertices)
        forces[-3:, 2] = -300.0 * 0.04 * 0.01 * np.array([0.25, 0.5, 0.25])
        material = ClothMaterial(poisson_ratio=0.0, weft_stretch_ratio=4.0, damping_time=0.01)
        with opened(scene(body, material, held=np.arange(3), gravity=WEIGHTLESS)) as world:
            moved = run(world, 0.15, body.vertices[:3], forces) - body.vertices
        strains.append(-moved[-3:, 2].mean() / 0.08)
    # Saint Venant-Kirchhoff: f = S e (1 + e) (1 + e / 2).
    for strain, expected in zip(strains, (0.02, 0.005), strict=True):
        assert strain * (1 + strain) * (1 + strain / 2) == pytest.approx(expected, rel=0.02)


def _roof() -> Body:
    """A quarter of a cylinder of 0.1 m, 0.1 m long."""
    flat_sheet = cloth_grid(np.pi / 2 * 0.1, 0.1, 9, 6)
    angle = flat_sheet.vertices[:, 0] / 0.1
    round_sheet = np.stack([0.1 * np.sin(angle), flat_sheet.vertices[:, 2], 0.1 * np.cos(angle)], axis=1)
    return Body("cloth", round_sheet, flat_sheet.elements, flat_sheet.grid)


def test_a_curved_rest_shape_stays():
    body = _roof()
    with opened(scene(body, ClothMaterial(bending_rigidity=1e-4), gravity=WEIGHTLESS)) as world:
        assert np.abs(run(world, 0.3) - body.vertices).max() < 1e-12


def test_hinges_cost_what_the_flat_matrix_says():
    """Small bends of a flat sheet, woven and clamped or not."""
    noise = 1e-5 * np.random.default_rng(1).normal(size=len(SMALL_CLOTH.vertices))
    bent = SMALL_CLOTH.vertices + np.outer(noise, [0.0, 1.0, 0.0])
    for held in (NONE_HELD, np.arange(10)):
        for ratio in (1.0, 3.0):
            hinges = CurvedBending(SMALL_CLOTH, 2e-5, ratio, held)
            flat_sheet = FlatBending(SMALL_CLOTH, 2e-5, ratio, held)
            off = hinges.forces(bent) - flat_sheet.forces(bent)
            assert np.abs(off).max() < 1e-3 * np.abs(flat_sheet.forces(bent)).max()


def test_opening_a_roof_costs_the_change_of_curvature():
    """D (k - k0)^2 / 2 per area, from radius 0.1 m to 0.12 m; what is missing is a half-cell at the free ends."""
    body = _roof()
    bending = CurvedBending(body, 2e-5, 1.0, NONE_HELD)
    angle = np.arctan2(body.vertices[:, 0], body.vertices[:, 2]) * 0.1 / 0.12
    wider = np.stack([0.12 * np.sin(angle), body.vertices[:, 1], 0.12 * np.cos(angle)], axis=1)
    energy = 0.0
    for share in (np.arange(20) + 0.5) / 20:  # the work along the way
        place = body.vertices + share * (wider - body.vertices)
        energy -= np.vdot(bending.forces(place), wider - body.vertices) / 20
    expected = 0.5 * 2e-5 * (1 / 0.1 - 1 / 0.12) ** 2 * body.measures.sum()
    assert energy / expected == pytest.approx(1 - 1.5 / 8, rel=0.06)
