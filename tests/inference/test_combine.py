"""Several posteriors of one parameter: held against the closed form of Gaussians in probit coordinates."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("scipy")

from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import norm

from muslin.core.errors import InputError
from muslin.core.parameters import Parameter, ParameterSpace
from muslin.inference.posterior.combine import SharedParameter, shared_parameter
from muslin.inference.posterior.mixture import MixturePosterior
from muslin.inference.posterior.physical import PhysicalPosterior

STIFFNESS = Parameter("stretch_stiffness", "N/m", 10.0, 1e4, "log")


def gaussian(mean: float, sd: float, parameter: Parameter = STIFFNESS) -> PhysicalPosterior:
    """Second of two parameters; N(mean, sd^2) in probit coordinates, in which the prior is N(0, 1)."""
    posterior = MixturePosterior(np.ones(1), np.array([[0.3, mean]]), np.diag([0.5, sd])[None])
    return PhysicalPosterior(posterior, ParameterSpace((Parameter("friction", "1", 0.0, 1.0), parameter)))


def together(*posteriors: PhysicalPosterior) -> SharedParameter:
    paths = [Path(f"{k}.toml") for k in range(len(posteriors))]
    return shared_parameter("stretch_stiffness", paths, posteriors)


def exact(means: Sequence[float], sds: Sequence[float]) -> tuple[float, float, float]:
    """Mean and standard deviation of all together in probit coordinates, and the log Bayes factor."""
    m, s = np.array(means), np.array(sds)
    precision = (s**-2.0).sum() - (len(m) - 1)
    mean, sd = float((m / s**2).sum() / precision), float(precision**-0.5)
    at = 0.3  # the integrand over its own normalised density is the same everywhere
    log_factor = norm.logpdf(at, m, s).sum() - (len(m) - 1) * norm.logpdf(at) - norm.logpdf(at, mean, sd)
    return mean, sd, float(log_factor)


gaussians = st.lists(st.tuples(st.floats(-1.0, 1.0), st.floats(0.15, 0.7)), min_size=2, max_size=4)


@settings(max_examples=40)
@given(gaussians)
def test_gaussians_are_combined_as_the_closed_form_says(told: list[tuple[float, float]]) -> None:
    found = together(*(gaussian(m, s) for m, s in told))
    mean, sd, log_factor = exact(*zip(*told, strict=True))
    levels = norm.cdf(norm.ppf([0.05, 0.5, 0.95], mean, sd))
    np.testing.assert_allclose(np.log(found.together / 10.0) / np.log(1e3), levels, atol=2e-3)
    assert found.log_factor == pytest.approx(log_factor, abs=0.02)


@pytest.mark.parametrize("other", [(0.0, 1.3), (-2.5, 1.2), (4.5, 0.3)])
def test_one_that_is_piled_on_a_bound_counts_as_the_closed_form_says(other: tuple[float, float]) -> None:
    """Wider than the prior its density has no bound there; narrow, all of it may lie in the last of many cells."""
    found = together(gaussian(0.2, 0.3), gaussian(*other))
    assert found.log_factor == pytest.approx(exact((0.2, other[0]), (0.3, other[1]))[2], abs=0.02)
    own = np.log(found.quantiles[1] / 10.0) / np.log(1e3)
    np.testing.assert_allclose(own, norm.cdf(norm.ppf([0.05, 0.5, 0.95], *other)), atol=2e-3)


def test_the_order_does_not_matter_and_a_flat_posterior_says_nothing() -> None:
    a, b, flat = gaussian(0.5, 0.3), gaussian(0.1, 0.4), gaussian(0.0, 1.0)
    one, other, more = together(a, b), together(b, a), together(a, flat, b)
    for found in (other, more):
        np.testing.assert_allclose(found.together, one.together, rtol=1e-9)
        assert found.log_factor == pytest.approx(one.log_factor, abs=1e-6)


def test_only_what_all_priors_allow_counts() -> None:
    """Under half the prior a posterior is that under the whole, cut."""
    whole = gaussian(0.0, 0.2)
    half = Parameter("stretch_stiffness", "N/m", 10.0, 10**2.5, "log")
    found = together(whole, gaussian(0.0, 1.0, half))
    assert (found.parameter.low, found.parameter.high) == (10.0, pytest.approx(10**2.5))
    cut = 10 * 1e3 ** norm.cdf(norm.ppf(np.array([0.025, 0.25, 0.475]), 0.0, 0.2))
    np.testing.assert_allclose(found.together, cut, rtol=5e-3)
    np.testing.assert_allclose(found.quantiles[0], cut, rtol=5e-3)


def test_it_says_whether_one_value_does_for_all_and_whose_does_not() -> None:
    a, b, odd, vague = gaussian(0.0, 0.1), gaussian(0.05, 0.1), gaussian(1.5, 0.1), gaussian(0.0, 0.95)
    assert together(a, b).agree is True and "they agree" in together(a, b).text()
    assert together(a, vague).agree is None and "do not say" in together(a, vague).text()
    found = together(a, odd, b)
    assert found.agree is False and found.odd == Path("1.toml")
    assert "do not use what they say together; without 1.toml the others agree" in found.text()
    assert together(a, odd).odd is None
    sure = together(*(gaussian(m, 0.01) for m in (0.0, 0.01, 2.0)))  # densities are zero where the others have theirs
    assert sure.agree is False and sure.odd == Path("2.toml") and "more than 10000 times" in sure.text()


def test_it_says_when_a_bound_of_the_priors_cuts_them_off() -> None:
    low, high = gaussian(-2.0, 0.7), gaussian(2.0, 0.7)
    assert together(gaussian(0.2, 0.3), gaussian(0.0, 0.3)).bounds == ()
    assert together(low, low).bounds == ("lower",) and together(high, gaussian(0.0, 1.0)).bounds == ("upper",)
    assert "piled on the upper bound of the priors, 10000 N/m" in together(high, high).text()


def test_priors_that_do_not_go_together_are_refused() -> None:
    linear = Parameter("stretch_stiffness", "N/m", 10.0, 1e4)
    with pytest.raises(InputError, match=r"with a log prior in 0\.toml, but in N/m with a linear prior in 1\.toml"):
        together(gaussian(0.0, 0.3), gaussian(0.0, 0.3, linear))
    above = Parameter("stretch_stiffness", "N/m", 1e4, 1e5, "log")
    with pytest.raises(InputError, match="no value in common"):
        together(gaussian(0.0, 0.3), gaussian(0.0, 0.3, above))
    top = Parameter("stretch_stiffness", "N/m", 9e3, 1e5, "log")
    with pytest.raises(InputError, match=r"0\.toml: its posterior .* lies outside the priors of the others"):
        together(gaussian(-1.0, 0.1), gaussian(0.0, 0.3, top))
