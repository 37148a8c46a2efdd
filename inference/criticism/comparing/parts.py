"""Parts of an object, from its rest shape alone: corners, edge, ends, middle, near to and far from the grasp."""

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import dijkstra

from ....core.arrays import FloatArray, IntArray
from ....core.body import Body
from ....core.scenario import Scenario

#: Parts of the surface or length, and thirds of the way from the grasp; labels are indices into these.
PLACES = ("free corners", "held corners", "free edge", "held edge", "middle", "ends", "faces", "inside")
DISTANCES = ("near the grasp", "halfway from the grasp", "far from the grasp")
FREE_CORNER, HELD_CORNER, FREE_EDGE, HELD_EDGE, MIDDLE, ENDS, FACES, INSIDE = range(len(PLACES))
#: What is nearer to the edge, a corner or an end than this share of the object's size belongs to it.
_MARGIN = 0.12
#: A boundary turns by more than this at a corner, and a solid's surface at an edge [rad].
_SHARP = 0.7


def distances(scenario: Scenario) -> FloatArray | None:
    """How far every vertex is from what is held, along the object ``(V,)`` [m]; infinite where no way leads.

    None if nothing is held, or everything.
    """
    held = np.concatenate([*scenario.grasps, np.zeros(0, np.int64)]).astype(np.int64)
    if not len(held):
        return None
    along = _along(scenario.body, held)
    return along if along[np.isfinite(along)].max() > 0 else None


def distance_labels(scenario: Scenario) -> IntArray | None:
    """Index into :data:`DISTANCES` of every vertex ``(V,)``, by thirds of the largest distance; or None."""
    along = distances(scenario)
    if along is None:
        return None
    farthest = max(float(along[np.isfinite(along)].max(initial=0.0)), 1e-12)
    return np.where(np.isfinite(along), np.minimum(3 * along / farthest, 2.999), 2).astype(np.int64)


def place_labels(scenario: Scenario) -> IntArray | None:
    """Index into :data:`PLACES` of every vertex ``(V,)``; None if the object has one part only."""
    body = scenario.body
    labels = _rope(body) if body.kind == "rope" else _sheet(body) if body.kind == "cloth" else _solid(body)
    distance = distance_labels(scenario)
    if distance is not None:
        held = distance == 0
        labels = np.where(held & (labels == FREE_CORNER), HELD_CORNER, labels)
        labels = np.where(held & (labels == FREE_EDGE), HELD_EDGE, labels)
    return np.asarray(labels) if len(np.unique(labels)) > 1 else None


def _along(body: Body, sources: IntArray) -> FloatArray:
    """Distance ``(V,)`` [m] along the edges of the mesh from the nearest of the vertices ``sources``."""
    count, ends = len(body.vertices), body.edges
    lengths = np.linalg.norm(body.vertices[ends[:, 0]] - body.vertices[ends[:, 1]], axis=1)
    graph = sparse.csr_array((lengths, (ends[:, 0], ends[:, 1])), shape=(count, count))
    return np.asarray(dijkstra(graph, directed=False, indices=sources, min_only=True))


def _rope(body: Body) -> IntArray:
    along = np.concatenate([[0.0], np.cumsum(body.measures)])
    near = np.minimum(along, along[-1] - along) <= _MARGIN * along[-1]
    return np.where(near, ENDS, MIDDLE)


def _sheet(body: Body) -> IntArray:
    """Edges that belong to one triangle are the boundary; a corner is where it turns sharply."""
    unique, uses = np.unique(_edges_of(body.triangles), axis=0, return_counts=True)
    boundary = unique[uses == 1]
    around = {v: boundary[(boundary == v).any(axis=1)].sum(axis=1) - v for v in np.unique(boundary).tolist()}
    p = body.vertices
    corners = [v for v, n in around.items() if len(n) == 2 and _turn(p[n[0]], p[v], p[n[1]]) > _SHARP]
    return _nested(body, np.array(corners, np.int64), np.unique(boundary), float(np.sqrt(body.measures.sum())), MIDDLE)


def _solid(body: Body) -> IntArray:
    """Edges are where the surface turns sharply, corners where three of them meet."""
    triangles = body.triangles
    p = body.vertices[triangles]
    normal = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    edges = _edges_of(triangles)
    order = np.lexsort(edges.T)
    pairs, sides = edges[order][::2], (order % len(triangles)).reshape(-1, 2)
    sharp = pairs[np.sum(normal[sides[:, 0]] * normal[sides[:, 1]], axis=1) < np.cos(_SHARP)]
    ends, uses = np.unique(sharp, return_counts=True)
    size = float(body.measures.sum() ** (1 / 3))
    labels = _nested(body, ends[uses >= 3], ends, size, FACES)
    surface = np.unique(triangles)
    outside = np.zeros(len(body.vertices), bool)
    outside[surface] = True
    return np.where((labels == FACES) & ~outside, INSIDE, labels)


def _edges_of(triangles: IntArray) -> IntArray:
    """Sorted edges ``(3 F, 2)``: all first ones of the triangles, then all second ones, then all third ones."""
    return np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)


def _turn(before: FloatArray, here: FloatArray, after: FloatArray) -> float:
    one, two = here - before, after - here
    cosine = one @ two / (np.linalg.norm(one) * np.linalg.norm(two))
    return float(np.arccos(np.clip(cosine, -1.0, 1.0)))


def _nested(body: Body, corners: IntArray, edge: IntArray, size: float, rest: int) -> IntArray:
    labels = np.full(len(body.vertices), rest)
    if len(edge):
        labels[_along(body, edge) <= _MARGIN * size] = FREE_EDGE
    if len(corners):
        labels[_along(body, corners) <= _MARGIN * size] = FREE_CORNER
    return labels
