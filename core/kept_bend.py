"""The bend that a rope keeps where nothing acts on it, as it follows from a state that it was seen in."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .arrays import FloatArray
from .bending import RopeBending
from .material import RopeMaterial
from .scene import Scene

#: Singular values below this share of the largest one count as zero.
_RANK = 1e-9
#: What less than this share of the states tell is hardly told.
_HARDLY = 0.03


@dataclass(frozen=True, eq=False)
class KeptBend:
    r"""Natural curvature of a rope of any stiffness, mass and damping under any gravity.

    It is linear in what it is made of, so it is told once for all draws of a study.

    Args:
        shape: what a rope keeps if it carries nothing ``(N, 2)`` [1/m].
        rates: what the damping of a bend that changes adds to that, per damping time ``(N, 2)`` [1/(m s)].
        moments: that what it carries bends it by ``(2, 4, N, 2)``: the rope's own mass, at 1 kg/m,
            and the loads; first for their acceleration [N m], then for a gravity of -1 m/s2 along x, y and z each.
    """

    shape: FloatArray
    rates: FloatArray
    moments: FloatArray

    def curvature(self, material: RopeMaterial, gravity: FloatArray) -> FloatArray:
        """The natural curvature ``(N, 2)`` [1/m]; ``gravity (3,)`` [m/s2]."""
        carried = np.tensordot([material.linear_density, 1.0], self.moments, 1)
        moments = carried[0] - np.tensordot(gravity, carried[1:], 1)
        return np.asarray(self.shape + material.damping_time * self.rates - moments / material.bending_rigidity)


@dataclass(frozen=True, eq=False)
class StateBend:
    """What one state of a rope tells of the bend that it keeps.

    Args:
        least: the smallest one that is in balance, in the mean square along the rope.
        ways: what may come on top of it, for all that this state tells, as what the grippers give at the ends remains
            open ``(N, 2, W)``; orthonormal in that mean.
        measures: lengths that the curvatures stand for ``(N,)`` [m].
    """

    least: KeptBend
    ways: FloatArray
    measures: FloatArray

    def turned(self, axes: FloatArray, into: FloatArray) -> "StateBend":
        """The same in other cross-section axes: from ``axes (N, 2, 3)`` into ``into (N, 2, 3)``."""
        turn = np.einsum("nax,nbx->nab", axes, into)
        old = self.least
        least = KeptBend(*(np.einsum("...na,nab->...nb", x, turn) for x in (old.shape, old.rates, old.moments)))
        return StateBend(least, np.einsum("naw,nab->nbw", self.ways, turn), self.measures)


def common_bend(states: Sequence[StateBend]) -> KeptBend:
    """The one bend that all ``states`` of a rope tell together, in axes that are the same in all.

    Each tells it but for its ways, which are other ones where the rope lies otherwise, so together they tell more
    than any one does; the mean of the smallest bends falls short by what each leaves open. What hardly any state tells,
    as an even bend between two clamps, stays as small as it may be: the states' errors would fill it otherwise.
    """
    weights = [np.sqrt(np.repeat(s.measures, 2))[:, None] for s in states]
    count = len(weights[0])
    told = np.mean([w * _columns(s.least) for w, s in zip(weights, states, strict=True)], axis=0)
    ways = [w * s.ways.reshape(count, -1) for w, s in zip(weights, states, strict=True)]
    seen = np.eye(count) - np.mean([w @ w.T for w in ways], axis=0)
    common = np.linalg.solve(seen + _HARDLY * np.eye(count), (1.0 + _HARDLY) * told)
    return _from_columns(common / np.mean(weights, axis=0))


def _columns(bend: KeptBend) -> FloatArray:
    """All that it is made of ``(2 N, 10)``."""
    return np.concatenate([x.reshape(-1, bend.shape.size) for x in (bend.shape, bend.rates, bend.moments)]).T


def _from_columns(columns: FloatArray) -> KeptBend:
    shape, rates, *moments = columns.T.reshape(10, -1, 2)
    return KeptBend(shape, rates, np.reshape(moments, (2, 4, *shape.shape)))


def kept_in(scene: Scene, bending: RopeBending) -> StateBend:
    r"""What follows from the start of a scene, in the axes of ``bending``, which has been followed there.

    At a free vertex mass times acceleration is the sum of weight, tension and the forces of the bending moments m,
    three equations a vertex for two moments a vertex and one tension a segment. What the grippers give at both ends
    remains open; of all moments that are in balance those are taken that leave the smallest natural curvature
    :math:`\kappa_0 = \kappa + \beta \dot\kappa - m / EI`, in the mean square along the rope; the damping time
    :math:`\beta` counts because a rope that is bending owes a part of its moments to that. A rope that does not start
    in motion is at rest.

    References:
        Twigg and Kacic-Alesic, *Optimization for sag-free simulations*, 2011; Derouet-Jourdan et al., *Stable
        inverse dynamic curves*, 2010, for rods; the accelerations are added here.
    """
    start, places = scene.start_positions, len(bending.measures)
    still = np.zeros_like(start)
    moving = still if scene.start_velocities is None else scene.start_velocities
    gained = still if scene.start_accelerations is None else scene.start_accelerations
    free = np.setdiff1d(np.arange(len(start)), scene.held)
    by_moments = np.stack([bending.forces(m)[free].ravel() for m in np.eye(2 * places).reshape(-1, places, 2)], axis=1)
    along = np.diff(start, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    segments = np.arange(len(along))
    pull = np.zeros((*start.shape, len(along)))
    pull[segments, :, segments] += along
    pull[segments + 1, :, segments] -= along
    by_tension = float(np.abs(by_moments).max(initial=1e-300)) * pull[free].reshape(-1, len(along))
    pushes = np.stack([gained, *np.broadcast_to(np.eye(3)[:, None], (3, *start.shape))])
    masses = np.stack([scene.body.vertex_measures, scene.loads])
    needed = (masses[:, None, :, None] * pushes)[:, :, free].reshape(8, -1).T
    left, sizes, right = np.linalg.svd(np.concatenate([by_moments, by_tension], axis=1))
    rank = int(np.sum(sizes > _RANK * sizes[0]))
    balanced = right[:rank].T @ ((left[:, :rank].T @ needed) / sizes[:rank, None])
    open_ = right[rank:, : 2 * places].T
    weight = np.sqrt(np.repeat(bending.measures, 2))[:, None]
    ways, extents, _ = np.linalg.svd(weight * open_, full_matrices=False)
    ways = ways[:, extents > _RANK * weight.max()]  # what is left open may be tension alone, as of a held segment
    told = np.stack([bending.curvature.ravel(), bending.rates(moving).ravel(), *balanced[: 2 * places].T], axis=1)
    least = told - (ways @ (ways.T @ (weight * told))) / weight
    return StateBend(_from_columns(least), (ways / weight).reshape(places, 2, -1), bending.measures)
