"""Flat, linear, mixture and flow: densities of the parameters given columns, mixed by what left-out draws say."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from ...core.arrays import FloatArray, IntArray
from ..posterior.flow import FlowPosterior
from ..posterior.latent import LatentDensity, LatentFlow, LatentMixture
from .coordinates import NAMES, STRAIGHT, Coordinates, fitted_scale
from .ensemble import Schedule, left_out, train_ensemble
from .first_guess import FirstGuess
from .flow import FlowNetwork, FlowShape
from .mixture_head import MixtureHead
from .networks import SummaryNetwork
from .sparse_regression import shrunk_factor
from .stacking import stack
from .training import DensityNetwork

# Training targets nearer to a face of the cube than this are moved to it: hundreds of draws resolve no more.
_FACE = 1e-4
# A prediction nearer than this is read as lying there.
_GUESS_FACE = 0.01
# Coordinates about nothing or about a guess are left out untried when the other's linear density is this much better
# [nats].
_DECISIVE = 0.5
# A density of less weight than this is left out.
_LEAST = 0.01


@dataclass(frozen=True)
class Shape:
    """Which densities are tried, and how large they are; see :class:`~..estimators.npe_settings.Settings`."""

    heads: tuple[str, ...]
    members: int
    held_out: float
    coordinates: str
    components: int
    hidden: tuple[int, ...]
    transforms: int
    bins: int


@dataclass(frozen=True, eq=False)
class Seen:
    """What a density reads of draws, or of a measurement.

    Args:
        columns: ``(N, F)`` standardised features.
        guess: ``(N, D)`` predictions of the parameters in the unit cube, of training draws each made without the
            draw; None where there are none. No network reads them.
    """

    columns: FloatArray
    guess: FloatArray | None


@dataclass(frozen=True, eq=False)
class _Group:
    """Densities that share a weight: at a measurement, and what they said of left-out draws (on the cube)."""

    at: Callable[["Seen"], list[LatentDensity]]
    scores: FloatArray


class StackedDensity:
    """``q(u | f)``, a mixture of densities of several kinds, each trained on what a linear density leaves over.

    First a sparse linear regression (:class:`~.sparse_regression.SparseRegression`), in one or both kinds of
    coordinates; then ensembles of mixture density networks and of spline flows on its whitened errors, so that they
    start at the linear density; beside them the linear density itself and the flat one. How much each counts is
    found by stacking: the weights that maximise the mean log density of draws that were left out.

    Args:
        seen: the training draws; unit: ``(N, D)``; weights: ``(N,)``.
        shown: indices of those that the networks read; the regression reads all.
        shape, schedule: what is trained and how.
        generator: of all that is random.
        device: where.

    Attributes:
        weights: of the groups, by name.
    """

    def __init__(
        self,
        seen: Seen,
        shown: IntArray,
        unit: FloatArray,
        weights: FloatArray,
        shape: Shape,
        schedule: Schedule,
        generator: torch.Generator,
        device: torch.device,
    ) -> None:
        self._shape, self._schedule, self._generator, self._device = shape, schedule, generator, device
        self._seen, self._shown, self._weights = seen, shown, weights
        self._held = left_out(len(unit), shape.members, shape.held_out, generator)
        dim = unit.shape[1]
        flat = LatentMixture(Coordinates.probit(dim), np.ones(1), np.zeros((1, dim)), np.eye(dim)[None])
        groups = {"flat": _Group(lambda f: [flat], np.zeros(len(unit)))}
        bases = self._bases(unit)
        groups |= {f"linear, {name}": base.group for name, base in bases.items()}
        tried = {name: base.group for name, base in bases.items()}
        if "mixture" in shape.heads:
            tried = {name: self._networks("mixture", base) for name, base in bases.items()}
            groups |= {f"mixture, {name}": group for name, group in tried.items()}
        if "flow" in shape.heads:
            # The mixtures, which are cheap, say in which coordinates the flows are worth their time.
            best = max(tried, key=lambda name: self._mean(tried[name]))
            groups[f"flow, {best}"] = self._networks("flow", bases[best])
        scored = np.isfinite(np.stack([g.scores for g in groups.values()])).all(axis=0)
        found = stack(np.stack([g.scores[scored] for g in groups.values()], axis=1), weights[scored])
        found = np.where(found < _LEAST, 0.0, found) / found[found >= _LEAST].sum()
        self.weights = {name: float(w) for name, w in zip(groups, found, strict=True) if w > 0}
        self._groups = {name: groups[name] for name in self.weights}

    def posterior(self, seen: Seen) -> FlowPosterior:
        """The density at one measurement."""
        weights, parts = [], []
        for name, group in self._groups.items():
            members = group.at(seen)
            weights += [self.weights[name] / len(members)] * len(members)
            parts += members
        return FlowPosterior(np.array(weights), parts)

    def _mean(self, group: _Group) -> float:
        scored = np.isfinite(group.scores)
        return float((self._weights * np.where(scored, group.scores, 0.0)).sum() / self._weights[scored].sum())

    def _bases(self, unit: FloatArray) -> "dict[str, _Base]":
        wanted = NAMES if self._shape.coordinates == "auto" else (self._shape.coordinates,)
        bases = {name: _Base.fit(name, self._seen, unit, self._weights) for name in wanted}
        if self._shape.coordinates == "auto":
            if (bases["box"].scale < 2.0 * STRAIGHT).all():
                del bases["straight"]  # the same, nearly
            gain = self._mean(bases["box"].group) - self._mean(bases["probit"].group)
            if abs(gain) > _DECISIVE:
                bases = {name: base for name, base in bases.items() if (name == "probit") == (gain < 0)}
        return bases

    def _networks(self, head: str, base: "_Base") -> _Group:
        s, (draws, dim) = self._shape, base.white.shape
        features = len(self._shown)
        flow = FlowShape(features, dim, s.transforms, s.hidden, s.bins)

        def made() -> DensityNetwork:
            if head == "flow":
                return FlowNetwork(flow)
            return SummaryNetwork(features, s.hidden, MixtureHead(s.hidden[-1], dim, s.components, torch.ones(dim)))

        members = [made() for _ in range(s.members)]
        context = torch.tensor(self._seen.columns[:, self._shown], dtype=torch.float32)
        inputs = [context] if head == "flow" else [context, torch.zeros(draws, dim)]
        scores = train_ensemble(
            members, inputs, torch.tensor(base.white, dtype=torch.float32),
            torch.tensor(self._weights, dtype=torch.float32), self._held, self._schedule, self._generator, self._device,
        )  # fmt: skip
        at = base.flows(members, self._shown) if head == "flow" else base.mixtures(members, self._shown)
        return _Group(at, scores.numpy().astype(float) + base.volume)


@dataclass(frozen=True, eq=False)
class _Base:
    """The linear density in one kind of coordinates, and the whitened errors that the networks learn.

    Args:
        at: a measurement to coordinates and the centre ``(D,)`` of the errors in them.
        cholesky: ``(D, D)``, what the errors are whitened by.
        white: ``(N, D)``, the left-out ones of the training draws.
        volume: ``(N,)``, what turns a log density of whitened errors into one on the cube.
        scale: ``(D,)`` of the coordinates.
    """

    at: Callable[[Seen], tuple[Coordinates, FloatArray]]
    cholesky: FloatArray
    white: FloatArray
    volume: FloatArray
    scale: FloatArray

    @classmethod
    def fit(cls, name: str, seen: Seen, unit: FloatArray, weights: FloatArray) -> "_Base":
        unit = np.clip(unit, _FACE, 1.0 - _FACE)
        dim = unit.shape[1]
        if name == "probit":
            probit = Coordinates.probit(dim)
            z = probit.to_latent(unit)
            first = FirstGuess.fit(seen.columns, z, weights, _inner(probit, seen.guess))
            errors, slope, scale = first.residual, probit.log_slope(unit, z), probit.scale

            def at(f: Seen) -> tuple[Coordinates, FloatArray]:
                return probit, first.mean(f.columns, _inner(probit, f.guess))[0]
        else:
            first = FirstGuess.fit(seen.columns, unit, weights, seen.guess)
            guess = unit - first.residual
            scale = fitted_scale(guess, unit, weights)
            if name == "straight":
                scale = np.minimum(scale, STRAIGHT)
            about = Coordinates.about(guess, scale)
            errors = about.to_latent(unit)
            slope = about.log_slope(unit, errors)

            def at(f: Seen) -> tuple[Coordinates, FloatArray]:
                return Coordinates.about(first.mean(f.columns, f.guess)[0], scale), np.zeros(dim)

        cholesky = shrunk_factor(errors, weights)
        white = np.linalg.solve(cholesky, errors.T).T
        return cls(at, cholesky, np.asarray(white), slope.sum(axis=1) - np.log(np.diagonal(cholesky)).sum(), scale)

    @property
    def group(self) -> _Group:
        """The linear density itself."""

        def density(f: Seen) -> list[LatentDensity]:
            coordinates, center = self.at(f)
            return [LatentMixture(coordinates, np.ones(1), center[None], self.cholesky[None])]

        norm = 0.5 * self.white.shape[1] * np.log(2.0 * np.pi)
        return _Group(density, -0.5 * (self.white**2).sum(axis=1) - norm + self.volume)

    def flows(self, members: Sequence[DensityNetwork], shown: IntArray) -> Callable[[Seen], list[LatentDensity]]:
        flows = [m for m in members if isinstance(m, FlowNetwork)]

        def density(f: Seen) -> list[LatentDensity]:
            coordinates, center = self.at(f)
            return [LatentFlow(coordinates, f.columns[0, shown], center, self.cholesky, m) for m in flows]

        return density

    def mixtures(self, members: Sequence[DensityNetwork], shown: IntArray) -> Callable[[Seen], list[LatentDensity]]:
        def density(f: Seen) -> list[LatentDensity]:
            context, start = torch.tensor(f.columns[:, shown], dtype=torch.float32), torch.zeros(1, self.white.shape[1])
            return [self._mixture(f, [t[0].double() for t in m(context, start)]) for m in members]

        return density

    def _mixture(self, f: Seen, outputs: list[Tensor]) -> LatentMixture:
        coordinates, center = self.at(f)
        log_weights, means, factors = outputs
        cholesky = self.cholesky @ torch.linalg.inv(factors).numpy()
        weights = log_weights.exp().numpy()
        moved = center + means.numpy() @ self.cholesky.T
        return LatentMixture(coordinates, weights / weights.sum(), moved, cholesky)


def _inner(probit: Coordinates, guess: FloatArray | None) -> FloatArray | None:
    """Predictions of the cube in probit coordinates; those on or beyond a face as a little inside."""
    return None if guess is None else probit.to_latent(np.clip(guess, _GUESS_FACE, 1.0 - _GUESS_FACE))
