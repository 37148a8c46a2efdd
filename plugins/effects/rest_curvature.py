"""A bend that a rope keeps where nothing acts on it."""

from typing import ClassVar

import numpy as np

from ...core.arrays import FloatArray
from ...core.effect import Effect, NodalForce
from ...core.material import RopeMaterial
from ...core.parameters import Parameter
from ...core.scene import Scene
from ...core.simulator import State
from .hinges import RopeBending

#: Singular values below this share of the largest one count as zero.
_RANK = 1e-9


class RestCurvature(Effect):
    r"""Natural curvature of a rope that its model takes to be straight, told by how it starts.

    A rope that starts as it was measured has, besides the shape, the acceleration of the measurement. At its free
    vertices mass times acceleration is the sum of weight, tension and the forces of the bending moments m, three
    equations a vertex for two moments a vertex and one tension a segment. What the grippers give at both ends remains
    open; of all moments that are in balance those are taken that leave the smallest natural curvature
    :math:`\kappa_0 = \kappa + \beta \dot\kappa - m / EI`, in the mean square along the rope; the damping time
    :math:`\beta` counts because a rope that is bending as it starts owes a part of its moments to that. The couple
    :math:`EI \kappa_0`, fixed in the material, then acts at every vertex, times ``share``: 1 is exactly in balance.
    The material does not spin about the rope's own axis (:class:`~muslin.plugins.effects.hinges.RopeBending`):
    neither do the grippers.

    References:
        Twigg and Kacic-Alesic, *Optimization for sag-free simulations*, 2011; Derouet-Jourdan et al., *Stable
        inverse dynamic curves*, 2010, for rods; the accelerations are added here.
    """

    name: ClassVar[str] = "rest-curvature"
    acts_on: ClassVar[str] = "force"
    object_kinds: ClassVar[frozenset[str]] = frozenset({"rope"})
    needs_measured_start: ClassVar[bool] = True
    coefficients: ClassVar[tuple[Parameter, ...]] = (
        Parameter("share", "1", 0.0, 1.5, description="of the curvature that is in balance with the start"),
    )
    symptom: ClassVar[str] = "straightens in the model where the real one keeps a bend"

    def bind(self, scene: Scene, masses: FloatArray) -> NodalForce | None:
        if not isinstance(scene.material, RopeMaterial):
            return None
        bending = RopeBending(scene.body, scene.held)
        bending.follow(scene.start_positions)
        natural = natural_curvature(bending, scene, masses, scene.material)
        moments = -self.values["share"] * scene.material.bending_rigidity * natural

        def force(time: float, state: State) -> FloatArray:
            bending.follow(state.positions)
            return bending.forces(moments)

        return force


def natural_curvature(bending: RopeBending, scene: Scene, masses: FloatArray, material: RopeMaterial) -> FloatArray:
    """The smallest ``(V - 2, 2)`` [1/m] that gives the start its acceleration; see :class:`RestCurvature`.

    Args:
        bending: of the rope as it is held, followed to the start.
        scene: where it starts, how it moves and how it is accelerated then; at rest where that is not known.
        masses: of the vertices ``(V,)`` [kg].
        material: whose bending rigidity and damping time count.
    """
    rigidity = material.bending_rigidity
    start, places = scene.start_positions, len(bending.measures)
    free = np.setdiff1d(np.arange(len(start)), scene.held)
    unit = np.eye(2 * places).reshape(-1, places, 2)
    by_moments = np.stack([rigidity * bending.forces(m)[free].ravel() for m in unit], axis=1)
    along = np.diff(start, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    segments = np.arange(len(along))
    pull = np.zeros((*start.shape, len(along)))
    pull[segments, :, segments] += along
    pull[segments + 1, :, segments] -= along
    by_tension = pull[free].reshape(-1, len(along))
    gained = 0.0 if scene.start_accelerations is None else scene.start_accelerations
    needed = (masses[:, None] * (gained - scene.gravity))[free].ravel()
    # moments over rigidity, so curvatures [1/m]; tensions in the size of the weight
    scale = float(masses.sum()) * max(float(np.linalg.norm(scene.gravity)), 1.0)
    whole = np.concatenate([by_moments, scale * by_tension], axis=1)
    left, sizes, right = np.linalg.svd(whole)
    rank = int(np.sum(sizes > _RANK * sizes[0]))
    balanced = right[:rank].T @ ((left[:, :rank].T @ needed) / sizes[:rank])
    one, open_ = balanced[: 2 * places], right[rank:, : 2 * places].T
    weight = np.sqrt(np.repeat(bending.measures, 2))
    moving = np.zeros_like(start) if scene.start_velocities is None else scene.start_velocities
    damped = bending.curvature + material.damping_time * bending.rates(moving)
    curvature = damped.ravel()
    ways, extents, _ = np.linalg.svd(weight[:, None] * open_, full_matrices=False)
    ways = ways[:, extents > _RANK * weight.max()]  # what is left open may be tension alone, as of a held segment
    most = (ways @ (ways.T @ (weight * (curvature - one)))) / weight
    return np.asarray((curvature - one - most).reshape(-1, 2))
