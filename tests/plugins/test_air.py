"""Drag, lift and wind in isolation."""

import numpy as np
import pytest
from effect_objects import BLOCK, SHEET, bound, cases, moving
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from muslin.core.body import Body, cloth_grid
from muslin.plugins.effects.air import PLATE_DRAG, AirDrag, Wind
from muslin.plugins.effects.surface import AIR_DENSITY, Surface, plate_force

components = st.floats(-10.0, 10.0).filter(lambda x: x == 0 or abs(x) > 1e-3)
vectors = hnp.arrays(np.float64, (4, 3), elements=components)
coefficients = st.floats(0.0, 2.5)


def turn(axis, angle):
    """Rotation matrix by Rodrigues' formula."""
    k = np.asarray(axis, float) / np.linalg.norm(axis)
    cross = np.cross(np.eye(3), -k)
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


@pytest.mark.parametrize("lift", [0.0, 0.7])
@pytest.mark.parametrize("speed", [-3.0, 0.5])
def test_broadside_is_half_rho_area_drag_speed_squared(speed, lift):
    """Whatever the lift coefficient, whichever side leads."""
    normal = np.array([2.0, -1.0, 2.0]) / 3
    force = plate_force(0.04 * normal[None], speed * normal[None], 1.2, lift, closed=False)
    np.testing.assert_allclose(force[0], -0.5 * AIR_DENSITY * 0.04 * 1.2 * speed * abs(speed) * normal, rtol=1e-12)


def test_edge_on_without_lift_feels_nothing():
    force = plate_force(np.array([[0.0, 0.0, 0.1]]), np.array([[3.0, 4.0, 0.0]]), 1.2, 0.0, closed=False)
    np.testing.assert_array_equal(force, 0.0)


@pytest.mark.parametrize("degrees", [5, 45, 80])
def test_drag_goes_with_the_sine_of_the_angle_of_attack_and_lift_with_its_cosine(degrees):
    angle = np.radians(degrees)
    wind_on = plate_force(
        np.array([[0.0, 0.0, 0.1]]), 2.0 * np.array([[np.cos(angle), 0.0, np.sin(angle)]]), 1.2, 0.4, closed=False
    )[0]
    pressure = 0.5 * AIR_DENSITY * 0.1 * 2.0**2
    assert -wind_on @ [np.cos(angle), 0, np.sin(angle)] == pytest.approx(pressure * 1.2 * np.sin(angle))
    assert wind_on @ [np.sin(angle), 0, -np.cos(angle)] == pytest.approx(pressure * 0.4 * np.cos(angle))


@cases
@given(vectors, vectors, coefficients, coefficients)
def test_lift_is_perpendicular_to_the_motion(areas, velocities, drag, lift):
    with_lift = plate_force(areas, velocities, drag, lift, closed=False)
    without = plate_force(areas, velocities, drag, 0.0, closed=False)
    power = np.einsum("fi,fi->f", with_lift - without, velocities)
    size = np.linalg.norm(areas, axis=1) * np.linalg.norm(velocities, axis=1) ** 3
    assert (np.abs(power) <= 1e-12 * size).all()


@cases
@given(vectors, vectors, coefficients, coefficients, st.booleans())
def test_air_only_takes_energy(areas, velocities, drag, lift, closed):
    """The power is -1/2 rho A C_D |v|^2 |v . n|, of the drag alone: never positive, for any lift coefficient."""
    power = np.einsum("fi,fi->f", plate_force(areas, velocities, drag, lift, closed), velocities)
    through = np.einsum("fi,fi->f", areas, velocities)
    through = np.maximum(through, 0.0) if closed else np.abs(through)
    expected = -0.5 * AIR_DENSITY * drag * np.einsum("fi,fi->f", velocities, velocities) * through
    np.testing.assert_allclose(power, expected, rtol=1e-7, atol=1e-7 * np.abs(expected).max() + 1e-9)


@cases
@given(vectors, vectors, coefficients, coefficients)
def test_lift_up_to_the_drag_opposes_every_part_of_the_motion(areas, velocities, drag, lift):
    """Across the triangle and along it; beyond C_D the air would push the triangle along its own plane."""
    force = plate_force(areas, velocities, drag, min(lift, drag), closed=False)
    normal = areas / np.maximum(np.linalg.norm(areas, axis=1, keepdims=True), 1e-300)
    across = np.einsum("fi,fi->f", force, normal) * np.einsum("fi,fi->f", velocities, normal)
    along = np.einsum("fi,fi->f", force, velocities) - across
    assert (across <= 1e-9).all()
    assert (along <= 1e-9 * (1 + np.abs(across))).all()


def test_lift_beyond_the_drag_pushes_along_the_plane():
    force = plate_force(np.array([[0.0, 0.0, 0.1]]), np.array([[1.0, 0.0, 1.0]]), 0.5, 1.0, closed=False)
    assert force[0, 0] > 0


@cases
@given(vectors, vectors)
def test_the_law_has_no_preferred_direction(areas, velocities):
    matrix = turn([1.0, 2.0, -0.5], 0.8)
    one = plate_force(areas, velocities, 1.2, 0.3, closed=False) @ matrix.T
    other = plate_force(areas @ matrix.T, velocities @ matrix.T, 1.2, 0.3, closed=False)
    leads = np.abs(np.einsum("fi,fi->f", areas, velocities)) > 1e-6  # edge on, rounding chooses the side of the lift
    np.testing.assert_allclose(one[leads], other[leads], rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("areas", [np.zeros((2, 3)), np.full((2, 3), 1e-200)])
def test_a_triangle_without_area_feels_nothing(areas):
    np.testing.assert_allclose(plate_force(areas, np.ones((2, 3)), 1.2, 0.4, closed=False), 0.0, atol=1e-150)


@cases
@given(hnp.arrays(np.float64, (len(SHEET.triangles), 3), elements=components))
def test_sharing_to_vertices_keeps_force_and_power(forces):
    """Thirds to the corners, and the mean velocity of the corners: the power is the same counted either way."""
    surface = Surface(SHEET)
    shared = surface.to_vertices(forces)
    np.testing.assert_allclose(shared.sum(axis=0), forces.sum(axis=0), atol=1e-9)
    velocities = np.random.default_rng(0).normal(size=SHEET.vertices.shape)
    assert np.sum(shared * velocities) == pytest.approx(np.sum(forces * surface.mean(velocities)), abs=1e-9)


def test_sharing_to_vertices_keeps_the_moment_about_the_triangles_centres():
    forces = np.random.default_rng(1).normal(size=(len(SHEET.triangles), 3))
    surface = Surface(SHEET)
    about_vertices = np.cross(SHEET.vertices, surface.to_vertices(forces)).sum(axis=0)
    np.testing.assert_allclose(about_vertices, np.cross(surface.mean(SHEET.vertices), forces).sum(axis=0), atol=1e-12)


@pytest.mark.parametrize("effect", [AirDrag(drag_coefficient=1.2, lift_coefficient=0.4), Wind(velocity_x=1.0)])
def test_a_sheet_has_no_inside(effect):
    """Turning every second triangle over changes nothing."""
    flipped = SHEET.elements.copy()
    flipped[::2] = flipped[::2, ::-1]
    other = Body("cloth", SHEET.vertices, flipped, SHEET.grid)
    rng = np.random.default_rng(2)
    positions, velocities = SHEET.vertices + 0.01 * rng.normal(size=(20, 3)), rng.normal(size=(20, 3))
    one, two = (bound(effect, body)(0.0, positions, velocities) for body in (SHEET, other))
    assert np.abs(one).max() > 0
    np.testing.assert_allclose(one, two, rtol=1e-12, atol=1e-15)


@pytest.mark.parametrize(("axis", "area"), [(0, 0.06), (1, 0.03), (2, 0.02)])
@pytest.mark.parametrize("speed", [-2.0, 2.0])
def test_a_box_is_held_back_by_its_leading_face_alone(axis, area, speed):
    velocity = np.zeros(3)
    velocity[axis] = speed
    force = bound(AirDrag(drag_coefficient=1.2), BLOCK)(0.0, BLOCK.vertices, moving(BLOCK, velocity))
    expected = -0.5 * AIR_DENSITY * area * 1.2 * speed * np.abs(velocity)
    np.testing.assert_allclose(force.sum(axis=0), expected * np.sign(velocity) * np.sign(speed), atol=1e-12)
    behind = BLOCK.vertices[:, axis] * np.sign(speed) < (BLOCK.vertices[:, axis] * np.sign(speed)).max() - 1e-9
    np.testing.assert_array_equal(force[behind], 0.0)


def test_the_mesh_does_not_matter():
    """A flat sheet in uniform motion, coarse and fine."""
    velocity, effect = [0.3, 2.0, -0.4], AirDrag(drag_coefficient=1.2, lift_coefficient=0.4)
    totals = []
    for count in (3, 9):
        body = cloth_grid(0.3, 0.2, count, count)
        totals.append(bound(effect, body)(0.0, body.vertices, moving(body, velocity)).sum(axis=0))
    np.testing.assert_allclose(totals[0], totals[1], rtol=1e-12)


@cases
@given(hnp.arrays(np.float64, (20, 3), elements=components), st.floats(-1.5, 1.5), st.floats(-1.5, 1.5))
def test_wind_is_what_moving_air_does_beyond_still_air(velocities, x, y):
    """Wind plus still-air drag of a plate is the drag at the velocity relative to the air."""
    still = bound(AirDrag(drag_coefficient=PLATE_DRAG), SHEET)
    wind = bound(Wind(velocity_x=x, velocity_y=y), SHEET)(0.0, SHEET.vertices, velocities)
    together = still(0.0, SHEET.vertices, velocities) + wind
    expected = still(0.0, SHEET.vertices, velocities - [x, y, 0.0])
    np.testing.assert_allclose(together, expected, atol=1e-9 * (1 + np.abs(expected).max()))


def test_a_sheet_that_drifts_with_the_wind_feels_nothing():
    velocities = moving(SHEET, [0.5, -1.0, 0.0])
    effects = (AirDrag(drag_coefficient=PLATE_DRAG), Wind(velocity_x=0.5, velocity_y=-1.0))
    total = sum(bound(effect, SHEET)(0.0, SHEET.vertices, velocities) for effect in effects)
    np.testing.assert_allclose(total, 0.0, atol=1e-15)


def test_wind_pushes_a_sheet_at_rest_downwind():
    """1/2 rho C_D A u |u| on a sheet that it blows on broadside; nothing on one that it passes."""
    body = SHEET  # in the x-z plane
    across = bound(Wind(velocity_y=-1.5), body)(0.0, body.vertices, moving(body, [0, 0, 0]))
    expected = [0.0, -0.5 * AIR_DENSITY * PLATE_DRAG * 0.02 * 1.5**2, 0.0]
    np.testing.assert_allclose(across.sum(axis=0), expected, rtol=1e-12)
    along = bound(Wind(velocity_x=-1.5), body)(0.0, body.vertices, moving(body, [0, 0, 0]))
    np.testing.assert_allclose(along, 0.0, atol=1e-15)


def test_density_of_air_is_that_of_an_ideal_gas_at_20_degrees():
    assert pytest.approx(101325 * 0.0289647 / (8.314462618 * 293.15), rel=1e-3) == AIR_DENSITY
