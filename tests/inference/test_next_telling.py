"""How surely a motion tells models apart: closed forms, and refits of linear models by brute force."""

import numpy as np
import pytest

pytest.importorskip("scipy")

from scipy.stats import norm

from muslin.core.arrays import FloatArray
from muslin.inference.criticism.next.telling import View, named_right, reduced, repeated, score

MARGIN = 10.0


def views(count: int = 2, size: int = 30, seed: int = 0) -> list[View]:
    """Models whose parameters do nearly the same."""
    rng = np.random.default_rng(seed)
    same = rng.normal(0, 1.0, (size, 3))
    return [View(rng.normal(0, 0.55, size), same + rng.normal(0, 0.1, (size, 3))) for _ in range(count)]


def margins(count: int) -> FloatArray:
    return np.full((count, count), MARGIN)


def test_without_parameters_the_probability_is_that_of_a_normal() -> None:
    """Q = |d|^2 + 2 d n is normal with mean |d|^2 and standard deviation 2 |d|."""
    for size in (2.0, 4.0, 5.0):
        pair = [View(np.zeros(7), np.zeros((7, 0))), View(np.full(7, size / np.sqrt(7)), np.zeros((7, 0)))]
        known = norm.cdf((size**2 - MARGIN) / (2 * size))
        np.testing.assert_allclose(named_right(pair, np.zeros((2, 2)), margins(2)), known, atol=0.03)
        found = score(pair, np.zeros((2, 2)), margins(2))
        assert found[0, 1] == pytest.approx((size**2 - MARGIN) / (2 * size)) == found[1, 0]


def test_the_prediction_is_what_refitting_linear_models_gives() -> None:
    """Each model is refitted to its posterior and the new data by least squares."""
    pair, rng = views(seed=4), np.random.default_rng(1)
    leads = np.array([[0.0, 3.0], [-3.0, 0.0]])
    drops = []
    for _ in range(3000):
        data = pair[0].mean + pair[0].spread @ rng.standard_normal(3) + rng.standard_normal(30)
        rss = []
        for v in pair:
            rows = np.vstack([v.spread, np.eye(3)])  # the posterior so far is a standard normal prior
            right = np.concatenate([data - v.mean, np.zeros(3)])
            rss.append(float(np.linalg.lstsq(rows, right, rcond=None)[1][0]))
        drops.append(rss[1] - rss[0] + 3.0)
    share = float(np.mean(np.array(drops) > MARGIN))
    assert 0.1 < share < 0.98  # or the comparison could not fail
    assert named_right(pair, leads, margins(2))[0] == pytest.approx(share, abs=0.03)
    z = score(pair, leads, margins(2))[0, 1]
    assert z == pytest.approx((np.mean(drops) - MARGIN) / np.std(drops), abs=0.1)


def test_a_difference_that_a_parameter_can_make_tells_nothing() -> None:
    away = np.linspace(-1, 1, 40)
    clear = [View(np.zeros(40), np.zeros((40, 1))), View(3 * away, np.zeros((40, 1)))]
    hidden = [View(np.zeros(40), 50 * away[:, None]), View(3 * away, 50 * away[:, None])]
    assert named_right(clear, np.zeros((2, 2)), margins(2)).min() > 0.9
    assert named_right(hidden, np.zeros((2, 2)), margins(2)).max() < 0.01


def test_the_order_of_models_and_axes_does_not_matter() -> None:
    three, leads = views(3), np.array([[0, 1, 2], [-1, 0, 1], [-2, -1, 0.0]])
    order = [2, 0, 1]
    found = score(three, leads, margins(3))
    other = score([three[k] for k in order], leads[np.ix_(order, order)], margins(3))
    off = ~np.eye(3, dtype=bool)
    np.testing.assert_allclose(other[off], found[np.ix_(order, order)][off], rtol=1e-9)
    mixed = np.random.default_rng(0).permutation(30)
    same = score([View(v.mean[mixed], v.spread[mixed]) for v in three], leads, margins(3))
    np.testing.assert_allclose(same[off], found[off], rtol=1e-9)
    np.testing.assert_allclose(
        named_right([three[k] for k in order], leads[np.ix_(order, order)], margins(3)),
        named_right(three, leads, margins(3))[order],
        atol=0.04,
    )


def test_leaving_out_what_models_agree_on_changes_nothing() -> None:
    pair = views()
    a, b = score(pair, np.zeros((2, 2)), margins(2)), score(reduced(pair), np.zeros((2, 2)), margins(2))
    np.testing.assert_allclose(a[0, 1], b[0, 1], rtol=1e-9)


def test_more_takes_tell_more() -> None:
    pair = [View(0.45 * v.mean, v.spread) for v in views()]
    shares = [named_right(repeated(pair, n), np.zeros((2, 2)), margins(2)).min() for n in (1, 2, 4, 8)]
    assert shares[0] < 0.7 < 0.95 < shares[-1] and (np.diff(shares) > -0.02).all()


def test_twins_are_never_told_apart() -> None:
    one = views()[0]
    assert named_right([one, one], np.zeros((2, 2)), margins(2)).max() == 0.0
    assert score([one, one], np.zeros((2, 2)), margins(2))[0, 1] <= -MARGIN + 1e-6
