"""The bend that a rope keeps where nothing acts on it, as it follows from a state that it was seen in."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .arrays import FloatArray
from .bending import RopeBending, inner_places
from .material import RopeMaterial
from .scene import Scene

#: Singular values below this share of the largest one count as zero.
_RANK = 1e-9
#: What less than this share of the states tell is hardly told.
_HARDLY = 0.03
#: How often states are weighed anew, how near their weights must come to end that, and squares that are none.
_ROUNDS, _NEAR, _NOTHING = 20, 0.01, 1e-12
#: What states are off by is told apart from chance as under Student's distribution of so many degrees of freedom.
_FREEDOM = 3.0


@dataclass(frozen=True, eq=False)
class KeptBend:
    r"""Natural curvature of a rope of any stiffness, mass and damping under any gravity.

    It is linear in what it is made of, so it is told once for all draws of a study. Where a rope is b times as stiff
    as in the mean, it is :math:`b \kappa` that moments over EI are in balance with. So what is told by how it is bent
    is told by place, K of them, which count by their b; and of all that the bend is one b-th of where it is.

    Args:
        shapes: what a rope keeps if it carries nothing ``(K, N, 2)`` [1/m].
        rates: what the damping of a bend that changes adds to that, per damping time ``(K, N, 2)`` [1/(m s)].
        moments: that what it carries bends it by ``(2, 4, N, 2)``: the rope's own mass, at 1 kg/m,
            and the loads; first for their acceleration [N m], then for a gravity of -1 m/s2 along x, y and z each.
        torsion: that its twist bends it by, at a twist rigidity of 1 N m2 ``(N, 2)`` [N m].
        told_at: where the K places are, as shares of the length ``(K,)``.
        along: where the N curvatures are ``(N,)``.
    """

    shapes: FloatArray
    rates: FloatArray
    moments: FloatArray
    torsion: FloatArray
    told_at: FloatArray
    along: FloatArray

    def curvature(self, material: RopeMaterial, gravity: FloatArray) -> FloatArray:
        """The natural curvature ``(N, 2)`` [1/m]; ``gravity (3,)`` [m/s2]."""
        carried = np.tensordot([material.linear_density, 1.0], self.moments, 1)
        moments = carried[0] - np.tensordot(gravity, carried[1:], 1) + material.twist_rigidity * self.torsion
        bent = np.tensordot(material.bending_shares(self.told_at), self.shapes + material.damping_time * self.rates, 1)
        stiff = material.bending_shares(self.along)
        return np.asarray((bent - moments / material.bending_rigidity) / stiff[:, None])


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
        shapes, rates, moments, torsion = (np.einsum("...na,nab->...nb", x, turn) for x in _parts(old))
        least = KeptBend(shapes, rates, moments, torsion, old.told_at, old.along)
        return StateBend(least, np.einsum("naw,nab->nbw", self.ways, turn), self.measures)


def common_bend(states: Sequence[StateBend], gravity: FloatArray) -> KeptBend:
    r"""The one bend that all ``states`` of a rope tell together, in axes that are the same in all.

    Each tells it but for its ways, which are other ones where the rope lies otherwise, so together they tell more
    than any one does; the mean of the smallest bends falls short by what each leaves open. What hardly any state tells,
    as an even bend between two clamps, stays as small as it may be: the states' errors would fill it otherwise.

    States do not tell it equally well: where a rope whips, or markers went wrong, they are far from the others. So a
    state that is r off counts by :math:`1 / (r^2 + 3\, \text{median } r^2)`, much as under Student's distribution of
    three degrees of freedom, by the damping time, mass and twisting over bending stiffness that leave least in a rope
    that is as stiff everywhere.

    Args:
        states: that the rope was seen in.
        gravity: under which it was ``(3,)`` [m/s2].
    """
    measures = states[0].measures
    weight = np.sqrt(np.repeat(measures, 2))[:, None]
    ways = (weight * s.ways.reshape(len(weight), -1) for s in states)
    seen = np.stack([np.eye(len(weight)) - w @ w.T for w in ways])
    even = np.stack([_even(weight * _columns(s.least)) for s in states])
    counts: FloatArray = np.ones(len(states))
    for _ in range(_ROUNDS):
        share = counts / counts.sum()
        common = _together(seen, np.tensordot(share, even, 1), share)
        squares = _squares(seen @ (even - common), share, gravity)
        before, counts = counts, 1.0 / np.maximum(squares + _FREEDOM * np.median(squares), _NOTHING)
        if np.allclose(counts, before, rtol=_NEAR):
            break
    told = np.zeros_like(_columns(states[0].least))
    for part, state in zip(share, states, strict=True):  # not all at once: they are many numbers
        told += part * weight * _columns(state.least)
    return _from_columns(_together(seen, told, share) / weight, states[0].least.along)


def _together(seen: FloatArray, told: FloatArray, share: FloatArray) -> FloatArray:
    """What states that count by their ``share (S,)`` tell ``(2 N, C)``, of the mean of what each tells."""
    least = np.tensordot(share, seen, 1) + _HARDLY * np.eye(seen.shape[1])
    return np.asarray(np.linalg.solve(least, (1.0 + _HARDLY) * told), np.float64)


def _even(columns: FloatArray) -> FloatArray:
    """All that the bend of a rope is made of that is as stiff everywhere ``(2 N, 11)``."""
    count = len(columns) // 2
    by_place = (columns[:, :count], columns[:, count : 2 * count])
    return np.concatenate([*(x.sum(axis=1, keepdims=True) for x in by_place), columns[:, 2 * count :]], axis=1)


def _squares(off: FloatArray, share: FloatArray, gravity: FloatArray) -> FloatArray:
    """By how much states are off ``(S,)``, of what they are off by in all that a bend is made of ``(S, N, 11)``.

    Damping time, mass and twisting over bending stiffness are those that leave least where states count by their
    ``share (S,)``.
    """
    pushes = np.concatenate([[1.0], -gravity])
    shape, rates, torsion = off[..., 0], off[..., 1], off[..., 10]
    carried = off[..., 2:10].reshape(*off.shape[:2], 2, 4) @ pushes
    made = np.concatenate([rates[..., None], -carried, -torsion[..., None]], axis=2)
    root = np.sqrt(share)[:, None]
    columns, wanted = (root[..., None] * made).reshape(-1, 4), -(root * shape).ravel()
    sizes, kept = np.full(4, -1.0), np.ones(4, np.bool_)
    while (sizes < 0.0).any():  # none of them can be negative
        sizes = np.zeros(4)
        sizes[kept] = np.linalg.lstsq(columns[:, kept], wanted, rcond=None)[0]
        kept &= sizes > 0.0
    return np.asarray(np.sum((shape + made @ sizes) ** 2, axis=1))


def _parts(bend: KeptBend) -> tuple[FloatArray, ...]:
    return bend.shapes, bend.rates, bend.moments, bend.torsion


def _columns(bend: KeptBend) -> FloatArray:
    """All that it is made of ``(2 N, 2 N + 9)``."""
    return np.concatenate([x.reshape(-1, bend.torsion.size) for x in _parts(bend)]).T


def _from_columns(columns: FloatArray, along: FloatArray) -> KeptBend:
    count = len(along)
    parts = columns.T.reshape(-1, count, 2)
    shapes, rates, moments, torsion = np.split(parts, [count, 2 * count, 2 * count + 8])
    return KeptBend(shapes, rates, moments.reshape(2, 4, count, 2), torsion[0], along, along)


def kept_in(scene: Scene, bending: RopeBending, twist: FloatArray | None = None) -> StateBend:
    r"""What follows from the start of a scene, in the axes of ``bending``, which has been followed there.

    At a free vertex mass times acceleration is the sum of weight, tension and the forces of twist and of the bending
    moments m: three equations a vertex for two moments a vertex and one tension a segment. What the grippers give at
    both ends remains open; of all moments that are in balance those are taken that leave the smallest natural curvature
    :math:`\kappa_0 = \kappa + \beta \dot\kappa - m / EI`, in the mean square along the rope; the damping time
    :math:`\beta` counts because a rope that is bending owes a part of its moments to that. A rope that does not start
    in motion is at rest.

    Args:
        scene: whose start it is.
        bending: of its rope.
        twist: rate at which the material is twisted at the inner vertices ``(N,)`` [rad/m]; None: it is not.

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
    twisting = still if twist is None else torsion_forces(start, twist)
    needed = np.concatenate([needed, -twisting[free].reshape(-1, 1)], axis=1)
    left, sizes, right = np.linalg.svd(np.concatenate([by_moments, by_tension], axis=1))
    rank = int(np.sum(sizes > _RANK * sizes[0]))
    balanced = right[:rank].T @ ((left[:, :rank].T @ needed) / sizes[:rank, None])
    open_ = right[rank:, : 2 * places].T
    weight = np.sqrt(np.repeat(bending.measures, 2))[:, None]
    ways, extents, _ = np.linalg.svd(weight * open_, full_matrices=False)
    ways = ways[:, extents > _RANK * weight.max()]  # what is left open may be tension alone, as of a held segment
    by_place = (_by_place(bending.curvature), _by_place(bending.rates(moving)))
    told = np.concatenate([*by_place, balanced[: 2 * places]], axis=1)
    least = told - (ways @ (ways.T @ (weight * told))) / weight
    kept = _from_columns(least, inner_places(scene.body))
    return StateBend(kept, (ways / weight).reshape(places, 2, -1), bending.measures)


def _by_place(curvature: FloatArray) -> FloatArray:
    """``(N, 2)`` as columns of one place each ``(2 N, N)``."""
    return np.asarray((curvature[:, :, None] * np.eye(len(curvature))[:, None]).reshape(-1, len(curvature)))


def torsion_forces(vertices: FloatArray, torques: FloatArray) -> FloatArray:
    r"""Nodal forces ``(V, 3)`` [N] of a twisted rope, of which the material frames do not turn.

    Where a rope that is bent moves out of its plane, axes that are carried along it turn: by the gradients of the
    holonomy of Bergou et al., *Discrete elastic rods*, 2008, :math:`\kappa b / 2 |e|`.

    Args:
        vertices: in order ``(V, 3)`` [m].
        torques: about the rope at its inner vertices ``(V - 2,)`` [N m]; positive where the material turns to the left
            as one goes along.
    """
    segments = np.diff(vertices, axis=0)
    lengths = np.linalg.norm(segments, axis=1)
    along = segments / lengths[:, None]
    before, behind = along[:-1], along[1:]
    bend = 2.0 * np.cross(before, behind) / (1.0 + np.sum(before * behind, axis=1))[:, None]
    first, last = (torques[:, None] * bend / (2.0 * x[:, None]) for x in (lengths[:-1], lengths[1:]))
    out = np.zeros_like(vertices)
    out[:-2] += first
    out[2:] -= last
    out[1:-1] += last - first
    return out
