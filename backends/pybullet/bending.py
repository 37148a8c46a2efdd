"""Bending of a sheet that is flat at rest: a constant matrix, force = -D Q x."""

import numpy as np

from ...core.arrays import BoolArray, FloatArray, IntArray
from ...core.body import Body

#: Share of the energy taken triangle by triangle instead of averaged over the triangles around a vertex.
_UNAVERAGED = 0.1


def bending_matrix(body: Body, held: IntArray) -> FloatArray:
    r"""The matrix ``Q (V, V)`` [1/m2] with bending energy :math:`D/2 \sum_{axis} x^T Q x`.

    Each triangle has a shape operator made of its three hinges: :math:`S = \sum_i k_i t_i t_i^T / 2A`,
    where :math:`t_i` is normal to edge i in the plane and :math:`k_i` is, in the linear hinge of Wardetzky et
    al., edge length times bending angle (as a vector). At a free edge the curvature across it costs nothing.
    One regular grid in this form alone is 1.5 times too stiff along diagonals and 2 times in twist, since the
    hinges alias; averaging S over the triangles of a vertex takes that away, and a small unaveraged share keeps
    the shortest wrinkles stiff. The energy density is :math:`D/2 (k_1^2 + k_2^2)`: a sheet bent to a
    cylinder of curvature k stores :math:`D k^2 / 2` per area in any direction, wide strip or narrow.

    Triangles of which all corners are held are rigid. The sheet beside them is clamped at the very edge: a hinge
    there turns one triangle only, by its whole angle instead of half, and all its energy is in that triangle.
    Without this a cantilever would be clamped half a cell too deep, which on 8 cells is 20 % of sag.

    Args:
        body: flat at rest; Q measures curvature, not change of curvature.
        held: indices ``(H,)`` of the held vertices.

    References:
        Grinspun, Gingold, Reisman and Zorin, *Computing discrete shape operators on general meshes*, 2006;
        Wardetzky, Bergou, Harmon, Zorin and Grinspun, *Discrete quadratic curvature energies*, 2007.
    """
    rigid: BoolArray = np.all(np.isin(body.elements, held), axis=1)
    shape = _shape_operators(body, rigid)
    area = np.where(rigid, 0.0, body.measures)
    share = np.zeros((len(body.vertices), len(area)))
    for corner in range(3):
        share[body.elements[:, corner], np.arange(len(area))] = area / 3.0
    around = share.sum(axis=1)
    weight = np.divide(1.0, around, out=np.zeros_like(around), where=around > 0)
    averaged = np.sqrt((1 - _UNAVERAGED) * weight)[:, None] * share
    matrix = np.zeros((len(body.vertices),) * 2)
    for part in shape:
        smooth, rough = averaged @ part, np.sqrt(_UNAVERAGED * area)[:, None] * part
        matrix += smooth.T @ smooth + rough.T @ rough
    return matrix


def is_flat(body: Body) -> bool:
    """Whether all vertices lie in one plane, to a millionth of the size."""
    centred = body.vertices - body.vertices.mean(axis=0)
    extents = np.linalg.svd(centred, compute_uv=False)
    return bool(extents[2] <= 1e-6 * extents[0])


def _shape_operators(body: Body, rigid: BoolArray) -> FloatArray:
    """Rows ``(3, E, V)`` [1/m2] that give xx, zz and sqrt(2) xz of each triangle's curvature from positions."""
    hinges, stencils, sides = _hinges(body)
    stencils = stencils * np.where(rigid[sides].any(axis=1), 2.0, 1.0)[:, None]
    row = {tuple(sorted(h[:2])): k for k, h in enumerate(hinges.tolist())}
    points, along, across = body.vertices, *_plane(body)
    out = np.zeros((3, len(body.elements), len(body.vertices)))
    for e, (triangle, area) in enumerate(zip(body.elements.tolist(), body.measures, strict=True)):
        free = []
        for i in range(3):
            a, b = triangle[i], triangle[(i + 1) % 3]
            edge = points[b] - points[a]
            tx, ty = -(edge @ across), edge @ along
            normal = np.array([tx * tx, ty * ty, np.sqrt(2.0) * tx * ty]) / (edge @ edge)
            k = row.get((min(a, b), max(a, b)))
            if k is None:
                free.append(normal)
            else:
                out[:, e, hinges[k]] += np.outer(normal, stencils[k] / (2.0 * area))
        if free:
            basis = np.linalg.qr(np.array(free).T)[0]
            out[:, e] -= basis @ (basis.T @ out[:, e])
    return out


def _plane(body: Body) -> tuple[FloatArray, FloatArray]:
    """Two orthonormal vectors ``(3,)`` in the plane of the sheet."""
    a, b, c = body.vertices[body.elements[0]]
    along = (b - a) / np.linalg.norm(b - a)
    across = (c - a) - ((c - a) @ along) * along
    return along, across / np.linalg.norm(across)


def _hinges(body: Body) -> tuple[IntArray, FloatArray, IntArray]:
    """Interior edges with their two opposite vertices ``(N, 4)``, stencils ``(N, 4)`` [1], triangles ``(N, 2)``."""
    beside: dict[tuple[int, int], list[tuple[int, int]]] = {}
    for e, triangle in enumerate(body.elements.tolist()):
        for i in range(3):
            a, b, c = triangle[i], triangle[(i + 1) % 3], triangle[(i + 2) % 3]
            beside.setdefault((min(a, b), max(a, b)), []).append((c, e))
    inside = [(edge, pair) for edge, pair in beside.items() if len(pair) == 2]
    hinges = np.array([[*edge, p[0], q[0]] for edge, (p, q) in inside], dtype=np.int64).reshape(-1, 4)
    sides = np.array([[p[1], q[1]] for _, (p, q) in inside], dtype=np.int64).reshape(-1, 2)
    a, b, c, d = (body.vertices[hinges[:, i]] for i in range(4))
    ac, ad = _cotangent(b - a, c - a), _cotangent(b - a, d - a)
    bc, bd = _cotangent(a - b, c - b), _cotangent(a - b, d - b)
    return hinges, np.stack([bc + bd, ac + ad, -ac - bc, -ad - bd], axis=1), sides


def _cotangent(u: FloatArray, v: FloatArray) -> FloatArray:
    return np.asarray((u * v).sum(axis=-1) / np.linalg.norm(np.cross(u, v), axis=-1))
