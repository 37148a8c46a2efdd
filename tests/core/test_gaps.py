"""Points of a simulation that were not found in its pictures."""

import numpy as np
import pytest

from muslin.core.errors import RolloutFailed
from muslin.core.gaps import bridged
from muslin.core.series import PointSeries

TIME = np.array([0.0, 1.0, 2.0, 4.0])


def series(points: object, *, correspondence: bool = True) -> PointSeries:
    return PointSeries(TIME, np.asarray(points, float), "px", correspondence)


def test_what_is_seen_everywhere_is_left_alone() -> None:
    whole = series(np.arange(16.0).reshape(4, 2, 2))
    assert bridged(whole) is whole


def test_a_point_with_correspondence_moves_evenly_through_its_gap_and_rests_beyond() -> None:
    gone = [np.nan, np.nan]
    got = bridged(series([[gone, [5, 5]], [[1, 2], [6, 6]], [gone, [7, 7]], [[4, 8], gone]])).points
    np.testing.assert_allclose(got[:, 0], [[1, 2], [1, 2], [2, 4], [4, 8]])
    np.testing.assert_allclose(got[:, 1], [[5, 5], [6, 6], [7, 7], [7, 7]])


def test_a_point_that_is_found_nowhere_fails_the_rollout_if_the_measurement_has_it() -> None:
    points = np.full((4, 2, 2), np.nan)
    points[:, 0] = [[1, 1], [3, 3], [1, 1], [3, 3]]
    with pytest.raises(RolloutFailed, match=r"point 1 .* found in none of 4 frames"):
        bridged(series(points))
    np.testing.assert_allclose(bridged(series(points), np.array([True, False])).points[:, 1], 2.0)


def test_a_set_stays_the_set_that_it_is() -> None:
    rng = np.random.default_rng(0)
    points = rng.random((4, 5, 2))
    points[0, 2:], points[1], points[2, 3] = np.nan, np.nan, np.nan
    got = bridged(series(points, correspondence=False)).points
    assert np.isfinite(got).all()
    for t, near in enumerate([0, 0, 2, 3]):
        kept = points[near][np.isfinite(points[near]).all(axis=1)]
        assert {tuple(p) for p in got[t]} == {tuple(p) for p in kept}
