"""Whether the state of a rollout can be true. Engines mostly blow up without saying so."""

import numpy as np

from .arrays import FloatArray
from .errors import RolloutFailed
from .obstacles import Obstacle, StaticMesh
from .scene import Scene

#: An edge longer than this times its rest length means that the rollout blew up.
LARGEST_STRETCH = 3.0
#: A vertex that was faster than this between two looks, beyond what it may have fallen, means the same [m/s].
LARGEST_SPEED = 50.0
#: A point deeper than this in an obstacle has tunnelled [m]; in thin ones, half way to the middle.
LARGEST_DEPTH = 0.02


class SanityCheck:
    """Call it with the positions now and then.

    Vertices and the middles of elements must stay out of obstacles, but for those next to held vertices: a
    gripper may be told to press the object into the table.

    Args:
        scene: that is simulated.
    """

    def __init__(self, scene: Scene) -> None:
        body = scene.body
        self._ends = 3 * body.edges.T[:, None, :] + np.arange(3)[:, None]  # (2, 3, N)
        self._per_longest = (LARGEST_STRETCH * body.edge_lengths(body.vertices)) ** -2
        self._tetrahedra = body.elements if body.kind == "solid" else None
        self._gravity = float(np.linalg.norm(scene.gravity))
        self._start: float | None = None
        self._before: tuple[float, FloatArray] | None = None
        grasped = np.isin(body.elements, scene.held).any(axis=1)
        self._elements = body.elements[~grasped]
        self._vertices = np.setdiff1d(np.arange(len(body.vertices)), body.elements[grasped])
        self._obstacles = [(o, min(LARGEST_DEPTH, o.depth / 2)) for o in scene.obstacles if len(self._vertices)]

    def __call__(self, positions: FloatArray, time: float) -> None:
        """Look at ``positions (V, 3)`` [m] at ``time`` [s], later than the last time.

        Raises:
            RolloutFailed: a position is not finite, an edge is longer than :data:`LARGEST_STRETCH`, a vertex was
                faster than :data:`LARGEST_SPEED`, an element of a solid is turned inside out, or a part of the
                object is deeper than :data:`LARGEST_DEPTH` inside an obstacle.
        """
        start, end = positions.ravel().take(self._ends)
        end -= start
        stretch = float((np.einsum("xn,xn->n", end, end) * self._per_longest).max())
        if not np.isfinite(stretch + positions.sum()):
            raise RolloutFailed(f"positions are not finite at {time:.3f} s")
        if stretch > 1.0:
            raise RolloutFailed(f"an edge is stretched {LARGEST_STRETCH * np.sqrt(stretch):.1f} times at {time:.3f} s")
        self._look_at_speed(positions, time)
        if self._tetrahedra is not None:
            corners = positions[self._tetrahedra]
            if np.linalg.det(corners[:, 1:] - corners[:, :1]).min() < 0.0:
                raise RolloutFailed(f"an element is turned inside out at {time:.3f} s")
        if self._obstacles:
            points = np.concatenate([positions[self._vertices], positions[self._elements].mean(axis=1)])
            for obstacle, limit in self._obstacles:
                depth = _depth(obstacle, points)
                if depth > limit:
                    what = type(obstacle).__name__.lower()
                    raise RolloutFailed(f"the object is {1000 * depth:.0f} mm inside the {what} at {time:.3f} s")

    def _look_at_speed(self, positions: FloatArray, time: float) -> None:
        if self._before is None or self._start is None:
            self._start = time
        elif time > self._before[0]:
            moved = positions - self._before[1]
            fastest = float(np.sqrt(np.einsum("vx,vx->v", moved, moved).max())) / (time - self._before[0])
            if fastest > LARGEST_SPEED + self._gravity * (time - self._start):
                raise RolloutFailed(f"a vertex moves at {fastest:.0f} m/s at {time:.3f} s")
        self._before = (time, positions.copy())


def _depth(obstacle: Obstacle, points: FloatArray) -> float:
    """How deep the deepest of ``points (P, 3)`` is inside [m]; zero or less if all are outside."""
    if isinstance(obstacle, StaticMesh):  # slow to ask; most points are not even in its box
        low, high = obstacle.bounds
        points = points[((points > low) & (points < high)).all(axis=1)]
    return -float(obstacle.signed_distance(points)[0].min()) if len(points) else 0.0
