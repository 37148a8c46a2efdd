"""Which vertices the grippers of built-in scenarios hold."""

import numpy as np

from ..arrays import FloatArray, IntArray
from ..body import Body
from ..errors import InputError

#: What says where a mesh is held, for messages.
ASK = "say where it is held: [scenario] grasp_points = [[x, y, z]] (a point a gripper), or grasps = [[vertex]]"


def top_corners(body: Body) -> tuple[IntArray, ...]:
    """One gripper that holds the two corners of row 0, as a bar would; of a rope its first vertex."""
    if body.kind == "rope":
        return (np.array([0]),)
    return (np.array([0, _columns(body) - 1]),)


def top_edge(body: Body) -> tuple[IntArray, ...]:
    """One gripper that holds all of row 0; of a rope its first vertex."""
    return top_corners(body) if body.kind == "rope" else (np.arange(_columns(body)),)


def middle_of_edge(body: Body) -> tuple[IntArray, ...]:
    """One gripper, a hand, on the middle third of row 0."""
    columns = _columns(body)
    return (np.arange(columns // 3, columns - columns // 3),)


def clamped_start(body: Body) -> tuple[IntArray, ...]:
    """One gripper on the first two vertices of a rope, which fix its direction too."""
    return (np.array([0, 1]),)


def clamped_ends(body: Body) -> tuple[IntArray, ...]:
    """A gripper on the first two and one on the last two vertices of a rope.

    Two vertices fix the direction of the rope as well as its place, so that it leaves a gripper as a clamped
    cable does and turns with it. One vertex a gripper (``grasps = [[0], [N]]``) pins the ends like a hinge.
    """
    last = len(body.vertices) - 1
    if last < 4:
        raise InputError(f"a rope that is clamped at both ends needs at least 5 vertices, but has {last + 1}")
    return (np.array([0, 1]), np.array([last - 1, last]))


def low_y_face(body: Body) -> tuple[IntArray, ...]:
    """A clamp around the face of smallest y."""
    return (np.flatnonzero(body.vertices[:, 1] < body.vertices[:, 1].min() + 1e-9),)


def high_y_face(body: Body) -> IntArray:
    """The face of largest y."""
    return np.flatnonzero(body.vertices[:, 1] > body.vertices[:, 1].max() - 1e-9)


def nothing_held(body: Body) -> tuple[IntArray, ...]:
    """A body that nobody holds."""
    return ()


def grasps_at(body: Body, points: list[FloatArray], radius: float) -> tuple[IntArray, ...]:
    """The vertices at given points, for every gripper.

    Args:
        body: in the frame of the points.
        points: of every gripper ``(n, 3)`` [m].
        radius: a gripper holds the vertex nearest to each of its points and all within this [m].

    Raises:
        InputError: no vertex is near a point.
    """
    reach = max(radius, float(body.edge_lengths(body.vertices).max()))
    out = []
    for g, its in enumerate(points):
        apart = np.linalg.norm(body.vertices[None] - its[:, None], axis=2)
        far = apart.min(axis=1)
        if (far > reach).any():
            k = int(np.argmax(far))
            low, high = body.vertices.min(axis=0), body.vertices.max(axis=0)
            raise InputError(
                f"[scenario.grasp_points]: the point {its[k].tolist()} of gripper {g} is {far[k]:.3g} m from the "
                f"nearest vertex; the object lies between {np.round(low, 4).tolist()} and "
                f"{np.round(high, 4).tolist()} m in the frame of the points"
            )
        chosen = (apart <= radius).any(axis=0)
        chosen[np.argmin(apart, axis=1)] = True
        out.append(np.flatnonzero(chosen))
    return tuple(out)


def _columns(body: Body) -> int:
    if body.kind != "cloth" or body.grid is None:
        raise InputError(f"this scenario holds a regular cloth by an edge, but this is another object; {ASK}")
    return body.grid[1]
