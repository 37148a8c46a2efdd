"""Gravity turned by the angles it says, and stronger by as much as it says."""

import numpy as np
import pytest
from effect_objects import SHEET, G, cases, vertices
from hypothesis import given
from hypothesis import strategies as st

from muslin.core.body import cloth_grid
from muslin.core.material import ClothMaterial
from muslin.plugins.effects.gravity import GravityStrength, GravityTilt

DOWN = np.array([0.0, 0.0, -G])
angles = st.floats(-3.0, 3.0)


@cases
@given(angles, angles)
def test_keeps_the_strength_and_turns_by_the_angles(a, b):
    """About x and then y: the angle to the vertical has the cosine cos a cos b."""
    turned = GravityTilt(about_x=a, about_y=b).on_gravity(DOWN)
    assert np.linalg.norm(turned) == pytest.approx(G, rel=1e-12)
    assert turned @ DOWN / G**2 == pytest.approx(np.cos(a) * np.cos(b), abs=1e-12)


def test_signs_follow_the_right_hand():
    """About x by +a, down (-z) turns towards +y; about y by +b towards -x."""
    about_x = GravityTilt(about_x=0.02).on_gravity(DOWN)
    np.testing.assert_allclose(about_x, [0.0, G * np.sin(0.02), -G * np.cos(0.02)], atol=1e-12)
    about_y = GravityTilt(about_y=0.02).on_gravity(DOWN)
    np.testing.assert_allclose(about_y, [-G * np.sin(0.02), 0.0, -G * np.cos(0.02)], atol=1e-12)


def test_leaves_its_argument_alone():
    gravity = DOWN.copy()
    GravityTilt(about_x=0.5).on_gravity(gravity)
    np.testing.assert_array_equal(gravity, DOWN)


def test_a_free_body_falls_along_it():
    """By g t^2 / 2, or by up to half a step more as first-order integrators do."""
    effect = GravityTilt(about_x=0.05, about_y=-0.03)
    moved = vertices(SHEET, ClothMaterial(), [0.0, 0.3], effect)[1] - SHEET.vertices
    along = effect.on_gravity(DOWN)
    fallen = float(moved[0] @ along / (along @ along))
    np.testing.assert_allclose(moved, np.tile(along * fallen, (len(moved), 1)), rtol=1e-8)
    assert 0.15 * 0.3 - 1e-9 <= fallen <= 0.15 * 0.305 + 1e-9


@pytest.mark.parametrize("angle", [-0.05, 0.03])
def test_a_hanging_strip_leans_by_the_angle(angle):
    body = cloth_grid(0.02, 0.1, 2, 5)
    material = ClothMaterial(stretch_stiffness=300.0, bending_rigidity=1e-3)
    effect = GravityTilt(about_x=angle)
    hanging = vertices(body, material, [0.0, 0.01], effect, grasps=([0, 1],), settle=2.5)[0]
    tip = hanging[-2:].mean(axis=0)
    assert np.arctan2(tip[1], -tip[2]) == pytest.approx(angle, rel=1e-2)


@cases
@given(st.floats(-2.0, 2.0), angles)
def test_strength_is_added_along_gravity_whichever_way_it_points(excess, angle):
    leaning = GravityTilt(about_x=angle).on_gravity(DOWN)
    stronger = GravityStrength(excess=excess).on_gravity(leaning)
    np.testing.assert_allclose(stronger, leaning * (G + excess) / G, rtol=1e-12, atol=1e-12)


def test_a_free_body_falls_faster_by_what_gravity_exceeds():
    def fallen(excess):
        moved = vertices(SHEET, ClothMaterial(), [0.0, 0.3], GravityStrength(excess=excess))[1] - SHEET.vertices
        return moved[:, 2]

    np.testing.assert_allclose(fallen(1.0) / fallen(0.0), (G + 1.0) / G, rtol=1e-8)


def test_without_gravity_there_is_none_to_be_stronger():
    np.testing.assert_array_equal(GravityStrength(excess=1.0).on_gravity(np.zeros(3)), np.zeros(3))
