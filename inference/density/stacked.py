"""Flat, linear, mixture and flow: densities of the parameters given columns, mixed by what left-out draws say."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from scipy.special import logsumexp

from ...core.arrays import FloatArray
from ..posterior.flow import FlowPosterior
from ..posterior.latent import LatentDensity, LatentFlow, LatentMixture
from .coordinates import NAMES, STRAIGHT, Coordinates
from .draws import Draws
from .ensemble import Schedule, left_out, train_ensemble
from .flow import FlowNetwork, FlowShape
from .linear_density import LinearDensity
from .mixture_head import MixtureHead
from .networks import SummaryNetwork
from .stacking import stack
from .training import DensityNetwork
from .view import Known, Seen, View

# Coordinates about nothing or about a guess are left out untried when the other's linear density is this much better
# [nats].
_DECISIVE = 0.5
# A density of less weight than this is left out.
_LEAST = 0.01
# With fewer draws than this, each is left out by two members.
_FEW = 500


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
class _Group:
    """Densities that share a weight, one a member: at a measurement, as each member sees it; and left-out scores.

    Args:
        at: a member's number and what it reads to its density.
        scores: ``(E, N)`` log densities on the cube of the draws that each left out; NaN elsewhere.
    """

    at: Callable[[int, Seen], LatentDensity]
    scores: FloatArray

    @property
    def together(self) -> FloatArray:
        """``(N,)`` log of the mean density under the members that left a draw out; NaN where none did."""
        there = np.isfinite(self.scores)
        total = logsumexp(np.where(there, self.scores, -np.inf), axis=0)
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(np.where(there.any(axis=0), total - np.log(there.sum(axis=0)), np.nan))


class StackedDensity:
    """``q(u | x)``, a mixture of densities of several kinds, each trained on what a linear density leaves over.

    The draws are divided, and each part is left out by a member that makes everything without it: which columns it
    reads and what regressions on them predict (:class:`~.view.View`), in one or more kinds of coordinates a linear
    density (:class:`~.linear_density.LinearDensity`), and mixture density networks and spline flows on its whitened
    errors, which start at the linear density. Beside these stands the flat density. How much each kind counts is found
    by stacking: the weights that maximise the mean log density of the draws left out. As no member saw anything of
    these, they are told as well as a measurement is, and the mixture is as wide as it must be.

    Args:
        known: of the training draws.
        draws: their parameters and weights.
        principal, shown: as of :class:`~.view.View`.
        shape, schedule: what is trained and how.
        generator: of all that is random.
        device: where.

    Attributes:
        weights: of the groups, by name.
    """

    def __init__(
        self,
        known: Known,
        draws: Draws,
        principal: int,
        shown: int,
        shape: Shape,
        schedule: Schedule,
        generator: torch.Generator,
        device: torch.device,
    ) -> None:
        self._shape, self._schedule, self._generator, self._device = shape, schedule, generator, device
        self._unit, self._weights = draws.unit.numpy(), draws.weights.numpy()
        count, dim = self._unit.shape
        repeats = 2 if shape.members > 1 and count < _FEW else 1
        self._held = left_out(count, shape.members, shape.held_out, repeats, generator)
        held = self._held.numpy()
        self._views = [View(known.among(~h), draws.among(torch.tensor(~h)), principal, shown) for h in held]
        left = [view(known.among(h)) for view, h in zip(self._views, held, strict=True)]
        self._width = max(len(view.shown) for view in self._views)
        context = np.zeros((len(held), count, self._width))
        for k, (view, h) in enumerate(zip(self._views, held, strict=True)):
            context[k, ~h], context[k, h] = view.context(view.training, self._width), view.context(left[k], self._width)
        self._context = torch.tensor(context, dtype=torch.float32)
        flat = LatentMixture(Coordinates.probit(dim), np.ones(1), np.zeros((1, dim)), np.eye(dim)[None])
        groups = {"flat": _Group(lambda k, seen: flat, np.where(held, 0.0, np.nan))}
        bases = self._bases(left)
        groups |= {f"linear, {name}": base.group for name, base in bases.items()}
        tried = {name: base.group for name, base in bases.items()}
        if "mixture" in shape.heads:
            tried = {name: self._networks("mixture", base) for name, base in bases.items()}
            groups |= {f"mixture, {name}": group for name, group in tried.items()}
        if "flow" in shape.heads:
            # The mixtures, which are cheap, say in which coordinates the flows are worth their time.
            best = max(tried, key=lambda name: self._mean(tried[name]))
            groups[f"flow, {best}"] = self._networks("flow", bases[best])
        scores = np.stack([g.together for g in groups.values()], axis=1)
        scored = np.isfinite(scores).all(axis=1)
        found = stack(scores[scored], self._weights[scored])
        found = np.where(found < _LEAST, 0.0, found) / found[found >= _LEAST].sum()
        self.weights = {name: float(w) for name, w in zip(groups, found, strict=True) if w > 0}
        self._groups = {name: groups[name] for name in self.weights}

    def posterior(self, known: Sequence[Known]) -> FlowPosterior:
        """The density at one measurement, of which several may be known ways to read it; members take turns."""
        weights, parts = [], []
        for k, view in enumerate(self._views):
            seen = view(known[k % len(known)])
            for name, group in self._groups.items():
                weights.append(self.weights[name] / len(self._views))
                parts.append(group.at(k, seen))
        return FlowPosterior(np.array(weights), parts)

    def _mean(self, group: _Group) -> float:
        scores = group.together
        scored = np.isfinite(scores)
        return float((self._weights * np.where(scored, scores, 0.0)).sum() / self._weights[scored].sum())

    def _bases(self, left: list[Seen]) -> "dict[str, _Base]":
        wanted = NAMES if self._shape.coordinates == "auto" else (self._shape.coordinates,)
        held = self._held.numpy()
        bases = {name: _Base.fit(name, self._views, left, held, self._unit, self._weights) for name in wanted}
        if self._shape.coordinates == "auto":
            if all((linear.scale < 2.0 * STRAIGHT).all() for linear in bases["box"].linear):
                del bases["straight"]  # the same, nearly
            gain = self._mean(bases["box"].group) - self._mean(bases["probit"].group)
            if abs(gain) > _DECISIVE:
                bases = {name: base for name, base in bases.items() if (name == "probit") == (gain < 0)}
        return bases

    def _networks(self, head: str, base: "_Base") -> _Group:
        s, (members, draws, dim) = self._shape, base.white.shape
        flow = FlowShape(self._width, dim, s.transforms, s.hidden, s.bins)

        def made() -> DensityNetwork:
            if head == "flow":
                return FlowNetwork(flow)
            return SummaryNetwork(self._width, s.hidden, MixtureHead(s.hidden[-1], dim, s.components, torch.ones(dim)))

        networks = [made() for _ in range(members)]
        inputs = [self._context] if head == "flow" else [self._context, torch.zeros(members, draws, dim)]
        scores = train_ensemble(
            networks, inputs, torch.tensor(base.white, dtype=torch.float32),
            torch.tensor(self._weights, dtype=torch.float32), self._held, self._schedule, self._generator, self._device,
        )  # fmt: skip
        at = self._flow(networks, base) if head == "flow" else self._mixture(networks, base)
        return _Group(at, scores.numpy().astype(float) + base.volume)

    def _flow(self, networks: Sequence[DensityNetwork], base: "_Base") -> Callable[[int, Seen], LatentDensity]:
        flows = [n for n in networks if isinstance(n, FlowNetwork)]

        def density(k: int, seen: Seen) -> LatentDensity:
            coordinates, center = base.linear[k].one(seen)
            context = self._views[k].context(seen, self._width)[0]
            return LatentFlow(coordinates, context, center, base.linear[k].cholesky, flows[k])

        return density

    def _mixture(self, networks: Sequence[DensityNetwork], base: "_Base") -> Callable[[int, Seen], LatentDensity]:
        def density(k: int, seen: Seen) -> LatentDensity:
            linear = base.linear[k]
            coordinates, center = linear.one(seen)
            context = torch.tensor(self._views[k].context(seen, self._width), dtype=torch.float32)
            outputs = networks[k](context, torch.zeros(1, len(center)))
            log_weights, means, factors = (t[0].double() for t in outputs)
            weights = log_weights.exp().numpy()
            moved = center + means.numpy() @ linear.cholesky.T
            cholesky = linear.cholesky @ torch.linalg.inv(factors).numpy()
            return LatentMixture(coordinates, weights / weights.sum(), moved, cholesky)

        return density


@dataclass(frozen=True, eq=False)
class _Base:
    """The members' linear densities in one kind of coordinates, and the whitened errors that networks learn.

    Args:
        linear: one a member; held: ``(E, N)``.
        white: ``(E, N, D)``; volume: ``(E, N)``, as of :class:`~.linear_density.White`.
        scores: ``(E, N)`` log densities of the draws left out; NaN elsewhere.
    """

    linear: list[LinearDensity]
    white: FloatArray
    volume: FloatArray
    scores: FloatArray

    @classmethod
    def fit(
        cls, name: str, views: list[View], left: list[Seen], held: FloatArray, unit: FloatArray, weights: FloatArray
    ) -> "_Base":
        linear = []
        white, volume = np.zeros((*held.shape, unit.shape[1])), np.zeros(held.shape)
        scores = np.full(held.shape, np.nan)
        for k, (view, h) in enumerate(zip(views, held, strict=True)):
            linear.append(LinearDensity.fit(name, view, unit[~h], weights[~h]))
            own, other = linear[-1].training, linear[-1].white(left[k], unit[h])
            white[k, ~h], white[k, h] = own.errors, other.errors
            volume[k, ~h], volume[k, h] = own.volume, other.volume
            scores[k, h] = other.log_prob
        return cls(linear, white, volume, scores)

    @property
    def group(self) -> _Group:
        """The linear densities themselves."""
        return _Group(lambda k, seen: self.linear[k].density(seen), self.scores)
