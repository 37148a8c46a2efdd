"""Spots of an object that a detector looks for: the same on a mesh of any size."""

import numpy as np

from .arrays import FloatArray
from .body import Body
from .errors import InputError


def keypoint_weights(body: Body, count: int) -> FloatArray:
    """Weights ``(K, V)`` of the vertices: keypoints are ``weights @ vertices``.

    Along a rope they are evenly spaced, both ends among them. On a cloth with a grid they are its corners, then the
    middles of its edges. On any other mesh they are the vertices that lie farthest from each other at rest.

    Args:
        body: the mesh.
        count: K; of a cloth with a grid 8 at most.

    Raises:
        InputError: more are asked for than the object has.

    References:
        Gonzalez, *Clustering to minimize the maximum intercluster distance*, 1985: farthest-point sampling.
    """
    vertices = len(body.vertices)
    if count < 1 or (body.kind != "rope" and count > vertices):
        raise InputError(f"an object of {vertices} vertices has 1 to {vertices} keypoints, not {count}")
    if body.kind == "rope":
        place = np.linspace(0.0, vertices - 1.0, count)
        left = np.minimum(place.astype(int), vertices - 2)
        weights = np.zeros((count, vertices))
        weights[np.arange(count), left] = 1.0 - (place - left)
        weights[np.arange(count), left + 1] += place - left
        return weights
    if body.kind == "cloth" and body.grid is not None:
        rows, columns = body.grid
        r, c = rows - 1, columns - 1
        spots = [(0, 0), (0, c), (r, 0), (r, c), (0, c // 2), (r, c // 2), (r // 2, 0), (r // 2, c)]
        if count > len(spots):
            raise InputError(f"a cloth has {len(spots)} keypoints at most, corners and middles of edges, not {count}")
        return np.eye(rows * columns)[[a * columns + b for a, b in spots[:count]]]
    return np.eye(vertices)[_farthest(body.vertices, count)]


def _farthest(points: FloatArray, count: int) -> list[int]:
    """Numbers of ``points (N, 3)`` that lie far from each other, the first farthest from the middle."""
    chosen = [int(np.argmax(np.linalg.norm(points - points.mean(axis=0), axis=1)))]
    apart = np.linalg.norm(points - points[chosen[0]], axis=1)
    while len(chosen) < count:
        chosen.append(int(np.argmax(apart)))
        apart = np.minimum(apart, np.linalg.norm(points - points[chosen[-1]], axis=1))
    return chosen
