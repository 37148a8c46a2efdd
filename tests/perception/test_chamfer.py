"""Distances of masks, exact against every pixel with every pixel."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from muslin.core.arrays import BoolArray, FloatArray
from muslin.core.errors import InputError
from muslin.perception.chamfer import mask_chamfer, on_mask, point_chamfer


def square(left: int, top: int, side: int = 6) -> BoolArray:
    mask = np.zeros((1, 40, 40), bool)
    mask[0, top : top + side, left : left + side] = True
    return mask


def brute(one: FloatArray, other: FloatArray) -> float:
    apart = np.linalg.norm(one[:, None] - other[None], axis=-1)
    return 0.5 * float(apart.min(axis=0).mean() + apart.min(axis=1).mean())


def test_the_distance_of_squares_is_known() -> None:
    """A square moved by d < side has d columns at 1 to d pixels from the other; one in it, half of its rim's."""
    assert mask_chamfer(square(5, 5), square(5, 5)) == 0.0
    assert mask_chamfer(square(5, 5), square(7, 5)) == pytest.approx((1 + 2) / 6)
    assert mask_chamfer(square(5, 5), square(6, 6, 4)) == pytest.approx(0.5 * (16 + 4 * np.sqrt(2)) / 36)
    assert mask_chamfer(square(5, 5), np.zeros((1, 40, 40), bool)) == pytest.approx(np.hypot(40, 40))


@settings(max_examples=150)
@given(st.data(), st.integers(1, 24), st.integers(1, 24))
def test_the_distance_is_that_of_brute_force(data: st.DataObject, height: int, width: int) -> None:
    one, other = (data.draw(hnp.arrays(bool, (1, height, width))) for _ in range(2))
    found = mask_chamfer(one, other)[0]
    if not (one.any() and other.any()):
        assert found == np.hypot(height, width)
        return
    assert found == pytest.approx(brute(np.argwhere(one[0]), np.argwhere(other[0])), rel=1e-12, abs=1e-12)
    assert found == mask_chamfer(other, one)[0]


@settings(max_examples=80)
@given(hnp.arrays(bool, (1, 12, 16)), hnp.arrays(float, (1, 5, 2), elements=st.floats(-3, 18)))
def test_the_distance_of_points_is_that_of_brute_force(mask: BoolArray, points: FloatArray) -> None:
    found = point_chamfer(points, mask)[0]
    if not mask.any():
        assert found == np.hypot(12, 16)
        return
    places = np.argwhere(mask[0])[:, ::-1]
    apart = np.linalg.norm(points[0][:, None] - places, axis=-1)
    inside = [bool((np.rint(p) == places).all(axis=1).any()) for p in points[0]]
    assert on_mask(points[0], mask[0]).tolist() == inside
    there = np.where(inside, 0.0, apart.min(axis=1))
    assert found == pytest.approx(0.5 * (there.mean() + apart.min(axis=0).mean()))


def test_points_that_are_not_seen_do_not_count() -> None:
    points = np.array([[[7.0, 7.0], [np.nan, np.nan]]])
    assert point_chamfer(points, square(5, 5)) == point_chamfer(points[:, :1], square(5, 5))
    assert point_chamfer(points[:, 1:], square(5, 5)) == pytest.approx(np.hypot(40, 40))


def test_other_shapes_are_refused() -> None:
    with pytest.raises(InputError, match="one shape"):
        mask_chamfer(square(5, 5), np.zeros((1, 30, 40), bool))
    with pytest.raises(InputError, match=r"\(T, K, 2\)"):
        point_chamfer(np.zeros((1, 4, 3)), square(5, 5))
