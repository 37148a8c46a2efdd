"""Whether the state of a rollout can be true. Engines mostly blow up without saying so."""

import numpy as np

from .arrays import FloatArray
from .errors import RolloutFailed
from .scene import Scene

#: An edge longer than this times its rest length means that the rollout blew up.
LARGEST_STRETCH = 3.0
#: A point deeper than this in an obstacle has tunnelled [m]; in thin ones, half way to the middle.
LARGEST_DEPTH = 0.02


class SanityCheck:
    """Call it with positions now and then.

    Vertices and the middles of elements must stay out of obstacles, but for those next to held vertices: a
    gripper may be told to press the object into the table.

    Args:
        scene: that is simulated.
    """

    def __init__(self, scene: Scene) -> None:
        self._body = scene.body
        self._rest = scene.body.edge_lengths(scene.body.vertices)
        grasped = np.isin(scene.body.elements, scene.held).any(axis=1)
        self._elements = scene.body.elements[~grasped]
        self._vertices = np.setdiff1d(np.arange(len(scene.body.vertices)), scene.body.elements[grasped])
        self._obstacles = [(o, min(LARGEST_DEPTH, o.depth / 2)) for o in scene.obstacles]

    def __call__(self, positions: FloatArray, time: float) -> None:
        """Look at ``positions (V, 3)`` [m] at ``time`` [s].

        Raises:
            RolloutFailed: a position is not finite, an edge is stretched beyond :data:`LARGEST_STRETCH`, or a
                part of the object is deeper than :data:`LARGEST_DEPTH` inside an obstacle.
        """
        worst = float(np.max(self._body.edge_lengths(positions) / self._rest))
        if not np.isfinite(worst):
            raise RolloutFailed(f"positions are not finite at {time:.3f} s")
        if worst > LARGEST_STRETCH:
            raise RolloutFailed(f"an edge is stretched {worst:.1f} times at {time:.3f} s")
        if not self._obstacles:
            return
        points = np.concatenate([positions[self._vertices], positions[self._elements].mean(axis=1)])
        if not len(points):
            return
        for obstacle, limit in self._obstacles:
            depth = -float(obstacle.signed_distance(points)[0].min())
            if depth > limit:
                what = type(obstacle).__name__.lower()
                raise RolloutFailed(f"the object is {1000 * depth:.0f} mm inside the {what} at {time:.3f} s")
