"""Two-dimensional slices of a posterior, as the paper shows them: density in a plane, component means marked."""

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from ...core.arrays import FloatArray
from ...core.errors import InputError
from ...core.estimator import Posterior
from ...core.parameters import ParameterSpace
from ...core.study import Study
from .files import fitted_posterior, fitted_space
from .modes import modes


@dataclass(frozen=True, eq=False)
class Slice:
    """The density in a plane of the unit cube: two parameters vary, the others stay as they are.

    Args:
        parameters: numbers of the two, the one across first.
        through: a point of the plane ``(D,)``.
        at: places on either axis ``(M,)``.
        log_prob: natural log density ``(M, M)``, rows are the second parameter.
        weights, centres: of the components of a mixture, ``(K,)`` and ``(K, 2)``; empty of any other posterior.
    """

    parameters: tuple[int, int]
    through: FloatArray
    at: FloatArray
    log_prob: FloatArray
    weights: FloatArray
    centres: FloatArray


def slice_through(posterior: Posterior, through: FloatArray, first: int, second: int, points: int = 101) -> Slice:
    """The slice through a point ``(D,)`` of the unit cube along two parameters.

    The grid has the middles of ``points`` equal cells an axis, so that none lies on a face of the cube.

    Raises:
        InputError: a point outside the cube, or parameters that are not two different ones of the posterior.
    """
    through = np.asarray(through, float)
    if through.shape != (posterior.dim,) or not ((through >= 0) & (through <= 1)).all():
        raise InputError(f"a slice goes through a point of the unit cube of {posterior.dim} parameters, not {through}")
    if first == second or not all(0 <= k < posterior.dim for k in (first, second)):
        raise InputError(f"a slice needs two of the parameters 0 to {posterior.dim - 1}, not {first} and {second}")
    at = (np.arange(points) + 0.5) / points
    places = np.tile(through, (points * points, 1))
    places[:, first], places[:, second] = np.tile(at, points), np.repeat(at, points)
    weights, centres = posterior.components() or (np.zeros(0), np.zeros((0, posterior.dim)))
    density = posterior.log_prob(places).reshape(points, points)
    return Slice((first, second), through, at, density, weights, centres[:, [first, second]])


def all_slices(posterior: Posterior, through: FloatArray, points: int = 101) -> list[Slice]:
    """One slice for every pair of parameters."""
    return [slice_through(posterior, through, a, b, points) for a, b in combinations(range(posterior.dim), 2)]


def slices(study: Study) -> tuple[ParameterSpace, list[Slice]]:
    """The step ``slices``: those of a fitted posterior through the centre of its first mode, one a pair of parameters.

    Raises:
        StepMissingError: the study has not been fitted.
        InputError: it has one parameter alone.
    """
    posterior = fitted_posterior(study)
    if posterior.dim < 2:
        raise InputError(f"{study.path} infers one parameter; a slice needs two")
    return fitted_space(study), all_slices(posterior, modes(posterior)[0].centre)
