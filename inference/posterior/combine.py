"""The step ``combine``: what several studies say together of parameters that their objects share."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ...core.arrays import FloatArray
from ...core.errors import InputError
from ...core.parameters import Parameter, ParameterSpace
from ...core.registry import nearest
from ...core.study import Study
from ..sequential.bounds import cut_off
from ..sequential.result import load_fit
from .files import fitted_posterior, fitted_space
from .physical import PhysicalPosterior

#: Levels of the quantiles that are told.
LEVELS = np.array([0.05, 0.5, 0.95])
#: Cells of the grid over the range that all priors allow, and of those into which its first and last are divided: a
#: posterior that is piled on a bound may all lie in these, and its density need not have a bound there itself.
CELLS, FINER = 4000, 400
#: Less of a posterior than this within the priors of all others is nothing.
LEAST_MASS = 1e-3
#: Evenly spread draws of all together, by which it is seen whether a bound cuts them off.
DRAWS = 2000
#: A Bayes factor below which nothing is said (Jeffreys: barely worth mentioning).
TELLING = 3.0


@dataclass(frozen=True, eq=False)
class SharedParameter:
    """One parameter that several studies share.

    Args:
        parameter: with the range that the priors of all studies allow.
        studies: their files.
        quantiles: of each study's posterior on that range ``(K, 3)`` [unit], at :data:`LEVELS`.
        together: of all together ``(3,)`` [unit].
        log_factor: natural logarithm of the Bayes factor of one value for all over a value for each; it grows with
            the width of the priors.
        odd: the study without which that factor is largest, where one value for all does not do and the others agree.
        bounds: ``"lower"``, ``"upper"``: bounds of the range on which all together are piled.
        apart: studies whose best fit lies outside of their posterior.
    """

    parameter: Parameter
    studies: tuple[Path, ...]
    quantiles: FloatArray
    together: FloatArray
    log_factor: float
    odd: Path | None
    bounds: tuple[str, ...]
    apart: tuple[Path, ...] = ()

    @property
    def agree(self) -> bool | None:
        """Whether one value does for all; None where the data do not say."""
        return None if abs(self.log_factor) < math.log(TELLING) else self.log_factor > 0

    def text(self) -> str:
        """A table, and what to make of it."""
        named = [str(p) for p in self.studies] + ["together"]
        width = max(map(len, named))
        lines = [f"{self.parameter.name} [{self.parameter.unit}]", " " * (width + 2) + "       5 %      50 %      95 %"]
        for name, row in zip(named, [*self.quantiles, self.together], strict=True):
            lines.append(f"  {name:<{width}}" + "".join(f"{v:10.4g}" for v in row))
        lines += [self._judged(), *map(self._piled, self.bounds)]
        if self.apart:
            lines.append(
                f"warning: the best fit lies outside the posterior in {', '.join(map(str, self.apart))}; fit with more "
                "draws before you trust what they say together"
            )
        return "\n".join(lines)

    def _piled(self, side: str) -> str:
        p = self.parameter
        value = f"{p.high if side == 'upper' else p.low:g} {'' if p.unit == '1' else p.unit}".rstrip()
        return (
            f"warning: together they are piled on the {side} bound of the priors, {value}; if it may lie beyond, widen "
            "the priors of all of them and fit again"
        )

    def _judged(self) -> str:
        times = math.exp(min(abs(self.log_factor), 300.0))
        factor = f"{times:.2g}" if times < 1e4 else "more than 10000"
        if self.agree is None:
            return "one value for all, or one for each: these studies do not say"
        if self.agree:
            return f"one value for all is {factor} times as likely as one for each: they agree"
        said = f"one value for each is {factor} times as likely as one for all: do not use what they say together"
        return said + ("" if self.odd is None else f"; without {self.odd} the others agree")


@dataclass(frozen=True)
class Combined:
    """What :func:`combine` found, one parameter after the other."""

    parameters: tuple[SharedParameter, ...]

    def text(self) -> str:
        return "\n\n".join(p.text() for p in self.parameters)

    def to_json(self) -> dict[str, Any]:
        """Plain values: quantiles [units], and natural logarithms of Bayes factors."""
        return {
            "levels": LEVELS.tolist(),
            "parameters": [
                {
                    "name": p.parameter.name,
                    "unit": p.parameter.unit,
                    "low": p.parameter.low,
                    "high": p.parameter.high,
                    "scale": p.parameter.scale,
                    "studies": {str(s): list(map(float, row)) for s, row in zip(p.studies, p.quantiles, strict=True)},
                    "together": list(map(float, p.together)),
                    "log_bayes_factor": p.log_factor,
                    "agree": p.agree,
                    "odd": None if p.odd is None else str(p.odd),
                    "piled_on_bounds": list(p.bounds),
                    "best_fit_outside_posterior": [str(s) for s in p.apart],
                }
                for p in self.parameters
            ],
        }


def combine(studies: Sequence[Study], names: Sequence[str]) -> Combined:
    """Posteriors of parameters that the objects of several fitted studies share, and whether they do.

    Recordings of one study and of another are independent given the parameters, so p(theta | all) is proportional to
    p(theta) prod_k p(theta | D_k) / p(theta), and the integral of that is the Bayes factor of one value for all over a
    value for each. Every parameter is taken by itself, all others of its study are integrated out; what one shared
    parameter says of another is left out.

    Args:
        studies: fitted, two at least, of different recordings.
        names: parameters that all of them infer.

    Raises:
        InputError: too few studies, one recording in two of them, a parameter that one of them does not infer, or
            priors that do not go together.
        StepMissingError: a study has not been fitted.
    """
    if len(studies) < 2:
        raise InputError("one study has nothing to share; name two studies or more")
    _check_apart(studies)
    posteriors = [PhysicalPosterior(fitted_posterior(s), fitted_space(s)) for s in studies]
    common = [n for n in posteriors[0].space.names if all(n in p.space.names for p in posteriors)]
    if not names:
        told = f"they all infer {', '.join(common)}" if common else "they infer none in common"
        raise InputError(f"say which parameter is the same in all of them: --parameter NAME; {told}")
    for name in names:
        for study, posterior in zip(studies, posteriors, strict=True):
            if name not in posterior.space.names:
                close = nearest(name, list(posterior.space.names))
                inferred = ", ".join(posterior.space.names)
                raise InputError(f"{study.path} does not infer {name!r}.{close} It infers {inferred}")
    paths, apart = [s.path for s in studies], [load_fit(s).apart for s in studies]
    found = []
    for name in dict.fromkeys(names):
        doubted = tuple(path for path, those in zip(paths, apart, strict=True) if name in those)
        found.append(replace(shared_parameter(name, paths, posteriors), apart=doubted))
    return Combined(tuple(found))


def _check_apart(studies: Sequence[Study]) -> None:
    seen: dict[tuple[Path, str], int] = {}
    for k, study in enumerate(studies):
        for recording in study.problem.fit_on:
            key = (study.measurement_path.resolve(), study.problem.cut_from.get(recording, recording))
            if (first := seen.setdefault(key, k)) != k:
                raise InputError(
                    f"{studies[first].path} and {study.path} are both fitted on recording {key[1]!r} of {key[0].name}, "
                    "which would count twice; combine studies of different recordings"
                )


def shared_parameter(name: str, paths: Sequence[Path], posteriors: Sequence[PhysicalPosterior]) -> SharedParameter:
    """What the posteriors of the studies at ``paths`` tell together of the parameter ``name``; see :func:`combine`."""
    own = [p.space.parameters[p.space.names.index(name)] for p in posteriors]
    for path, other in zip(paths, own, strict=True):
        if (other.unit, other.scale) != (own[0].unit, own[0].scale):
            raise InputError(
                f"{name} is in {own[0].unit} with a {own[0].scale} prior in {paths[0]}, but in {other.unit} with a "
                f"{other.scale} prior in {path}; give both the same"
            )
    low, high = max(p.low for p in own), min(p.high for p in own)
    if low >= high:
        raise InputError(f"{name}: the priors of these studies have no value in common; widen them and fit again")
    range_of_all = Parameter(name, own[0].unit, low, high, own[0].scale)
    space, edges = ParameterSpace((range_of_all,)), _edges()
    values, widths = space.from_unit(0.5 * (edges[1:] + edges[:-1])[:, None])[:, 0], np.diff(edges)
    density = np.stack([_density(p, path, name, values, widths) for p, path in zip(posteriors, paths, strict=True)])
    log_density = np.log(np.maximum(density, np.finfo(float).tiny))
    log_factor, product = _product(log_density, widths)
    rows = [space.from_unit(_quantiles(d, edges, LEVELS)[:, None])[:, 0] for d in (*density, product)]
    drawn = _quantiles(product, edges, (np.arange(DRAWS) + 0.5) / DRAWS)
    bounds = tuple(side for side, d in (("lower", drawn), ("upper", 1.0 - drawn)) if cut_off(d))
    odd = None
    if len(paths) > 2 and log_factor < -math.log(TELLING):
        without = [_product(np.delete(log_density, k, axis=0), widths)[0] for k in range(len(paths))]
        best = int(np.argmax(without))
        odd = paths[best] if without[best] > math.log(TELLING) else None
    return SharedParameter(range_of_all, tuple(paths), np.stack(rows[:-1]), rows[-1], log_factor, odd, bounds)


def _edges() -> FloatArray:
    """Of the cells of the grid, ``(M + 1,)`` from 0 to 1."""
    finer = np.geomspace(1e-12, 1.0 / CELLS, FINER)
    return np.concatenate([[0.0], finer, np.arange(2, CELLS - 1) / CELLS, 1.0 - finer[::-1], [1.0]])


def _density(posterior: PhysicalPosterior, path: Path, name: str, values: FloatArray, widths: FloatArray) -> FloatArray:
    """Of one study in the middles of the cells ``(M,)``, relative to the prior on the range of all."""
    index = posterior.space.names.index(name)
    parameter = posterior.space.parameters[index]
    unit = np.clip(ParameterSpace((parameter,)).to_unit(values[:, None])[:, 0], 0.0, 1.0)
    density = posterior.unit.marginal(index, unit)
    mass = float(density @ widths)
    if mass * np.ptp(unit) < LEAST_MASS:
        raise InputError(f"{path}: its posterior of {name} lies outside the priors of the others; widen those")
    return np.asarray(density / mass)


def _product(log_density: FloatArray, widths: FloatArray) -> tuple[float, FloatArray]:
    """Natural logarithm of the Bayes factor of one value for all ``(K, M)``, and the normalised product ``(M,)``."""
    total = log_density.sum(axis=0)
    top = float(total.max())
    product = np.exp(total - top)
    area = float(product @ widths)
    return top + math.log(area), np.asarray(product / area)


def _quantiles(density: FloatArray, edges: FloatArray, levels: FloatArray) -> FloatArray:
    grown = np.concatenate([[0.0], np.cumsum(density * np.diff(edges))])
    return np.interp(levels, grown / grown[-1], edges)
