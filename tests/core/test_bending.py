"""Curvature of sheets and ropes, and the forces of moments."""

import numpy as np
import pytest

from muslin.core.bending import bending_of
from muslin.core.body import Body, cloth_grid, rope_line

SHEET = cloth_grid(0.3, 0.3, 9, 9)
ROPE = rope_line(np.array([[0.0, 0.0, 0.0], [0.3, 0.2, 0.1]]), 9)
BODIES = [pytest.param(SHEET, id="cloth"), pytest.param(ROPE, id="rope")]


def crumpled(body, seed=0):
    return body.vertices + 0.01 * np.random.default_rng(seed).normal(size=body.vertices.shape)


def turned(points, axis, angle):
    """By Rodrigues' formula."""
    k = np.asarray(axis, float) / np.linalg.norm(axis)
    cross = np.cross(np.eye(3), -k)
    return points @ (np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross).T


@pytest.mark.parametrize("degrees", [0, 20, 45, 90, 135])
def test_a_cylinder_has_its_curvature_whichever_way_it_is_rolled(degrees):
    """Inside of a grid of alternating diagonals, to the second order of the mesh."""
    radius, along = 0.2, np.array([np.cos(np.radians(degrees)), np.sin(np.radians(degrees))])
    flat = SHEET.vertices[:, [0, 2]]
    s, t = flat @ along, flat @ [-along[1], along[0]]
    rolled = np.stack([radius * np.sin(s / radius), radius * (1 - np.cos(s / radius)), t], axis=1)
    bending = bending_of(SHEET)
    bending.follow(rolled)
    inner = bending.curvature.reshape(9, 9, 3)[2:-2, 2:-2]
    np.testing.assert_allclose(np.linalg.norm(inner, axis=-1), 1 / radius, rtol=3e-3)
    np.testing.assert_allclose(np.abs(inner[..., 0]), along[1] ** 2 / radius, atol=5e-3 / radius)  # the warp is z


def test_an_irregular_mesh_sees_the_same_curvature_on_average():
    rng = np.random.default_rng(2)
    flat = SHEET.vertices.copy()
    flat[:, [0, 2]] += 0.006 * rng.normal(size=(81, 2))
    radius = 0.2
    rolled = np.stack([flat[:, 0], radius * (1 - np.cos(flat[:, 2] / radius)), radius * np.sin(flat[:, 2] / radius)], 1)
    bending = bending_of(Body("cloth", flat, SHEET.elements))
    bending.follow(rolled)
    inner = np.arange(81).reshape(9, 9)[2:-2, 2:-2].ravel()
    mean = np.average(np.abs(bending.curvature[inner, 0]), weights=bending.measures[inner])
    assert mean * radius == pytest.approx(1.0, rel=0.03)


def test_an_arc_of_rope_has_its_curvature():
    angle = np.linspace(0, 1.5, 11)
    arc = 0.2 * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    bending = bending_of(rope_line(np.array([[0.0, 0.0, 0.0], [0.3, 0.0, 0.0]]), 11))
    bending.follow(arc)
    np.testing.assert_allclose(np.linalg.norm(bending.curvature, axis=1), 5.0, rtol=1e-12)


@pytest.mark.parametrize("body", BODIES)
def test_moving_and_turning_bends_nothing(body):
    bending = bending_of(body)
    bending.follow(crumpled(body))
    before = np.linalg.norm(bending.curvature, axis=1)
    shift = np.array([0.3, 0.0, -1.0])
    bending.follow(turned(crumpled(body), [1.0, 2.0, -1.0], 0.7) + shift)
    np.testing.assert_allclose(np.linalg.norm(bending.curvature, axis=1), before, rtol=1e-9)


@pytest.mark.parametrize("body", BODIES)
def test_rates_are_the_derivatives_and_forces_their_transpose(body):
    bending, rng = bending_of(body), np.random.default_rng(1)
    velocities = rng.normal(size=body.vertices.shape)
    for seed in range(3):
        x = crumpled(body, seed)
        bending.follow(x)
        rates = bending.rates(velocities)
        moments = rng.normal(size=rates.shape)
        forces = bending.forces(moments)
        power = -np.sum(bending.measures[:, None] * moments * rates)
        assert np.sum(forces * velocities) == pytest.approx(power, rel=1e-9)
        np.testing.assert_allclose(forces.sum(axis=0), 0.0, atol=1e-12 * np.abs(forces).sum())
        bending.follow(x + 1e-7 * velocities)
        ahead = bending.curvature
        bending.follow(x - 1e-7 * velocities)
        np.testing.assert_allclose((ahead - bending.curvature) / 2e-7, rates, atol=1e-5 * np.abs(rates).max())


def test_moments_in_a_sheet_turn_nothing():
    bending = bending_of(SHEET)
    bending.follow(crumpled(SHEET))
    forces = bending.forces(np.random.default_rng(0).normal(size=(81, 3)))
    torque = np.cross(crumpled(SHEET), forces).sum(axis=0)
    np.testing.assert_allclose(torque, 0.0, atol=1e-12 * np.abs(forces).sum())


@pytest.mark.parametrize("body", BODIES)
def test_the_fastest_frequency_bounds_every_motion(body):
    """Rayleigh's quotient of random motions, and that of the stiffest eigenvector, found densely."""
    bending = bending_of(body)
    masses, count = np.linspace(1.0, 2.0, len(body.vertices)), body.vertices.size
    bound = bending.stiffest(masses, np.array([0, 3]))
    rows = np.array([bending.rates(e.reshape(-1, 3)).ravel() for e in np.eye(count)]).T
    free = np.setdiff1d(np.arange(count), np.r_[0:3, 9:12])
    weight = np.repeat(bending.measures, bending.curvature.shape[1])
    root = 1 / np.sqrt(np.repeat(masses, 3))[free]
    scaled = np.sqrt(weight)[:, None] * rows[:, free] * root
    most = np.linalg.norm(scaled, 2) ** 2
    assert most <= bound <= 1.11 * most
