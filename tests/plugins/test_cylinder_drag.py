"""Air on a rope, against closed forms."""

import numpy as np
import pytest
from effect_objects import ROPE, G, bound, cases, moving, play, scene_of
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from muslin.core.body import rope_line
from muslin.core.material import RopeMaterial
from muslin.plugins.effects.air import CYLINDER_DRAG, CylinderDrag, Wind
from muslin.plugins.effects.line import cylinder_force
from muslin.plugins.effects.surface import AIR_DENSITY

components = st.floats(-10.0, 10.0).filter(lambda x: x == 0 or abs(x) > 1e-3)
vectors = hnp.arrays(np.float64, (4, 3), elements=components)


@pytest.mark.parametrize("speed", [-3.0, 0.5])
def test_across_it_is_half_rho_d_l_drag_speed_squared(speed):
    force = cylinder_force(np.array([[0.2, 0, 0]]), np.array([[0, 0, speed]]), 0.01, 1.1, 0.02)
    np.testing.assert_allclose(force, [[0, 0, -0.5 * AIR_DENSITY * 0.002 * 1.1 * speed * abs(speed)]], atol=1e-15)


@pytest.mark.parametrize("speed", [-3.0, 0.5])
def test_along_it_is_skin_friction_on_the_wetted_surface(speed):
    force = cylinder_force(np.array([[0.2, 0, 0]]), np.array([[speed, 0, 0]]), 0.01, 1.1, 0.02)
    wetted = np.pi * 0.01 * 0.2
    np.testing.assert_allclose(force, [[-0.5 * AIR_DENSITY * wetted * 0.02 * speed * abs(speed), 0, 0]], atol=1e-15)


@pytest.mark.parametrize("degrees", [10, 45, 80])
def test_aslant_the_cross_flow_counts(degrees):
    """The force across goes with sin^2 of the angle of attack (cross-flow principle)."""
    angle = np.radians(degrees)
    wind = 2.0 * np.array([[np.cos(angle), 0, np.sin(angle)]])
    force = cylinder_force(np.array([[0.2, 0, 0]]), wind, 0.01, 1.1, 0.0)
    np.testing.assert_allclose(force[0], [0, 0, -0.5 * AIR_DENSITY * 0.002 * 1.1 * 4 * np.sin(angle) ** 2], atol=1e-15)


@cases
@given(vectors, vectors, st.floats(0.0, 2.0), st.floats(0.0, 0.05))
def test_air_only_takes_energy(segments, velocities, drag, friction):
    force = cylinder_force(segments, velocities, 0.01, drag, friction)
    assert (np.sum(force * velocities, axis=1) <= 1e-12).all()
    assert np.isfinite(force).all()


@cases
@given(hnp.arrays(np.float64, (11, 3), elements=components), st.floats(-1.5, 1.5), st.floats(-1.5, 1.5))
def test_wind_is_what_moving_air_does_beyond_still_air(velocities, x, y):
    still = bound(CylinderDrag(drag_coefficient=CYLINDER_DRAG), ROPE)
    wind = bound(Wind(velocity_x=x, velocity_y=y), ROPE)(0.0, ROPE.vertices, velocities)
    expected = still(0.0, ROPE.vertices, velocities - [x, y, 0.0])
    np.testing.assert_allclose(still(0.0, ROPE.vertices, velocities) + wind, expected, atol=1e-12)


def test_the_mesh_does_not_matter():
    effect = CylinderDrag(drag_coefficient=1.1, friction_coefficient=0.02)
    totals = []
    for count in (2, 30):
        rope = rope_line(np.array([[0.0, 0, 0], [0.3, 0.2, 0.1]]), count)
        totals.append(bound(effect, rope)(0.0, rope.vertices, moving(rope, [1, 2, -1])).sum(axis=0))
    np.testing.assert_allclose(totals[0], totals[1], rtol=1e-12)


@pytest.mark.parametrize("name", ["reference", "mujoco", pytest.param("pybullet", marks=pytest.mark.slow)])
def test_terminal_velocity_of_a_rope_that_falls_level(name):
    """v tanh(g t / v) with v^2 = 2 rho_l g / (rho C_D d): a light ribbon cord of 10 g/m and 10 mm."""
    material = RopeMaterial(linear_density=0.01, diameter=0.01, stretch_stiffness=100.0)
    final = np.sqrt(2 * 0.01 * G / (AIR_DENSITY * 1.1 * 0.01))
    run = play(name, scene_of(rope_line(ROPE.vertices, 6), material), 1.0, CylinderDrag(drag_coefficient=1.1))
    expected = -final * np.tanh(G * run.times / final)
    assert expected[-1] < -0.985 * final
    np.testing.assert_allclose(run.velocities[:, :, 2], np.tile(expected[:, None], 6), atol=0.005 * final)
