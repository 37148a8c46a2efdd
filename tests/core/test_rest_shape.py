"""Rest shapes of ropes, from how they turn."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from muslin.core.bending import RopeBending
from muslin.core.body import rope_line
from muslin.core.rest_shape import eased


def twisted_curve(seed: int):
    """A rope that winds out of any plane."""
    rng = np.random.default_rng(seed)
    s = np.linspace(0.0, 1.0, 14)[:, None]
    waves = [np.sin((k + 1) * np.pi * s + rng.uniform(0, 6)) * rng.normal(0, 0.15 / (k + 1), 3) for k in range(3)]
    return rope_line(s * rng.normal(0, 1, 3) + sum(waves), 14)


@settings(max_examples=30)
@given(seed=st.integers(0, 10_000), share=st.floats(0.0, 1.0))
def test_it_turns_by_a_share_everywhere_and_is_as_long(seed, share):
    body = twisted_curve(seed)
    out = eased(body, share)
    np.testing.assert_allclose(out.measures, body.measures, rtol=1e-9)
    np.testing.assert_allclose(out.vertices[:2], body.vertices[:2], atol=1e-12)
    bent, before = (np.linalg.norm(RopeBending(b).rest, axis=1) for b in (out, body))
    np.testing.assert_allclose(bent, share * before, atol=1e-6)


@pytest.mark.parametrize("seed", range(5))
def test_all_of_it_is_the_same_shape(seed):
    body = twisted_curve(seed)
    np.testing.assert_allclose(eased(body, 1.0).vertices, body.vertices, atol=1e-9)


def test_a_share_in_two_steps_is_their_product():
    body = twisted_curve(3)
    np.testing.assert_allclose(eased(eased(body, 0.6), 0.5).vertices, eased(body, 0.3).vertices, atol=1e-9)


def test_a_straight_rope_is_left_alone():
    body = rope_line(np.array([[0.0, 0.0, 0.0], [0.5, 0.2, 0.0]]), 9)
    assert eased(body, 0.4) is body
