"""Flat, linear, mixture and flow: densities of the parameters given columns, mixed by what left-out draws say."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import torch

from ...core.arrays import FloatArray
from ..posterior.flow import FlowPosterior
from ..posterior.latent import LatentDensity, LatentFlow, LatentMixture
from .coordinates import NAMES, STRAIGHT, Coordinates
from .draws import Draws
from .ensemble import Schedule, left_out, train_ensemble
from .flow import FlowNetwork, FlowShape
from .linear_density import LinearDensity, White
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


@dataclass(frozen=True)
class Shape:
    """Which densities are tried, and how large they are; see :class:`~..estimators.npe_settings.Settings`.

    Args:
        principal, shown: of :class:`~.view.View`.
    """

    heads: tuple[str, ...]
    members: int
    held_out: float
    coordinates: str
    components: int
    hidden: tuple[int, ...]
    transforms: int
    bins: int
    principal: int
    shown: int


@dataclass(frozen=True, eq=False)
class _Group:
    """Densities that share a weight.

    Args:
        at: a measurement as each member sees it to the densities.
        scores: ``(N,)`` log density on the cube of every draw under the member that left it out; NaN where none did.
    """

    at: Callable[[list[Seen]], Sequence[LatentDensity]]
    scores: FloatArray


@dataclass(frozen=True, eq=False)
class _Base:
    """The members' linear densities in one kind of coordinates, and draws as each of them sees these.

    Args:
        linear: one a member.
        white: ``(E, N, D)`` and ``(E, N)``.
        group: the linear densities themselves.
    """

    linear: list[LinearDensity]
    white: White
    group: _Group


class StackedDensity:
    """``q(u | x)``, a mixture of densities of several kinds, each trained on what a linear density leaves over.

    Each member leaves out some of the draws and makes everything without them: the columns that it reads and its
    regressions (:class:`~.view.View`); in one or more kinds of coordinates a linear density
    (:class:`~.linear_density.LinearDensity`); and mixture density networks and spline flows on its whitened errors,
    which so start at the linear density. Beside these stands the flat density. How much each kind counts is found by
    stacking: the weights that maximise the mean log density of the draws left out. These must be as strange to the
    member as a measurement will be, or the widths that suit them would be too narrow.

    Args:
        known: of the training draws.
        draws: their parameters and weights.
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
        shape: Shape,
        schedule: Schedule,
        generator: torch.Generator,
        device: torch.device,
    ) -> None:
        self._shape, self._schedule, self._generator, self._device = shape, schedule, generator, device
        self._unit, self._weights = draws.unit.numpy(), draws.weights.numpy()
        self._held = left_out(len(self._unit), shape.members, shape.held_out, generator)
        self._views = [View(known.among(~h), draws.among(~h), shape.principal, shape.shown) for h in self._held]
        self._left = [view(known.among(h)) for view, h in zip(self._views, self._held, strict=True)]
        # Networks that are trained in one go have inputs of one width.
        self._width = max(len(view.shown) for view in self._views)
        self._context = self._both(
            [view.context(view.training, self._width) for view in self._views],
            [view.context(seen, self._width) for view, seen in zip(self._views, self._left, strict=True)],
        )
        dim = self._unit.shape[1]
        flat = LatentMixture(Coordinates.probit(dim), np.ones(1), np.zeros((1, dim)), np.eye(dim)[None])
        groups = {"flat": _Group(lambda seen: [flat], np.zeros(len(self._unit)))}
        bases = self._bases()
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
        found = stack(np.stack([g.scores[scored] for g in groups.values()], axis=1), self._weights[scored])
        found = np.where(found < _LEAST, 0.0, found) / found[found >= _LEAST].sum()
        self.weights = {name: float(w) for name, w in zip(groups, found, strict=True) if w > 0}
        self._groups = {name: groups[name] for name in self.weights}

    def posterior(self, known: Known) -> FlowPosterior:
        """The density at one measurement."""
        seen = [view(known) for view in self._views]
        weights: list[float] = []
        parts: list[LatentDensity] = []
        for name, group in self._groups.items():
            members = group.at(seen)
            weights += [self.weights[name] / len(members)] * len(members)
            parts += members
        return FlowPosterior(np.array(weights), parts)

    def _both(self, trained: list[FloatArray], left: list[FloatArray]) -> FloatArray:
        """``(E, N, ...)`` of what each member has of the draws that it was made from and of those that it left out."""
        held = self._held.numpy()
        both = np.zeros((*held.shape, *left[0].shape[1:]))
        for row, h, own, other in zip(both, held, trained, left, strict=True):
            row[~h], row[h] = own, other
        return both

    def _of_left(self, each: FloatArray) -> FloatArray:
        """``(N,)`` of ``(E, N)``: every draw's under the member that left it out; NaN where none did."""
        out = np.full(len(self._unit), np.nan)
        member, draw = np.nonzero(self._held.numpy())
        out[draw] = each[member, draw]
        return out

    def _mean(self, group: _Group) -> float:
        scored = np.isfinite(group.scores)
        return float((self._weights * np.where(scored, group.scores, 0.0)).sum() / self._weights[scored].sum())

    def _bases(self) -> dict[str, _Base]:
        wanted = NAMES if self._shape.coordinates == "auto" else (self._shape.coordinates,)
        bases = {name: self._base(name) for name in wanted}
        if self._shape.coordinates == "auto":
            if all((linear.scale < 2.0 * STRAIGHT).all() for linear in bases["box"].linear):
                del bases["straight"]  # the same, nearly
            gain = self._mean(bases["box"].group) - self._mean(bases["probit"].group)
            if abs(gain) > _DECISIVE:
                bases = {name: base for name, base in bases.items() if (name == "probit") == (gain < 0)}
        return bases

    def _base(self, name: str) -> _Base:
        held = self._held.numpy()
        linear = [
            LinearDensity.fit(name, view, self._unit[~h], self._weights[~h])
            for view, h in zip(self._views, held, strict=True)
        ]
        own = [density.training for density in linear]
        left = [d.white(seen, self._unit[h]) for d, seen, h in zip(linear, self._left, held, strict=True)]
        white = White(
            self._both([w.errors for w in own], [w.errors for w in left]),
            self._both([w.volume for w in own], [w.volume for w in left]),
        )
        group = _Group(
            lambda seen: [d.density(s) for d, s in zip(linear, seen, strict=True)], self._of_left(white.log_prob)
        )
        return _Base(linear, white, group)

    def _networks(self, head: str, base: _Base) -> _Group:
        s, (members, draws, dim) = self._shape, base.white.errors.shape
        flow = FlowShape(self._width, dim, s.transforms, s.hidden, s.bins)

        def made() -> DensityNetwork:
            if head == "flow":
                return FlowNetwork(flow)
            return SummaryNetwork(self._width, s.hidden, MixtureHead(s.hidden[-1], dim, s.components, torch.ones(dim)))

        networks = [made() for _ in range(members)]
        context = torch.tensor(self._context, dtype=torch.float32)
        inputs = [context] if head == "flow" else [context, torch.zeros(members, draws, dim)]
        scores = train_ensemble(
            networks, inputs, torch.tensor(base.white.errors, dtype=torch.float32),
            torch.tensor(self._weights, dtype=torch.float32), self._held, self._schedule, self._generator, self._device,
        )  # fmt: skip

        def at(seen: list[Seen]) -> list[LatentDensity]:
            return [self._density(*of) for of in zip(networks, base.linear, self._views, seen, strict=True)]

        return _Group(at, scores.numpy().astype(float) + self._of_left(base.white.volume))

    def _density(self, network: DensityNetwork, linear: LinearDensity, view: View, seen: Seen) -> LatentDensity:
        """A member's at one measurement."""
        context = view.context(seen, self._width)
        if isinstance(network, FlowNetwork):
            coordinates, center = linear.one(seen)
            return LatentFlow(coordinates, context[0], center, linear.cholesky, network)
        start = torch.zeros(1, len(linear.scale))
        log_weights, means, factors = (t[0].double() for t in network(torch.tensor(context).float(), start))
        weights = log_weights.exp().numpy()
        return linear.mixture(seen, weights / weights.sum(), means.numpy(), torch.linalg.inv(factors).numpy())
