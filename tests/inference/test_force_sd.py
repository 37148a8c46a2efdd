"""How sure an estimated force is: the posterior of the problem that was solved, in closed form."""

import numpy as np
import pytest

from muslin.core.body import cloth_grid
from muslin.core.parameters import Parameter, ParameterSpace
from muslin.inference.criticism.unknown.basis import make_basis
from muslin.inference.criticism.unknown.estimate import Estimate, Unknowns

BASIS = make_basis(cloth_grid(0.3, 0.3, 5, 5), np.array([0, 4]), np.linspace(0.0, 1.0, 31), 12, 25)
UNKNOWNS = Unknowns(ParameterSpace((Parameter("s", "1", 0.0, 1.0),)), ("r",), ("f",), (BASIS,), (0.0,))
SMOOTH, COUNT = 0.7, 500
#: Of the data, by unknown: the last three are not seen at all.
INFORMATION = np.array([400.0, *np.geomspace(0.1, 1e4, len(BASIS) - 3), 0.0, 0.0, 0.0])


def estimate(left: float) -> Estimate:
    """Whose residuals are ``left`` times the noise, and which each unknown moves another one of."""
    slopes = np.zeros((COUNT, len(INFORMATION)))
    slopes[np.arange(len(INFORMATION)), np.arange(len(INFORMATION))] = np.sqrt(INFORMATION)
    white = np.full(COUNT, left)
    point = np.full(len(INFORMATION), 0.5)
    return Estimate(UNKNOWNS, point, point[:1], [white], [slopes], SMOOTH, [], float(COUNT), 1e6)


@pytest.mark.parametrize(("left", "scale"), [(5.0, 25.0), (1.0, 1.0), (0.5, 1.0)])
def test_sds_and_degrees_are_those_of_data_that_tell_less_against_a_prior_that_stays(left: float, scale: float) -> None:
    found, prior = estimate(left), UNKNOWNS.precisions(SMOOTH)
    sd = np.sqrt(np.diag(found.covariance()))
    np.testing.assert_allclose(sd, 1 / np.sqrt(INFORMATION / scale + prior))
    np.testing.assert_allclose(sd[-3:], 1 / np.sqrt(prior[-3:]))  # nothing is learned there
    assert (sd <= 1 / np.sqrt(prior) * (1 + 1e-12)).all()
    told = INFORMATION / scale
    assert found.degrees() == pytest.approx(float(np.sum(told / (told + prior))))
