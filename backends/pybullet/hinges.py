"""The hinges of a sheet, and its bending energy as a form in their angles."""

import numpy as np

from ...core.arrays import BoolArray, FloatArray, IntArray
from ...core.body import Body

#: Share of the energy taken triangle by triangle instead of averaged over the triangles around a vertex.
_UNAVERAGED = 0.1


def hinges(body: Body) -> tuple[IntArray, IntArray]:
    """Inner edges with the corner left and the corner right of them ``(N, 4)``, and those triangles ``(N, 2)``.

    Seen from where the first triangle runs counterclockwise; the other may run either way.
    """
    first: dict[tuple[int, int], tuple[int, int, int, int]] = {}
    hinges, sides = [], []
    for e, triangle in enumerate(body.elements.tolist()):
        for i in range(3):
            a, b, c = triangle[i], triangle[(i + 1) % 3], triangle[(i + 2) % 3]
            key = (min(a, b), max(a, b))
            if key in first:
                p, q, r, other = first[key]
                hinges.append([p, q, r, c])
                sides.append([other, e])
            else:
                first[key] = (a, b, c, e)
    return np.array(hinges, np.int64).reshape(-1, 4), np.array(sides, np.int64).reshape(-1, 2)


def hinge_form(body: Body, hinges: IntArray, sides: IntArray, weft_ratio: float, held: IntArray) -> FloatArray:
    """Matrix ``(N, N)`` [1]: twice the bending energy over D as a form in the changes of angle."""
    points, area = body.vertices, body.measures
    corners = points[body.elements]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    rigid: BoolArray = np.all(np.isin(body.elements, held), axis=1)
    warp = body.warp_directions(points)
    by_triangle: list[list[tuple[int, int]]] = [[] for _ in area]
    for h, pair in enumerate(sides.tolist()):
        for e in pair:
            by_triangle[e].append((h, pair[0]))
    size = np.linalg.norm(points[hinges[:, 1]] - points[hinges[:, 0]], axis=1)
    double = np.where(rigid[sides].any(axis=1), 2.0, 1.0)
    rows: list[tuple[IntArray, FloatArray]] = []  # curvature (3, 3): what each hinge adds, as world tensors
    for e, parts in enumerate(by_triangle):
        which = np.array([h for h, _ in parts], np.int64)
        # Seen from the first triangle of a hinge; a triangle wound the other way sees it with the other sign.
        signs = np.array([1.0 if f == e or _agree(body, hinges[h], e) else -1.0 for h, f in parts])
        edge = (points[hinges[which, 1]] - points[hinges[which, 0]]) / size[which, None]
        across = np.cross(normal[e], edge)
        tensor = np.einsum("h,hi,hj->hij", signs * double[which] * size[which] / (2 * area[e]), across, across)
        rows.append((which, _without_free_edges(tensor, body, e, hinges[which], normal[e])))
    form = np.zeros((len(hinges),) * 2)
    root = np.array([weft_ratio**-0.125, weft_ratio**0.125])

    def weighted(tensors: FloatArray, u: FloatArray, n: FloatArray) -> FloatArray:
        frame = np.stack([u, np.cross(n, u)]) * root[:, None]
        inside = np.einsum("ai,hij,bj->abh", frame, tensors, frame)
        # The square sum of these four is S_uu^2 / sqrt r + S_vv^2 sqrt r + 2 S_uv^2.
        return np.asarray(inside.reshape(4, -1))

    for e, (which, tensor) in enumerate(rows):
        part = weighted(tensor, warp[e], normal[e])
        form[np.ix_(which, which)] += _UNAVERAGED * (0.0 if rigid[e] else area[e]) * part.T @ part
    around: list[list[int]] = [[] for _ in points]
    for e, triangle in enumerate(body.elements.tolist()):
        for v in triangle:
            around[v].append(e)
    for near in around:
        share = np.where(rigid[near], 0.0, area[near]) / 3.0
        if not share.sum() > 0:
            continue
        facing = np.sign(normal[near] @ normal[near[0]])
        facing[facing == 0] = 1.0
        mean = (share * facing) @ normal[near]
        mean /= np.linalg.norm(mean)
        main = near[int(np.argmax(share))]
        thread = _turned(normal[main] * facing[near.index(main)], mean) @ warp[main]
        columns = np.unique(np.concatenate([rows[e][0] for e in near]))
        total = np.zeros((len(columns), 3, 3))
        for e, s, f in zip(near, share, facing, strict=True):
            turn = _turned(f * normal[e], mean)
            total[np.searchsorted(columns, rows[e][0])] += s * f * np.einsum("ia,hab,jb->hij", turn, rows[e][1], turn)
        part = weighted(total, thread, mean)
        form[np.ix_(columns, columns)] += (1 - _UNAVERAGED) / share.sum() * part.T @ part
    return form


def _agree(body: Body, hinge: IntArray, element: int) -> bool:
    """Whether ``element`` runs through the edge of ``hinge`` against the first triangle, as on an oriented mesh."""
    triangle = body.elements[element].tolist()
    i = triangle.index(int(hinge[0]))
    return bool(triangle[(i + 2) % 3] == int(hinge[1]))


def _without_free_edges(
    tensor: FloatArray, body: Body, element: int, hinges: IntArray, normal: FloatArray
) -> FloatArray:
    """Curvature across a free edge costs nothing: take it out of ``tensor (N, 3, 3)``."""
    triangle = body.elements[element]
    has = {tuple(sorted(h[:2].tolist())) for h in hinges}
    free = []
    for i in range(3):
        a, b = int(triangle[i]), int(triangle[(i + 1) % 3])
        if (min(a, b), max(a, b)) not in has:
            edge = body.vertices[b] - body.vertices[a]
            across = np.cross(normal, edge / np.linalg.norm(edge))
            free.append(np.outer(across, across).ravel())
    if not free:
        return tensor
    basis = np.linalg.qr(np.array(free).T)[0]
    flat = tensor.reshape(len(tensor), 9)
    return np.asarray((flat - flat @ basis @ basis.T).reshape(-1, 3, 3))


def _turned(start: FloatArray, end: FloatArray) -> FloatArray:
    """The smallest rotation ``(3, 3)`` that takes unit vector ``start`` to ``end``."""
    axis, cosine = np.cross(start, end), float(start @ end)
    if cosine < -0.999999:
        return np.eye(3)
    skew = np.array([[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]])
    return np.asarray(np.eye(3) + skew + skew @ skew / (1.0 + cosine))
