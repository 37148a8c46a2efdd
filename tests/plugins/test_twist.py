"""Torsion of a rope, where nothing else holds it up."""

import numpy as np
import pytest
from effect_objects import G, vertices

from muslin.core.body import Body, rope_line
from muslin.core.material import RopeMaterial
from muslin.plugins.effects.rope import TwistStiffness

#: Radius [m] and segments of the ring, weight per length [N/m], E I, and G J without the effect [N m2].
RADIUS, SEGMENTS, WEIGHT = 0.08, 48, 0.002 * G
BENDING, TWIST = 1e-2, 2e-3


def slit_ring() -> Body:
    """A level ring, slit beside the clamp, with one more segment before it to be clamped by."""
    angle = 2 * np.pi * np.linspace(0.0, 1.0, SEGMENTS + 1)
    ring = RADIUS * np.stack([np.sin(angle), 1.0 - np.cos(angle), 0.0 * angle], axis=1)
    clamped = [[-2 * np.pi * RADIUS / SEGMENTS, 0.0, 0.0]]
    return rope_line(np.concatenate([clamped, ring]), SEGMENTS + 2)


def opening(twist: float) -> float:
    """How far its end sinks below the clamp under its own weight [m]: 2 pi^2 w R^4 / G J, whatever E I is.

    By Castigliano's theorem (Timoshenko, *Strength of Materials*, part II, 1941): at the angle a from the end the
    weight gives the moments w R^2 (1 - cos a) of bending and w R^2 (a - sin a) of torsion, a unit force at the end
    R sin a and R (1 - cos a). Over the whole ring the products of the first sum up to nothing.
    """
    return 2 * np.pi**2 * WEIGHT * RADIUS**4 / twist


@pytest.mark.parametrize("bending", [BENDING, 3 * BENDING])
@pytest.mark.parametrize("added", [0.0, 2e-3, 8e-3])
def test_a_slit_ring_opens_less_the_more_it_resists_torsion(added, bending):
    """To 10 %, from 8 mm down to a fifth of that."""
    material = RopeMaterial(WEIGHT / G, 1e4, bending, TWIST, damping_time=0.01)
    effect = TwistStiffness(twist_rigidity=added)
    end = vertices(slit_ring(), material, [0.0, 0.1, 0.2], effect, grasps=[[0, 1]], settle=3.0)[:, -1, 2]
    np.testing.assert_allclose(-end, opening(TWIST + added), rtol=0.1)
