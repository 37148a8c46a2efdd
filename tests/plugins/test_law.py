"""The library of force terms: closed forms, what it is not, and the kit."""

import numpy as np
import pytest
from effect_objects import BLOCK, LYING, ROPE, SHEET, bound

from muslin.core.errors import InputError
from muslin.core.testing import check_effect
from muslin.plugins.effects.law import Law

NAMES = [c.name for c in Law.coefficients]


def acceleration(body, velocities, time=0.0, positions=None, **values):
    """What a law with these coefficients gives a free body of the default material ``(V, 3)`` [m/s2]."""
    from muslin.core.material import MATERIALS

    masses = body.vertex_measures * MATERIALS[body.kind]().density
    x = body.vertices if positions is None else positions
    return bound(Law(**values), body)(time, x, np.asarray(velocities, float)) / masses[:, None]


def moving(body, velocity):
    return np.broadcast_to(np.array(velocity, float), body.vertices.shape)


@pytest.mark.parametrize(
    ("name", "power"), [("dry_drag", 0), ("linear_drag", 1), ("quadratic_drag", 2), ("cubic_drag", 3)]
)
def test_drags_are_powers_of_the_speed_against_the_motion(name, power):
    velocity = np.array([1.2, -0.9, 2.0])
    speed = np.linalg.norm(velocity)
    got = acceleration(SHEET, moving(SHEET, velocity), **{name: 0.7})
    np.testing.assert_allclose(got, moving(SHEET, -0.7 * speed**power * velocity / speed), rtol=1e-3)


def test_across_and_along_are_the_parts_of_the_whole():
    """Through a level sheet is vertical; square to a rope along x is everything but x."""
    v = [1.0, 2.0, 3.0]
    for body, across in ((LYING, [0, 0, 3.0]), (ROPE, [0, 2.0, 3.0])):
        got = acceleration(body, moving(body, v), linear_drag_across=1.0)
        np.testing.assert_allclose(got, moving(body, -np.array(across)), atol=1e-12)
        whole = got + acceleration(body, moving(body, v), linear_drag_along=1.0)
        np.testing.assert_allclose(whole, moving(body, -np.array(v)), atol=1e-12)


def test_the_surface_terms_of_a_solid_push_as_much_as_its_mass_would_and_nothing_inside():
    masses = BLOCK.vertex_measures
    got = acceleration(BLOCK, moving(BLOCK, [0, 0, 1.0]), pressure=1.0)
    inside = np.all((BLOCK.vertices > 1e-9) & (BLOCK.vertices < BLOCK.vertices.max(axis=0) - 1e-9), axis=1)
    assert inside.sum() == 1
    assert not got[inside].any()
    np.testing.assert_allclose((masses[:, None] * got).sum(axis=0), 0.0, atol=1e-12)  # a closed surface


def test_a_spring_with_an_acceleration_pulls_to_another_place():
    place, k = np.array([0.3, -0.2, 0.1]), 20.0
    center = SHEET.vertex_measures @ SHEET.vertices / SHEET.vertex_measures.sum()
    shift = dict(zip(("acceleration_x", "acceleration_y", "acceleration_z"), k * (place - center), strict=True))
    got = acceleration(SHEET, 0 * SHEET.vertices, spring=k, **shift)
    np.testing.assert_allclose(got, -k * (SHEET.vertices - place), atol=1e-12)


def test_the_isotropic_spring_is_the_sum_of_the_three():
    still = 0 * SHEET.vertices
    three = acceleration(SHEET, still, spring_x=5.0, spring_y=5.0, spring_z=5.0)
    np.testing.assert_allclose(three, acceleration(SHEET, still, spring=5.0), atol=1e-12)


def test_sine_cosine_and_ramp_follow_the_clock_of_the_recording():
    still = 0 * SHEET.vertices
    for t in (-0.2, 0.0, 0.37):
        got = acceleration(SHEET, still, time=t, sine_x=2.0, cosine_y=3.0, frequency=1.5, ramp_z=4.0)
        turn = 2 * np.pi * 1.5 * t
        np.testing.assert_allclose(got, moving(SHEET, [2 * np.sin(turn), 3 * np.cos(turn), 4 * t]), atol=1e-12)


@pytest.mark.parametrize("body", [SHEET, ROPE, BLOCK], ids=["cloth", "rope", "solid"])
def test_viscosity_keeps_momentum_leaves_rigid_motion_and_takes_energy(body):
    rng = np.random.default_rng(0)
    masses, v = body.vertex_measures[:, None], rng.normal(size=body.vertices.shape)
    got = acceleration(body, v, internal_drag=0.001)
    np.testing.assert_allclose((masses * got).sum(axis=0), 0.0, atol=1e-12)
    assert np.sum(masses * got * v) < 0
    assert np.abs(acceleration(body, moving(body, [1.0, 2, 3]), internal_drag=0.001)).max() < 1e-12


def test_every_term_is_linear_in_its_coefficient_and_the_law_is_their_sum():
    rng = np.random.default_rng(1)
    x, v = SHEET.vertices + 0.01 * rng.normal(size=SHEET.vertices.shape), rng.normal(size=SHEET.vertices.shape)
    some = {n: float(rng.normal()) for n in NAMES if n != "frequency"}
    whole = acceleration(SHEET, v, 0.2, x, **some, frequency=2.0)
    parts = [c * acceleration(SHEET, v, 0.2, x, **{n: 1.0}, frequency=2.0) for n, c in some.items()]
    np.testing.assert_allclose(whole, sum(parts), atol=1e-9)


def test_its_families_name_terms_and_every_term_is_in_one():
    used = {c for family in Law.families.values() for c in family}
    assert used <= set(NAMES)
    assert set(NAMES) - used == {"frequency"}  # found with the oscillation


def test_a_diagnosis_does_not_try_it_but_may_be_told_to():
    assert not Law.candidate


def test_an_unknown_term_is_refused():
    with pytest.raises(InputError, match="'law' has no coefficient 'warp_drive'"):
        Law(warp_drive=1.0)


def test_keeps_what_effects_promise():
    check_effect(Law)
