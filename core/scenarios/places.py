"""Places on a flat sheet, and the vertices that carry them."""

import numpy as np

from ..arrays import FloatArray, IntArray
from ..body import Body
from ..errors import InputError

#: A sheet is flat if no vertex is further from its plane than this share of its size.
_FLAT = 1e-6
#: A place further from the sheet than this share of its size is not on it.
_BESIDE = 0.1


def flattened(body: Body, key: str) -> FloatArray:
    """Vertices of a sheet in axes of its own plane ``(V, 2)`` [m], from its first vertex.

    Args:
        body: the sheet.
        key: of ``[scenario]`` that is for flat sheets only, for the message.

    Raises:
        InputError: it is none, or is not flat.
    """
    return np.asarray((body.vertices - body.vertices[0]) @ _plane(body, key)[:2].T)


def marker_points(body: Body, points: FloatArray) -> FloatArray:
    """Weights ``(M, V)`` of markers at ``points (M, 3)`` [m] of a flat sheet, in the frame that it is given in.

    Raises:
        InputError: the body is no flat sheet, or a point is beside it.
    """
    key = "marker_points"
    weights = weights_at(flattened(body, key), body.triangles, (points - body.vertices[0]) @ _plane(body, key)[:2].T)
    away = np.linalg.norm(weights @ body.vertices - points, axis=1)
    size = float(np.ptp(body.vertices, axis=0).max())
    if (away > _BESIDE * size).any():
        worst = int(np.argmax(away))
        low, high = (np.round(edge, 4).tolist() for edge in (body.vertices.min(axis=0), body.vertices.max(axis=0)))
        raise InputError(
            f"[scenario.marker_points]: marker {worst} at {points[worst].tolist()} m is not on the sheet, which lies "
            f"between {low} and {high} m in the frame that it is given in"
        )
    return weights


def weights_at(flat: FloatArray, triangles: IntArray, places: FloatArray) -> FloatArray:
    """Weights ``(M, V)`` of the corners of the triangle that each place is in, or is beside by the least share.

    Args:
        flat: vertices in the plane ``(V, 2)``.
        triangles: ``(F, 3)``.
        places: in the same axes ``(M, 2)``.
    """
    corners = flat[triangles]
    across = np.stack([corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]], axis=2)
    area = np.abs(np.linalg.det(across))
    real = area > 1e-9 * area.max()  # a sliver holds no place
    corners, across, triangles = corners[real], across[real], triangles[real]
    inverse = np.linalg.inv(across)
    weights = np.zeros((len(places), len(flat)))
    for m, place in enumerate(places):
        two = np.einsum("fij,fj->fi", inverse, place - corners[:, 0])
        shares = np.concatenate([1.0 - two.sum(axis=1, keepdims=True), two], axis=1)
        best = int(np.argmax(shares.min(axis=1)))
        inside = np.maximum(shares[best], 0.0)
        weights[m, triangles[best]] = inside / inside.sum()
    return weights


def _plane(body: Body, key: str) -> FloatArray:
    """Two axes of the plane that a sheet lies in at rest, and its normal ``(3, 3)``."""
    if body.kind == "cloth":
        _, sizes, axes = np.linalg.svd(body.vertices - body.vertices.mean(axis=0), full_matrices=False)
        if sizes[2] <= _FLAT * sizes[0]:
            return np.asarray(axes)
    what = "a cloth of another shape" if body.kind == "cloth" else f"a {body.kind}"
    raise InputError(f"[scenario] {key} is for a cloth that is flat at rest, but this is {what}; leave it out")
