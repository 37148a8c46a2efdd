"""What no parameter can make of a recording is taken off, and what one can is left alone."""

from types import SimpleNamespace

import numpy as np
import pytest

from muslin.inference.sequential.span import LEAST, Span

SD, SHAPE = 0.002, (30, 8, 3)
RNG = np.random.default_rng(0)
DIRECTIONS = RNG.normal(size=(3, *SHAPE))


def takes(measured: list[np.ndarray], correspondence: list[bool]) -> SimpleNamespace:
    return SimpleNamespace(
        measured=lambda: measured,
        correspondence=correspondence,
        clean=lambda points: points,
        noise=SimpleNamespace(sd=SD),
    )


def moved(theta: np.ndarray) -> np.ndarray:
    """Recordings ``(N, T, P, A)`` [m]: three parameters move all points along a direction each."""
    return 1.0 + 0.001 * np.tensordot(theta, DIRECTIONS, 1)


def test_what_parameters_make_stays_and_noise_and_misfit_across_go() -> None:
    clean = moved(RNG.normal(size=(40, 3)))
    span = Span(takes([clean[0]], [True]), [clean], None)
    other = moved(RNG.normal(size=(5, 3)))
    np.testing.assert_allclose(span([other])[0], other, atol=1e-9)
    noise = SD * RNG.normal(size=other.shape)
    left = span([other + noise])[0] - other
    assert np.sqrt(np.mean(left**2)) == pytest.approx(SD * np.sqrt(3 / np.prod(SHAPE)), rel=0.3)


def test_what_draws_do_less_than_noise_is_no_direction() -> None:
    amplitudes = np.array([1.0, 1.0, 0.2 * LEAST * SD / 0.001 / np.linalg.norm(DIRECTIONS[2])])
    clean = moved(RNG.normal(size=(40, 3)) * amplitudes)
    along = moved(np.array([[0.0, 0.0, 1.0]])) - 1.0
    kept = Span(takes([clean[0]], [True]), [clean], None)([clean[:1] + along])[0] - clean[:1]
    assert np.linalg.norm(kept) < 0.3 * np.linalg.norm(along)


def test_gaps_stay_gaps_and_clouds_are_left_alone() -> None:
    clean, cloud = moved(RNG.normal(size=(40, 3))), RNG.normal(size=(40, 30, 100, 3))
    measured = clean[0].copy()
    measured[3, 2] = np.nan
    seen = clean.copy()
    seen[:, 3, 2] = np.nan
    span = Span(takes([measured, cloud[0, :, :20]], [True, False]), [clean, cloud], None)
    points, unordered = span([seen, cloud[:, :, :20]])
    assert np.array_equal(np.isnan(points), np.isnan(seen))
    np.testing.assert_allclose(points[np.isfinite(points)], seen[np.isfinite(seen)], atol=1e-9)
    np.testing.assert_array_equal(unordered, cloud[:, :, :20])
    alone = Span(takes([cloud[0]], [False]), [cloud], None)([cloud])
    np.testing.assert_array_equal(alone[0], cloud)


def test_draws_of_no_weight_span_nothing() -> None:
    near, far = np.zeros((20, 3)), np.zeros((20, 3))
    near[:, 0], far[:, 1] = RNG.normal(size=20), 100.0
    clean = moved(np.concatenate([near, far]))
    log_weights = np.where(np.arange(40) < 20, 0.0, -np.inf)
    along = moved(np.array([[0.0, 1.0, 0.0]])) - 1.0
    kept = Span(takes([clean[0]], [True]), [clean], log_weights)([clean[:1] + along])[0] - clean[:1]
    assert np.linalg.norm(kept) < 0.1 * np.linalg.norm(along)


def test_recordings_tell_of_parameters_together() -> None:
    """Each of sixteen recordings alone shows a direction by less than counts; all together show it."""
    theta = RNG.normal(size=(40, 1)) * 0.5 * LEAST * SD / 0.001 / np.linalg.norm(DIRECTIONS[0])
    each = moved(np.concatenate([theta, np.zeros((40, 2))], axis=1))
    span = Span(takes([each[0]] * 16, [True] * 16), [each] * 16, None)
    np.testing.assert_allclose(span([each] * 16)[7], each, atol=1e-9)


def test_what_a_best_fit_leaves_counts_no_more_than_noise() -> None:
    clean = moved(RNG.normal(size=(40, 3)))
    flawed = clean + SD * RNG.normal(size=clean.shape)
    best, noise = clean[0], SD * RNG.normal(size=SHAPE)
    for misfit, kept in ((0.0, 1.0), (50.0, 0.01)):
        off = misfit * SD * DIRECTIONS[1] + noise
        span = Span(takes([best + off], [True]), [clean], None)
        seen, plain = span.measured([best], [flawed])[0] - best, span([best + off])[0] - best
        np.testing.assert_allclose(seen, plain * np.linalg.norm(seen) / np.linalg.norm(plain), atol=1e-9)
        assert np.linalg.norm(seen) == pytest.approx(kept * np.linalg.norm(plain), rel=1e-6 if misfit == 0 else 2.0)
        assert np.linalg.norm(seen) < 5.0 * SD  # three directions of noise
