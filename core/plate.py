"""Bending of a sheet: a constant matrix, force = -D Q x, and what keeps a curved rest shape curved."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from .arrays import BoolArray, FloatArray, IntArray
from .body import Body
from .errors import InputError

#: Vertices of a curved sheet up to which :func:`rest_stress` balances it.
_MOST_BALANCED = 400
#: Share of the energy taken triangle by triangle instead of averaged over the triangles around a vertex.
_UNAVERAGED = 0.1


def bending_matrix(body: Body, held: IntArray, weft_ratio: float = 1.0) -> FloatArray:
    r"""The matrix ``Q (V, V)`` [1/m2] with bending energy :math:`D/2 \sum_{axis} x^T Q x`.

    Each triangle has a shape operator made of its three hinges: :math:`S = \sum_i k_i t_i t_i^T / 2A`,
    where :math:`t_i` is normal to edge i in the plane and :math:`k_i` is, in the linear hinge of Wardetzky et
    al., edge length times bending angle (as a vector). At a free edge the curvature across it costs nothing.
    One regular grid in this form alone is 1.5 times too stiff along diagonals and 2 times in twist, since the
    hinges alias; averaging S over the triangles of a vertex takes that away, and a small unaveraged share keeps
    the shortest wrinkles stiff. With r the ratio of weft over warp the energy density is
    :math:`D/2 (S_{warp}^2 / \sqrt{r} + S_{weft}^2 \sqrt{r} + 2 S_{shear}^2)`. A sheet with r = 1 bent to a
    cylinder of curvature k stores :math:`D k^2 / 2` per area in any direction, wide strip or narrow.

    Triangles of which all corners are held are rigid. The sheet beside them is clamped at the very edge: a hinge
    there turns one triangle only, by its whole angle instead of half, and all its energy is in that triangle.
    Without this a cantilever would be clamped half a cell too deep, which on 8 cells is 20 % of sag.

    Args:
        body: a surface. Q measures curvature, not change of curvature: where the rest shape is not flat,
            :func:`rest_folds` belongs to it.
        held: indices ``(H,)`` of the held vertices.
        weft_ratio: bending rigidity along the weft over that along the warp [1].

    Returns:
        The matrix, not to be written to: the last few are kept.

    Raises:
        InputError: a triangle has no area, or more than two triangles meet in an edge.

    References:
        Grinspun, Gingold, Reisman and Zorin, *Computing discrete shape operators on general meshes*, 2006;
        Wardetzky, Bergou, Harmon, Zorin and Grinspun, *Discrete quadratic curvature energies*, 2007.
    """
    return _matrix(_Alike(body), held.astype(np.int64).tobytes(), weft_ratio)


class _Alike:
    """A surface that equals every other of the same numbers."""

    def __init__(self, body: Body) -> None:
        assert body.warp is not None
        self.body = body
        self._key = tuple((a.shape, a.tobytes()) for a in (body.vertices, body.elements, body.warp))

    def __hash__(self) -> int:
        return hash(self._key)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Alike) and self._key == other._key


@lru_cache(maxsize=4)  # rollouts of one study share it unless they scale the object
def _matrix(alike: _Alike, held: bytes, weft_ratio: float) -> FloatArray:
    body = alike.body
    sheet = _sheet(body, np.frombuffer(held, np.int64), weft_ratio)
    count = len(body.vertices)
    columns = [[0, 1, 2, 3], [1, 2, 0, 4], [2, 0, 1, 5]]
    shape = np.zeros((len(body.elements), 3, 6))
    for i in range(3):
        shape[:, :, columns[i]] += sheet.normals[:, :, i, None] * sheet.stencils[:, None, i]
    support = np.concatenate([body.elements, sheet.across[..., 0]], axis=1)
    matrix = np.zeros((count + 1,) * 2)  # the last row takes what a missing neighbour would get: zeros
    rough = np.einsum("e,eki,ekl,elj->eij", _UNAVERAGED * sheet.area, shape, sheet.forms, shape)
    np.add.at(matrix, (support[:, :, None], support[:, None, :]), rough)
    for around, mix, form in sheet.patches():
        vertices, where = np.unique(support[around], return_inverse=True)
        smooth = np.zeros((len(vertices), 3))
        np.add.at(smooth, where.ravel(), np.einsum("ekl,eli->eik", mix, shape[around]).reshape(-1, 3))
        matrix[np.ix_(vertices, vertices)] += smooth @ form @ smooth.T
    matrix = matrix[:count, :count]
    matrix.flags.writeable = False
    return matrix


def rest_folds(body: Body, held: IntArray, weft_ratio: float = 1.0) -> tuple[IntArray, FloatArray]:
    r"""What :func:`bending_matrix` lacks where the rest shape is curved: ``(N, 4)`` vertices and ``(N,)`` [1/m3].

    Energy :math:`D \sum_n w_n \det(b - a, c - a, d - a)` over the hinges, a and b the ends of the edge. With
    curvatures k_h of the hinges the energy is :math:`k.M.k / 2`, and about the rest shape
    :math:`k.M.k / 2 - k_0.M.k`: of the second term, a hinge's curvature along the normal is
    :math:`-|e|^2 / (4 A_1 A_2)` times its determinant, which turns along with the sheet.

    References:
        Garg, Grinspun, Wardetzky and Zorin, *Cubic shells*, 2007.
    """
    sheet = _sheet(body, held, weft_ratio)
    t, far = body.elements, np.maximum(sheet.across[..., 0], 0)
    hinges = np.stack(
        [np.stack([t[:, i], t[:, (i + 1) % 3], t[:, (i + 2) % 3], far[:, i]], axis=1) for i in range(3)], 1
    )
    folds = np.einsum("eij,eijx->eix", sheet.stencils, body.vertices[hinges])  # length times angle, a vector
    own = np.einsum("eci,eix,ex->ec", sheet.normals, folds, sheet.facing)
    moments = np.einsum("e,eci,ecd,ed->ei", _UNAVERAGED * sheet.area, sheet.normals, sheet.forms, own)
    for around, mix, form in sheet.patches():
        parts = mix @ sheet.normals[around]
        signs = np.sign(sheet.facing[around] @ sheet.facing[around[0]])
        normal = (signs * body.measures[around]) @ sheet.facing[around]
        normal /= np.linalg.norm(normal)
        bent = form @ np.einsum("eci,eix,x->c", parts, folds[around], normal)
        moments[around] += signs[:, None] * np.einsum("eci,c->ei", parts, bent)
    edge = np.sum((body.vertices[hinges[..., 1]] - body.vertices[hinges[..., 0]]) ** 2, axis=2)
    weights = moments * edge / (4.0 * body.measures[:, None] * body.measures[sheet.across[..., 1]])
    inner = sheet.across[..., 0] >= 0
    return hinges[inner], weights[inner]


def rest_stress(body: Body, matrix: FloatArray, hinges: IntArray, weights: FloatArray) -> FloatArray:
    """The small matrix ``(V, V)`` [1/m2] that brings a curved rest shape fully into balance.

    :func:`bending_matrix` and :func:`rest_folds` balance to third order in the angle between two triangles. What is
    left is the gradient of an energy that does not change when the sheet moves rigidly, so that springs of
    zero rest length and of either sign along edges, and between the corners opposite to them, can take it up:
    those are the least ones that do. Left out (zero) for more than :data:`_MOST_BALANCED` vertices, as
    fine meshes hardly need it and the equations are dense.
    """
    count = len(body.vertices)
    out = np.zeros((count, count))
    if count > _MOST_BALANCED:
        return out
    a, b, c, d = (body.vertices[hinges[:, k]] for k in range(4))
    one, two, three = np.cross(c - a, d - a), np.cross(d - a, b - a), np.cross(b - a, c - a)
    force = matrix @ body.vertices
    gradients = np.stack([-(one + two + three), one, two, three], axis=1)
    np.add.at(force, hinges, weights[:, None, None] * gradients)
    i, j = np.unique(np.sort(np.concatenate([body.edges, hinges[:, 2:]]), axis=1), axis=0).T
    apart = body.vertices[i] - body.vertices[j]
    blocks = apart[:, :, None] * apart[:, None, :] / np.sum(apart**2, axis=1)[:, None, None]
    bars = np.zeros((count, count, 3, 3))
    for rows, columns, sign in ((i, i, 1.0), (j, j, 1.0), (i, j, -1.0), (j, i, -1.0)):
        np.add.at(bars, (rows, columns), sign * blocks)
    system = bars.transpose(0, 2, 1, 3).reshape(3 * count, 3 * count) + 1e-9 * np.eye(3 * count)
    moved = np.linalg.solve(system, -force.ravel()).reshape(-1, 3)
    spring = np.sum(apart * (moved[i] - moved[j]), axis=1) / np.sum(apart**2, axis=1)
    for rows, columns, sign in ((i, i, 1.0), (j, j, 1.0), (i, j, -1.0), (j, i, -1.0)):
        np.add.at(out, (rows, columns), sign * spring)
    return out


def is_flat(body: Body) -> bool:
    """Whether all vertices lie in one plane, to a millionth of the size."""
    centred = body.vertices - body.vertices.mean(axis=0)
    extents = np.linalg.svd(centred, compute_uv=False)
    return bool(extents[2] <= 1e-6 * extents[0])


def opposite_vertices(body: Body) -> IntArray:
    """Beyond edge i (corners i and i + 1) of every triangle the far vertex and the triangle ``(E, 3, 2)``, or -1.

    Raises:
        InputError: a triangle has no area, or more than two triangles meet in an edge.
    """
    if not body.measures.min() > 0:
        raise InputError(f"triangle {int(body.measures.argmin())} of the cloth has no area; leave it out of the mesh")
    t = body.elements
    pairs = np.sort(np.stack([t, np.roll(t, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    _, edge, uses = np.unique(pairs, axis=0, return_inverse=True, return_counts=True)
    if (uses > 2).any():
        a, b = pairs[np.flatnonzero(uses[edge.ravel()] > 2)[0]]
        raise InputError(
            f"cloth must be a surface, but {uses.max()} triangles meet in the edge between vertices {a} and {b}; "
            "split the mesh there, or leave out the triangles that are too many"
        )
    order = np.argsort(edge.ravel(), kind="stable")
    same = np.flatnonzero(edge.ravel()[order][1:] == edge.ravel()[order][:-1])
    first, second = order[same], order[same + 1]
    own = np.roll(t, -2, axis=1).ravel()
    out = np.full((t.size, 2), -1, dtype=np.int64)
    out[first] = np.stack([own[second], second // 3], axis=1)
    out[second] = np.stack([own[first], first // 3], axis=1)
    return out.reshape(*t.shape, 2)


@dataclass(frozen=True, eq=False)
class _Sheet:
    """A surface cut into triangles, each with a frame of its own: along its first edge, across it, and its normal.

    Curvatures are written as xx, yy and sqrt(2) xy, so that turning a frame is orthogonal.

    Args:
        body: the surface.
        across: of :func:`opposite_vertices`.
        area: ``(E,)`` [m2], zero of rigid triangles.
        along: first axis of the frames ``(E, 3)``.
        facing: normals ``(E, 3)``.
        stencils: how far the two triangles beside an edge are folded, times its length, from the edge's ends, the own
            and the far corner ``(E, 3 edges, 4)``; zero at free edges.
        normals: what a fold contributes to the triangle's curvature ``(E, 3, 3 edges)`` [1/m2].
        forms: twice the energy density over D of a curvature ``(E, 3, 3)``.
    """

    body: Body
    across: IntArray
    area: FloatArray
    along: FloatArray
    facing: FloatArray
    stencils: FloatArray
    normals: FloatArray
    forms: FloatArray

    def patches(self) -> Iterator[tuple[IntArray, FloatArray, FloatArray]]:
        """For every vertex the triangles around it, how their curvatures add up, and the energy of the sum.

        The sum is in a frame of the patch, into which each triangle's is carried by the turn between their normals.
        """
        corners = self.body.elements.ravel()
        order = np.argsort(corners, kind="stable")
        starts = np.searchsorted(corners[order], np.arange(len(self.body.vertices)))
        around, vertex = order // 3, corners[order]
        share = self.area[around] / 3.0
        turns = self._turns(around, vertex, around[np.minimum(starts, len(around) - 1)])
        mixes = share[:, None, None] * turns
        forms = mixes @ self.forms[around] @ turns.transpose(0, 2, 1)
        for part in np.split(np.arange(len(around)), starts[1:]):
            whole = share[part].sum()
            if whole > 0:
                yield around[part], mixes[part], forms[part].sum(axis=0) * (1 - _UNAVERAGED) / whole**2

    def _turns(self, around: IntArray, vertex: IntArray, first: IntArray) -> FloatArray:
        """``(K, 3, 3)``: from the frames of triangles ``around (K,)`` into those of the patches of ``vertex (K,)``.

        A patch looks along with its first triangle ``first (V,)`` and has that one's first axis.
        """
        signs = np.sign(np.sum(self.facing[around] * self.facing[first[vertex]], axis=1))
        up, along = signs[:, None] * self.facing[around], self.along[around]
        normal = np.zeros_like(self.body.vertices)
        np.add.at(normal, vertex, self.body.measures[around, None] * up)
        x = np.cross(np.cross(normal, self.along[first]), normal)
        normal, x = (v / np.maximum(np.linalg.norm(v, axis=1, keepdims=True), 1e-300) for v in (normal, x))
        y, normal, x = np.cross(normal, x)[vertex], normal[vertex], x[vertex]
        axis, cosine = np.cross(up, normal), np.sum(up * normal, axis=1, keepdims=True)
        moved = along * cosine + np.cross(axis, along) + axis * (np.sum(axis * along, 1, keepdims=True) / (1 + cosine))
        c, s = np.sum(moved * x, axis=1), np.sum(moved * y, axis=1)
        half = np.sqrt(2.0) * c * s
        turns = np.stack([c * c, s * s, -half, s * s, c * c, half, half, -half, c * c - s * s], axis=1).reshape(
            -1, 3, 3
        )
        turns[:, :, 2] *= signs[:, None]
        return np.asarray(turns)


def _sheet(body: Body, held: IntArray, weft_ratio: float) -> _Sheet:
    across = opposite_vertices(body)
    rigid: BoolArray = np.all(np.isin(body.elements, held), axis=1)
    hinged = across[..., 0] >= 0
    corners, far = body.vertices[body.elements], body.vertices[across[..., 0]]
    x = corners[:, 1] - corners[:, 0]
    x = x / np.linalg.norm(x, axis=1, keepdims=True)
    facing = np.cross(x, corners[:, 2] - corners[:, 0])
    facing /= np.linalg.norm(facing, axis=1, keepdims=True)
    y = np.cross(facing, x)
    stencils, normals = np.zeros((len(rigid), 3, 4)), np.zeros((len(rigid), 3, 3))
    for i in range(3):
        a, b, c = corners[:, i], corners[:, (i + 1) % 3], corners[:, (i + 2) % 3]
        d = np.where(hinged[:, i, None], far[:, i], c)  # any corner will do where there is none
        ac, bc, ad, bd = (_cotangent(*e) for e in ((b - a, c - a), (a - b, c - b), (b - a, d - a), (a - b, d - b)))
        stencils[:, i] = np.where(hinged[:, i, None], np.stack([bc + bd, ac + ad, -ac - bc, -ad - bd], axis=1), 0.0)
        tx, ty = -np.sum((b - a) * y, 1), np.sum((b - a) * x, 1)
        normals[:, :, i] = np.stack([tx * tx, ty * ty, np.sqrt(2.0) * tx * ty], axis=1)
        normals[:, :, i] /= np.sum((b - a) ** 2, 1, keepdims=True)
    for e in np.flatnonzero(~hinged.all(axis=1)):
        basis = np.linalg.qr(normals[e][:, ~hinged[e]])[0]
        normals[e] -= basis @ (basis.T @ normals[e])
    beside = np.where(rigid[:, None] | (rigid[across[..., 1]] & hinged), 2.0, 1.0)
    normals *= (beside / (2.0 * body.measures[:, None]))[:, None]
    area = np.where(rigid, 0.0, body.measures)
    return _Sheet(body, across, area, x, facing, stencils, normals, _forms(body, weft_ratio, x, y))


def _forms(body: Body, weft_ratio: float, x: FloatArray, y: FloatArray) -> FloatArray:
    if weft_ratio == 1.0:
        return np.broadcast_to(np.eye(3), (len(body.elements), 3, 3))
    warp = body.warp_directions(body.vertices)
    c, s = np.sum(warp * x, 1), np.sum(warp * y, 1)
    half = np.sqrt(2.0) * c * s
    turn = np.stack([c * c, s * s, half, s * s, c * c, -half, -half, half, c * c - s * s], axis=1).reshape(-1, 3, 3)
    stiff = np.array([weft_ratio**-0.5, weft_ratio**0.5, 1.0])
    return np.asarray(np.einsum("eki,k,ekj->eij", turn, stiff, turn))


def _cotangent(u: FloatArray, v: FloatArray) -> FloatArray:
    return np.asarray((u * v).sum(axis=-1) / np.linalg.norm(np.cross(u, v), axis=-1))
