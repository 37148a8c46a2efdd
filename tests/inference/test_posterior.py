"""What a posterior answers: marginals, quantiles, modes, regions, slices, and the same in physical units."""

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("scipy")

from known import Crescents
from scipy.special import ndtr

from muslin.core.errors import InputError, MissingFileError
from muslin.core.estimator import Posterior
from muslin.core.parameters import Parameter, ParameterSpace
from muslin.inference.posterior.files import formats, load_posterior
from muslin.inference.posterior.mixture import MixturePosterior
from muslin.inference.posterior.modes import modes
from muslin.inference.posterior.physical import PhysicalPosterior
from muslin.inference.posterior.regions import credible_intervals, credible_region
from muslin.inference.posterior.slices import all_slices, slice_through

FLAT = MixturePosterior(np.ones(1), np.zeros((1, 2)), np.eye(2)[None])
SPACE = ParameterSpace(
    (Parameter("stretch_stiffness", "N/m", 10.0, 1e4, "log"), Parameter("air-drag.coefficient", "1", 0.0, 2.0))
)


def two_peaks(dim: int = 2, weight: float = 0.7) -> MixturePosterior:
    means = np.stack([np.full(dim, -1.0), np.full(dim, 1.0)])
    return MixturePosterior(np.array([weight, 1 - weight]), means, np.stack([0.3 * np.eye(dim)] * 2))


class Plain(MixturePosterior):
    """A mixture that answers only by its draws, as a posterior without closed forms does."""

    format = ""
    mean, std, quantiles, marginal = Posterior.mean, Posterior.std, Posterior.quantiles, Posterior.marginal


PLAIN = Plain(two_peaks().weights, two_peaks().means, two_peaks().cholesky)


def test_closed_forms_and_answers_from_draws_agree() -> None:
    levels, at = np.array([0.05, 0.5, 0.95]), np.linspace(0.0, 1.0, 21)
    assert PLAIN.mean() == pytest.approx(two_peaks().mean(), abs=0.01)
    assert PLAIN.std() == pytest.approx(two_peaks().std(), abs=0.01)
    assert PLAIN.quantiles(levels) == pytest.approx(two_peaks().quantiles(levels), abs=0.02)
    assert PLAIN.marginal(1, at) == pytest.approx(two_peaks().marginal(1, at), abs=0.3)


@pytest.mark.parametrize("posterior", [two_peaks(), PLAIN, FLAT])
def test_marginals_integrate_to_one_and_nothing_lies_outside(posterior: Posterior) -> None:
    at = np.linspace(0.0, 1.0, 2001)
    assert np.trapezoid(posterior.marginal(0, at), at) == pytest.approx(1.0, abs=0.01)
    assert (posterior.marginal(0, np.array([-0.01, 1.01])) == 0).all()


def test_quantiles_of_a_mixture_are_exact() -> None:
    levels = np.array([0.01, 0.3, 0.699, 0.99])
    z = np.log(two_peaks().quantiles(levels)[:, 0] / (1 - two_peaks().quantiles(levels)[:, 0]))
    assert (np.diff(z) > 0).all()
    u = two_peaks().quantiles(levels)[:, 0]
    grid = np.linspace(0, 1, 200_001)
    below = np.cumsum(two_peaks().marginal(0, grid)) * (grid[1] - grid[0])
    assert np.interp(u, grid, below) == pytest.approx(levels, abs=1e-4)


@pytest.mark.parametrize("dim", [1, 2, 6])
def test_distinct_modes_are_found_with_their_mass(dim: int) -> None:
    found = modes(two_peaks(dim))
    assert [m.mass for m in found] == pytest.approx([0.7, 0.3], abs=0.03)
    # In the cube's density a component of sd s peaks at m / (1 - s^2) of its probit coordinate.
    assert found[0].unit == pytest.approx(ndtr(-1.0 / (1 - 0.3**2)), abs=0.01)
    assert found[1].unit == pytest.approx(ndtr(1.0 / (1 - 0.3**2)), abs=0.01)
    assert found[0].log_prob == pytest.approx(float(two_peaks(dim).log_prob(found[0].unit[None])[0]))
    assert found[0].log_prob >= two_peaks(dim).log_prob(two_peaks(dim).sample(500, np.random.default_rng(1))).max()


def test_a_curved_ridge_is_one_mode_and_a_flat_posterior_has_no_more() -> None:
    assert [m.mass for m in modes(Crescents())] == pytest.approx([0.7, 0.3], abs=0.03)
    assert len(modes(FLAT)) == 1


def test_peaks_without_a_dip_between_them_are_one() -> None:
    near = MixturePosterior(np.ones(2), np.array([[-0.25, 0.0], [0.25, 0.0]]), np.stack([0.3 * np.eye(2)] * 2))
    assert len(modes(near)) == 1


def test_credible_regions_hold_their_mass_and_are_the_smallest() -> None:
    fresh = two_peaks().sample(20_000, np.random.default_rng(5))
    prior = np.random.default_rng(6).random((20_000, 2))
    for mass in (0.5, 0.9):
        region = credible_region(two_peaks(), mass)
        assert region.contains(fresh).mean() == pytest.approx(mass, abs=0.015)
        assert region.volume == pytest.approx(region.contains(prior).mean(), abs=0.01)
        low, high = credible_intervals(two_peaks(), np.sqrt(mass)).T
        assert region.volume < np.prod(high - low)
    assert not credible_region(two_peaks(), 0.9).contains(np.array([[0.5, 0.5], [2.0, 0.5]])).any()
    for wrong in (0.0, 1.0, -1.0):
        with pytest.raises(InputError, match="between 0 and 1"):
            credible_region(two_peaks(), wrong)
        with pytest.raises(InputError, match="between 0 and 1"):
            credible_intervals(two_peaks(), wrong)


def test_slices_are_the_density_in_a_plane_with_the_components_marked() -> None:
    posterior, through = two_peaks(4), np.array([0.2, 0.3, 0.4, 0.5])
    cut = slice_through(posterior, through, 2, 0, points=11)
    place = through.copy()
    place[[2, 0]] = cut.at[3], cut.at[7]
    assert cut.log_prob[7, 3] == pytest.approx(float(posterior.log_prob(place[None])[0]))
    assert cut.centres == pytest.approx(np.array([[ndtr(-1.0)] * 2, [ndtr(1.0)] * 2]))
    assert cut.weights == pytest.approx([0.7, 0.3])
    assert [c.parameters for c in all_slices(posterior, through, 3)] == [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)]
    assert not len(slice_through(Crescents(), np.full(2, 0.5), 0, 1).weights)
    with pytest.raises(InputError, match="two of the parameters"):
        slice_through(posterior, through, 1, 1)
    with pytest.raises(InputError, match="unit cube"):
        slice_through(posterior, through[:2], 0, 1)


def test_physical_units_keep_the_mass_and_the_bounds() -> None:
    posterior = PhysicalPosterior(two_peaks(), SPACE)
    for name in SPACE.names:
        values, density = posterior.marginal(name, 2001)
        assert np.trapezoid(density, values) == pytest.approx(1.0, abs=0.01)
    draws = posterior.sample(20_000, np.random.default_rng(0))
    assert posterior.quantiles(np.array([0.1, 0.9])) == pytest.approx(np.quantile(draws, [0.1, 0.9], axis=0), rel=0.05)
    assert posterior.std() == pytest.approx(np.sqrt(np.diag(posterior.covariance())))
    # by importance sampling over the box, uniform in physical units
    rng = np.random.default_rng(1)
    box = np.array([10.0, 0.0]) + rng.random((400_000, 2)) * np.array([9990.0, 2.0])
    above = box[:, 0] > 1000
    mass = float(np.mean(np.exp(posterior.log_prob(box)) * above) * 9990.0 * 2.0)
    assert mass == pytest.approx(float((draws[:, 0] > 1000).mean()), abs=0.01)
    assert posterior.log_prob(np.array([[9.99, 1.0], [100.0, 2.01], [100.0, -0.01]])).max() == -np.inf
    with pytest.raises(InputError, match="no parameter 'x'"):
        posterior.marginal("x")
    with pytest.raises(InputError, match="the space has 2"):
        PhysicalPosterior(two_peaks(3), SPACE)


def test_the_support_is_the_prior_to_the_last_bit() -> None:
    """Against both bounds, on a scale where exp(log(x)) does not come back to x."""
    space = ParameterSpace((Parameter("a", "1", 3e-7, 0.1, "log"), Parameter("b", "m", -0.3, 0.1)))
    for side in (-30.0, 30.0):
        far = MixturePosterior(np.ones(1), np.full((1, 2), side), np.eye(2)[None])
        posterior = PhysicalPosterior(far, space)
        draws = posterior.sample(2000, np.random.default_rng(0))
        assert (draws >= [3e-7, -0.3]).all() and (draws <= [0.1, 0.1]).all()
        assert np.isfinite(posterior.log_prob(draws)).all()


def test_a_file_is_read_by_the_class_that_it_names(tmp_path: Path) -> None:
    path = tmp_path / "p.npz"
    two_peaks().save(path)
    back = load_posterior(path)
    assert type(back) is MixturePosterior
    assert np.array_equal(back.log_prob(np.full((1, 2), 0.3)), two_peaks().log_prob(np.full((1, 2), 0.3)))
    assert formats()["muslin-mixture-posterior-1"] is MixturePosterior

    class Elsewhere(MixturePosterior):
        format = "somewhere-else-1"

    Elsewhere(two_peaks().weights, two_peaks().means, two_peaks().cholesky).save(path)
    assert type(load_posterior(path)) is Elsewhere


def test_what_is_no_posterior_is_said(tmp_path: Path) -> None:
    with pytest.raises(MissingFileError):
        load_posterior(tmp_path / "none.npz")
    path = tmp_path / "p.npz"
    for content in (b"", b"nothing of the kind", b"\x80\x04N."):
        path.write_bytes(content)
        with pytest.raises(InputError, match="not a saved posterior"):
            load_posterior(path)
    with path.open("wb") as file:
        np.savez(file, format="from-the-future-9")
    with pytest.raises(InputError, match=r"from-the-future-9.*muslin-mixture-posterior-1"):
        load_posterior(path)
