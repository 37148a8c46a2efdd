"""The closed forms of the test bench, held against tables and against other ways to the same number."""

import numpy as np
import pytest
from scipy.integrate import solve_bvp

from muslin.core.bench.closed_forms import (
    J0_ZERO,
    beam_mode,
    beam_period,
    bessel_j0,
    cable_sag,
    chain_period,
    pendulum_period,
    ring_opening,
    thick_beam_period,
    thick_beam_sag,
)
from muslin.core.bench.elastica import heavy_elastica, rigidity, tip_drop
from muslin.core.bench.stretch import modulus_at, poisson_at
from muslin.core.errors import RolloutFailed
from muslin.core.material import ClothMaterial

G = 9.81


@pytest.mark.parametrize("load", [1e-4, 1e-2, 0.05])
def test_a_stiff_elastica_droops_by_an_eighth_of_its_load(load):
    """w L^4 / 8 B, less a share of the order of the load squared."""
    assert tip_drop(load) == pytest.approx(load / 8, rel=load**2 + 1e-6)


@pytest.mark.parametrize("load", [1.0, 8.0, 30.0])
def test_the_elastica_solves_its_boundary_value_problem(load):
    """The same equation by collocation."""

    def rate(s, y):
        return np.stack([y[1], -load * (1 - s) * np.cos(y[0]), np.sin(y[0])])

    s = np.linspace(0, 1, 200)
    start = np.stack([1 - (1 - s) ** 2, 2 * (1 - s), s**2 / 2])
    found = solve_bvp(rate, lambda a, b: np.array([a[0], b[1], a[2]]), s, start, tol=1e-8, max_nodes=20000)
    assert found.success
    assert tip_drop(load) == pytest.approx(found.sol(1.0)[2], rel=2e-5)


def test_the_chord_hangs_by_peirces_angle_at_two_bending_lengths():
    """Peirce chose 41.5 degrees because there the bending length is half the overhang, c^3 = L^3 / 8."""
    table = heavy_elastica()
    chord = np.arctan2(np.interp(8.0, table.load, table.drop), np.interp(8.0, table.load, table.reach))
    assert np.rad2deg(chord) == pytest.approx(41.5, abs=0.05)


@pytest.mark.parametrize("load", [1e-5, 0.1, 1.0, 8.0, 30.0])
def test_rigidity_is_the_inverse_of_the_droop(load):
    length, weight = 0.07, 1.3
    assert rigidity(tip_drop(load) * length, length, weight) == pytest.approx(weight * length**3 / load, rel=1e-4)


@pytest.mark.parametrize("drop", [0.0, -0.1, 0.99])
def test_no_rigidity_follows_from_what_does_not_droop_or_hangs_straight_down(drop):
    with pytest.raises(RolloutFailed, match="no rigidity"):
        rigidity(drop, 1.0, 1.0)


def test_an_inextensible_cable_is_a_catenary():
    """Of parameter a: span 2 a x, length 2 a sinh x, sag a (cosh x - 1)."""
    a, x = 0.2, 0.9
    sag = cable_sag(2 * a * x, 2 * a * np.sinh(x), 1.0, 1e9)
    assert sag == pytest.approx(a * (np.cosh(x) - 1), rel=1e-6)


def test_a_taut_elastic_cable_is_the_root_of_irvines_cubic():
    """Flat and of natural length L: the parabola sags by (3 w L^4 / 64 EA)^(1/3)."""
    assert cable_sag(1.0, 1.0, 1e-4, 100.0) == pytest.approx(np.cbrt(3e-4 / 6400), rel=1e-3)


def test_bessel_function():
    """Abramowitz and Stegun, table 9.1."""
    np.testing.assert_allclose(bessel_j0(np.array([0.0, 1.0, 2.0])), [1.0, 0.7651976866, 0.2238907791], atol=1e-10)
    assert abs(bessel_j0(np.array([J0_ZERO]))[0]) < 1e-12


def test_a_chain_of_many_links_has_the_chains_period():
    links, length = 400, 0.7
    mass = np.full(links, length / links)
    mass[-1] /= 2
    pull = np.cumsum(mass[::-1])[::-1] * G / (length / links)
    stiff = np.diag(pull + np.append(pull[1:], 0.0)) - np.diag(pull[1:], 1) - np.diag(pull[1:], -1)
    slowest = np.linalg.eigvalsh(stiff / np.sqrt(np.outer(mass, mass)))[0]
    assert chain_period(length, G) == pytest.approx(2 * np.pi / np.sqrt(slowest), rel=2e-3)


@pytest.mark.parametrize(("degrees", "longer"), [(0.0, 1.0), (60.0, 1.0731820), (90.0, 1.1803406)])
def test_a_pendulum_swings_slower_the_wider(degrees, longer):
    """2 K(sin(a / 2)) / pi of the small period, from tables of the complete elliptic integral."""
    period = pendulum_period(0.3, 0.5, G, np.deg2rad(degrees))
    assert period == pytest.approx(longer * 2 * np.pi * np.sqrt(0.3 / 0.5 / G), rel=1e-7)


def test_the_beams_mode_is_clamped_and_free():
    s = np.linspace(0.0, 1.0, 2001)
    mode = beam_mode(s)
    slope = np.gradient(mode, s)
    assert mode[0] == pytest.approx(0.0, abs=1e-12)
    assert mode[-1] == pytest.approx(1.0, rel=1e-9)
    assert slope[0] == pytest.approx(0.0, abs=2e-3)
    assert np.gradient(slope, s)[-3] == pytest.approx(0.0, abs=2e-2)
    # w'''' = k^4 w, so the mode's Rayleigh quotient is the frequency squared
    quotient = np.trapezoid(np.gradient(slope, s) ** 2, s) / np.trapezoid(mode**2, s)
    assert 2 * np.pi / np.sqrt(quotient) == pytest.approx(beam_period(1.0, 1.0, 1.0), rel=5e-3)


def test_a_slender_thick_beam_is_a_slender_beam():
    length, side, e, rho = 1.0, 0.002, 1e9, 1000.0
    slender = beam_period(length, e * side**4 / 12, rho * side**2)
    assert thick_beam_period(length, side, e, 0.3, rho) == pytest.approx(slender, rel=1e-5)
    weight = 1e-3
    assert thick_beam_sag(length, side, e, 0.3, weight) == pytest.approx(weight * 1.5 / (e * side**4), rel=1e-4)


def test_a_thick_beam_swings_as_its_discrete_equations():
    """Timoshenko's equations on staggered points: deflections and slopes at the nodes, shear between them."""
    length, side, e, nu, rho, n = 0.16, 0.02, 1e6, 0.3, 1000.0, 300
    h, inertia, area = length / n, side**4 / 12, side**2
    shear = 10 * (1 + nu) / (12 + 11 * nu) * e / (2 * (1 + nu)) * area
    difference = (np.eye(n) - np.eye(n, k=-1)) / h
    mean = (np.eye(n) + np.eye(n, k=-1)) / 2
    strain = np.block([[difference, -mean], [np.zeros((n, n)), difference]])
    stiff = h * strain.T @ (np.repeat([shear, e * inertia], n)[:, None] * strain)
    share = np.where(np.arange(n) == n - 1, 0.5, 1.0) * h
    mass = rho * np.concatenate([area * share, inertia * share])
    slowest = np.linalg.eigvalsh(stiff / np.sqrt(np.outer(mass, mass)))[0]
    assert thick_beam_period(length, side, e, nu, rho) == pytest.approx(2 * np.pi / np.sqrt(slowest), rel=1e-4)


def test_the_slit_ring_opens_by_castiglianos_integral():
    a = np.linspace(0, 2 * np.pi, 20001)
    radius, ei, gj, force = 0.1, 2e-3, 5e-4, 0.3
    work = np.sin(a) ** 2 / ei + (1 - np.cos(a)) ** 2 / gj
    expected = force * radius**3 * np.trapezoid(work, a)
    assert ring_opening(radius, ei, gj, force) == pytest.approx(expected, rel=1e-8)


def test_an_isotropic_sheet_is_the_same_in_every_direction():
    sheet = ClothMaterial(stretch_stiffness=200.0, poisson_ratio=0.25)
    for angle in (0.0, 0.3, np.pi / 4, np.pi / 2):
        assert modulus_at(sheet, angle) == pytest.approx(200.0)
        assert poisson_at(sheet, angle) == pytest.approx(0.25)


def test_a_woven_sheet_obeys_hookes_law_turned():
    """The compliance matrix transformed as a tensor: strain under a unit stress at an angle."""
    sheet = ClothMaterial(stretch_stiffness=200.0, weft_stretch_ratio=3.0, poisson_ratio=0.25)
    warp, weft = 200 / np.sqrt(3), 200 * np.sqrt(3)
    for angle in (0.0, 0.4, np.pi / 4, np.pi / 2):
        c, s = np.cos(angle), np.sin(angle)
        stress = np.outer([c, -s], [c, -s])  # along the strip, in the axes of warp and weft
        strain = np.diag([stress[0, 0] / warp, stress[1, 1] / weft]) - 0.25 / 200 * np.diag(
            [stress[1, 1], stress[0, 0]]
        )
        strain[0, 1] = strain[1, 0] = stress[0, 1] * (1 + 0.25) / 200
        along, across = np.array([c, -s]), np.array([s, c])
        assert modulus_at(sheet, angle) == pytest.approx(1 / (along @ strain @ along))
        assert poisson_at(sheet, angle) == pytest.approx(-(across @ strain @ across) / (along @ strain @ along))
