"""The bend that a rope keeps where nothing acts on it, as it follows from a state that it was seen in."""

from dataclasses import dataclass

import numpy as np

from .arrays import FloatArray
from .bending import RopeBending
from .material import RopeMaterial
from .scene import Scene

#: Singular values below this share of the largest one count as zero.
_RANK = 1e-9


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

    def turned(self, axes: FloatArray, into: FloatArray) -> "KeptBend":
        """The same in other cross-section axes: from ``axes (N, 2, 3)`` into ``into (N, 2, 3)``."""
        turn = np.einsum("nax,nbx->nab", axes, into)
        return KeptBend(*(np.einsum("...na,nab->...nb", x, turn) for x in (self.shape, self.rates, self.moments)))

    @staticmethod
    def mean(told: "list[KeptBend]") -> "KeptBend":
        """The mean over several states of one rope."""
        return KeptBend(
            np.mean([t.shape for t in told], axis=0),
            np.mean([t.rates for t in told], axis=0),
            np.mean([t.moments for t in told], axis=0),
        )


def kept_in(scene: Scene, bending: RopeBending) -> KeptBend:
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
    shape, rates, *moments = least.T.reshape(10, places, 2)
    return KeptBend(shape, rates, np.reshape(moments, (2, 4, places, 2)))
