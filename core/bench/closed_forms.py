"""Closed forms of cables, pendulums and beams, in SI."""

from collections.abc import Callable

import numpy as np

from ..arrays import FloatArray

#: First zero of the Bessel function J0 (Abramowitz and Stegun, table 9.5).
J0_ZERO = 2.404825557695773
#: First root of cos(x) cosh(x) = -1, of the clamped beam (Blevins, Formulas for Natural Frequency, table 8-1).
BEAM_ROOT = 1.8751040687119611


def bisect(function: Callable[[float], float], low: float, high: float) -> float:
    """Where a continuous function that rises through zero between ``low`` and ``high`` is zero."""
    for _ in range(200):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if function(middle) > 0 else (middle, high)
    return 0.5 * (low + high)


def cable_sag(span: float, length: float, weight: float, stiffness: float) -> float:
    """Sag [m] in the middle of an elastic cable between two supports at one height.

    The elastic catenary (Irvine, Cable Structures, 1981, eq. 1.24 f.) with horizontal tension H::

        span = H S / EA + (2 H / w) asinh(w S / 2 H)
        sag  = w S^2 / 8 EA + (H / w) (sqrt(1 + (w S / 2 H)^2) - 1)

    Args:
        span: between the supports [m].
        length: unstretched S [m].
        weight: per unstretched length w [N/m].
        stiffness: EA [N].
    """

    def longer(tension: float) -> float:
        reach = tension * length / stiffness
        return reach + 2 * tension / weight * float(np.arcsinh(weight * length / 2 / tension)) - span

    tension = bisect(longer, 1e-9 * weight * length, 1e3 * (weight * length + stiffness))
    rise = tension / weight * (np.sqrt(1 + (weight * length / 2 / tension) ** 2) - 1)
    return float(weight * length**2 / (8 * stiffness) + rise)


def pendulum_period(inertia: float, moment: float, gravity: float, amplitude: float) -> float:
    """Period [s] of a rigid pendulum let go at ``amplitude`` [rad].

    2 pi sqrt(I / (m g d)) / AGM(1, cos(amplitude / 2)), with the arithmetic-geometric mean (Gauss; Carvalhaes
    and Suppes, Am. J. Phys. 76 (2008) 1150).

    Args:
        inertia: I about the pivot [kg m2].
        moment: mass times distance of its centre from the pivot, m d [kg m].
        gravity: g [m/s2].
        amplitude: from the vertical [rad].
    """
    a, b = 1.0, float(np.cos(amplitude / 2))
    while abs(a - b) > 1e-15:
        a, b = (a + b) / 2, float(np.sqrt(a * b))
    return float(2 * np.pi * np.sqrt(inertia / (moment * gravity)) / a)


def bessel_j0(x: FloatArray) -> FloatArray:
    """J0 by its power series; for ``x`` up to 5 exact to 1e-12."""
    term, total = np.ones_like(x), np.ones_like(x)
    for k in range(1, 30):
        term = -term * (x / 2) ** 2 / k**2
        total = total + term
    return total


def chain_period(length: float, gravity: float) -> float:
    """Period [s] of a hanging limp chain: 4 pi sqrt(L / g) / j01 (D. Bernoulli 1738; Lamb, Dynamics, 1914)."""
    return float(4 * np.pi * np.sqrt(length / gravity) / J0_ZERO)


def chain_mode(height: FloatArray, length: float) -> FloatArray:
    """First mode of the hanging chain at ``height`` [m] above its free end: J0(j01 sqrt(height / L))."""
    return bessel_j0(J0_ZERO * np.sqrt(np.maximum(height, 0.0) / length))


def beam_mode(place: FloatArray) -> FloatArray:
    """First mode of a clamped beam at ``place`` [1] of its length from the clamp; one at the tip.

    cosh kx - cos kx - s (sinh kx - sin kx), s = (cosh k + cos k) / (sinh k + sin k) (Blevins, table 8-1).
    """
    k = BEAM_ROOT
    s = (np.cosh(k) + np.cos(k)) / (np.sinh(k) + np.sin(k))
    x = k * place
    return np.asarray((np.cosh(x) - np.cos(x) - s * (np.sinh(x) - np.sin(x))) / 2.0)


def beam_period(length: float, rigidity: float, density: float) -> float:
    """Period [s] of a slender clamped beam (Euler-Bernoulli): 2 pi L^2 sqrt(m / EI) / 1.8751^2.

    Args:
        length: [m].
        rigidity: EI [N m2], or D [N m] of a strip.
        density: mass per length [kg/m], or per area [kg/m2].
    """
    return float(2 * np.pi * length**2 * np.sqrt(density / rigidity) / BEAM_ROOT**2)


def thick_beam_period(length: float, side: float, youngs_modulus: float, poisson_ratio: float, density: float) -> float:
    """Period [s] of a clamped beam of square section after Timoshenko (Phil. Mag. 41 (1921) 744).

    With deflection w, rotation p, moment M = EI p' and shear force Q = kappa G A (w' - p) the motion at
    angular frequency f is the linear system w' = p + Q / kGA, p' = M / EI, M' = -Q - rho I f^2 p,
    Q' = -rho A f^2 w; the frequency is the lowest at which clamp (w = p = 0) and free end (M = Q = 0) agree.
    """
    shear = _shear_stiffness(side, youngs_modulus, poisson_ratio)
    inertia, area = side**4 / 12, side**2

    def mismatch(frequency: float) -> float:
        system = np.zeros((4, 4), np.complex128)
        system[0, 1], system[0, 3] = 1.0, 1.0 / shear
        system[1, 2] = 1.0 / (youngs_modulus * inertia)
        system[2, 1], system[2, 3] = -density * inertia * frequency**2, -1.0
        system[3, 0] = -density * area * frequency**2
        values, vectors = np.linalg.eig(system)
        across = (vectors * np.exp(values * length)) @ np.linalg.inv(vectors)
        return -float(np.linalg.det(across[2:, 2:]).real)

    slender = 2 * np.pi / beam_period(length, youngs_modulus * inertia, density * area)
    return float(2 * np.pi / bisect(mismatch, 0.2 * slender, 1.1 * slender))


def thick_beam_sag(length: float, side: float, youngs_modulus: float, poisson_ratio: float, weight: float) -> float:
    """Sag [m] of the tip of a clamped beam of square section: w L^4 / 8 EI + w L^2 / (2 kappa G A) (Timoshenko).

    Args:
        length: [m].
        side: of the section [m].
        youngs_modulus: E [Pa].
        poisson_ratio: [1].
        weight: per length w [N/m].
    """
    bending = weight * length**4 / (8 * youngs_modulus * side**4 / 12)
    return bending + weight * length**2 / (2 * _shear_stiffness(side, youngs_modulus, poisson_ratio))


def _shear_stiffness(side: float, youngs_modulus: float, poisson_ratio: float) -> float:
    """kappa G A [N] with Cowper's 10 (1 + nu) / (12 + 11 nu) (J. Appl. Mech. 33 (1966) 335)."""
    kappa = 10 * (1 + poisson_ratio) / (12 + 11 * poisson_ratio)
    return kappa * youngs_modulus / (2 * (1 + poisson_ratio)) * side**2


def ring_opening(radius: float, rigidity: float, twist: float, force: float) -> float:
    """How far [m] a slit ring opens across its plane under ``force`` [N], up on one end and down on the other.

    F R^3 (pi / EI + 3 pi / GJ): Castigliano's theorem with the bending moment F R sin(a) and the torque
    F R (1 - cos(a)) at the angle a from the slit (Timoshenko, Strength of Materials II, 1956, sect. 79).

    Args:
        radius: R [m].
        rigidity: EI [N m2].
        twist: GJ [N m2].
        force: F [N].
    """
    return float(force * radius**3 * (np.pi / rigidity + 3 * np.pi / twist))
