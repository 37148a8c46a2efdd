"""Where the twist of a rope settles that is bent at rest."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from muslin.core.arrays import FloatArray
from muslin.core.twist import ROUND, settled_twist

COUNT = 61


def evenly(length: float) -> FloatArray:
    return np.full((1, COUNT - 1), length / (COUNT - 1))


def arc(bend: float) -> FloatArray:
    """Curvatures along untwisted axes of a rope that is bent evenly in one plane ``(1, V - 2, 2)``."""
    return np.tile([bend, 0.0], (1, COUNT - 2, 1))


@given(st.floats(-6.0, 6.0), st.floats(-6.0, 6.0))
def test_a_rope_that_is_straight_at_rest_is_twisted_evenly(first: float, last: float) -> None:
    found = settled_twist(arc(3.0), np.zeros((COUNT - 2, 2)), evenly(1.0), np.array([[first, last]]))
    np.testing.assert_allclose(found[0], np.linspace(first, last, COUNT), atol=1e-9)


@pytest.mark.parametrize(("bend", "natural"), [(1.0, 2.0), (4.0, 5.0), (6.0, 0.5)])
def test_a_small_turn_of_an_end_is_left_near_it(bend: float, natural: float) -> None:
    """GJ theta'' = EI kappa kappa_0 theta: it falls off as a hyperbolic sine."""
    kept = np.tile([natural, 0.0], (COUNT - 2, 1))
    found = settled_twist(arc(bend), kept, evenly(1.0), np.array([[0.02, 0.0]]))
    rate = np.sqrt(bend * natural / ROUND)
    s = np.linspace(0.0, 1.0, COUNT)
    np.testing.assert_allclose(found[0], 0.02 * np.sinh(rate * (1.0 - s)) / np.sinh(rate), atol=2e-5)


def test_a_bend_turns_into_the_plane_in_which_the_rope_is_bent() -> None:
    """Wherever in the material it lies, far from ends that are held by a quarter turn less."""
    kept = np.tile([0.0, 8.0], (COUNT - 2, 1))
    found = settled_twist(arc(8.0), kept, evenly(1.0), np.zeros((1, 2)))
    assert found[0, COUNT // 2] == pytest.approx(-np.pi / 2, abs=0.05)
    assert (found[0, [0, -1]] == 0.0).all()


@given(st.integers(0, 10_000))
def test_no_other_twist_near_it_has_less_energy(seed: int) -> None:
    rng = np.random.default_rng(seed)
    bends, kept = rng.normal(0.0, 3.0, (1, COUNT - 2, 2)), rng.normal(0.0, 3.0, (COUNT - 2, 2))
    lengths, ends = rng.uniform(0.01, 0.03, (1, COUNT - 1)), rng.normal(0.0, 1.0, (1, 2))

    def energy(angles: FloatArray) -> float:
        inner = angles[0, 1:-1]
        turned = np.stack(
            [
                np.cos(inner) * kept[:, 0] - np.sin(inner) * kept[:, 1],
                np.sin(inner) * kept[:, 0] + np.cos(inner) * kept[:, 1],
            ],
            axis=1,
        )
        across = 0.5 * (lengths[0, 1:] + lengths[0, :-1])
        bent = 0.5 * np.sum(across * np.sum((bends[0] - turned) ** 2, axis=1))
        return float(0.5 * ROUND * np.sum(np.diff(angles[0]) ** 2 / lengths[0]) + bent)

    found = settled_twist(bends, kept, lengths, ends)
    least = energy(found)
    for size in (0.01, 0.1):
        other = found.copy()
        other[0, 1:-1] += rng.normal(0.0, size, COUNT - 2)
        assert energy(other) > least


def test_ropes_of_two_and_three_vertices_have_their_ends() -> None:
    ends = np.array([[0.3, -0.2]])
    assert settled_twist(np.zeros((1, 0, 2)), np.zeros((0, 2)), np.ones((1, 1)), ends).tolist() == [[0.3, -0.2]]
    found = settled_twist(np.zeros((1, 1, 2)), np.zeros((1, 2)), np.ones((1, 2)), ends)
    np.testing.assert_allclose(found, [[0.3, 0.05, -0.2]])
