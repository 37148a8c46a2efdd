"""The start of a flat sheet that was seen bent."""

from dataclasses import dataclass

import numpy as np

from ..arrays import FloatArray, IntArray
from ..body import Body
from ..motion import inverse, rotate
from ..obstacles import Obstacle
from ..subsets import outermost

#: Markers that a bend is told by in full; of more, noise is averaged.
_CENTRES = 49


@dataclass(frozen=True, eq=False)
class BentSheet:
    """A sheet that is bent as smoothly as goes with what was seen of it, carried by the first gripper.

    What it is moved by is a thin-plate spline over it (Duchon, *Splines minimizing rotation-invariant semi-norms in
    Sobolev spaces*, 1977), so it starts alike on any mesh; beyond what was seen it goes on nearly straight. Made by
    :meth:`through`.

    Args:
        axes: along the flat sheet ``(2, 3)``, here and below in the frame of the first gripper at its first pose.
        middle: of what was seen, on the flat sheet ``(3,)`` [m].
        centres: of the spline, along the axes from the middle ``(C, 2)`` [m].
        pull: coefficients of the spline, of one and of both axes ``(C + 3, 3)``.
        area: of the sheet [m2]; if it is scaled, so is the shape.
        about: the point that scaling leaves where it is ``(3,)`` [m].
    """

    axes: FloatArray
    middle: FloatArray
    centres: FloatArray
    pull: FloatArray
    area: float
    about: FloatArray

    @classmethod
    def through(cls, flat: FloatArray, seen: FloatArray, area: float, about: FloatArray) -> "BentSheet":
        """The sheet on which places ``flat (M, 3)`` [m] are where they were ``seen (M, 3)``; of many nearly."""
        middle = flat.mean(axis=0)
        axes = np.linalg.svd(flat - middle, full_matrices=False)[2][:2]
        places = (flat - middle) @ axes.T
        centres = places[outermost(places, _CENTRES)]
        straight = np.pad(centres, ((0, 0), (1, 0)), constant_values=1.0)  # what the spline leaves to these
        free = np.linalg.svd(straight.T)[2][np.linalg.matrix_rank(straight) :].T
        basis = _spline(places, centres)
        basis = np.hstack([basis[:, : len(centres)] @ free, basis[:, len(centres) :]])
        found = np.linalg.lstsq(basis, seen - flat, rcond=None)[0]
        pull = np.vstack([free @ found[: free.shape[1]], found[free.shape[1] :]])
        return cls(axes, middle, centres, pull, area, about)

    def __call__(
        self,
        body: Body,
        poses: FloatArray,
        grasps: tuple[IntArray, ...],
        obstacles: tuple[Obstacle, ...],
        clearance: float,
    ) -> FloatArray:
        scale = float(np.sqrt(body.measures.sum() / self.area))
        local = self.about + (rotate(inverse(poses[0, 3:]), body.vertices - poses[0, :3]) - self.about) / scale
        bent = local + _spline((local - self.middle) @ self.axes.T, self.centres) @ self.pull
        return np.asarray(rotate(poses[0, 3:], self.about + scale * (bent - self.about)) + poses[0, :3])


def _spline(places: FloatArray, centres: FloatArray) -> FloatArray:
    """r^2 log r from each of ``(M, 2)``, one, and both coordinates, at ``(N, 2)``: ``(N, M + 3)``."""
    square = np.sum((places[:, None] - centres[None]) ** 2, axis=2)
    return np.hstack([0.5 * square * np.log(np.maximum(square, 1e-300)), np.ones((len(places), 1)), places])
