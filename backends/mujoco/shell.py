"""Cloth: what MuJoCo's arrays must hold so that a flex is the sheet that was asked for."""

import numpy as np

from ...core.arrays import FloatArray, IntArray
from ...core.body import Body
from ...core.material import ClothMaterial


def stretch_forms(body: Body, material: ClothMaterial) -> FloatArray:
    """``mjModel.flex_stiffness`` of every triangle ``(E, 21)``: an orthotropic Saint Venant-Kirchhoff membrane.

    With e_a = L_a^2 - l_a^2, the squared elongations of the edges opposite to corners 0, 1 and 2, MuJoCo's
    energy of a triangle is e.M.e / 4. Green's strain G has e_a = 2 d_a.G.d_a for every edge d_a at rest, so
    e = B g with g = (G_uu, G_vv, 2 G_uv), u along the warp and v along the weft, and
    B_a = 2 (u_a^2, v_a^2, u_a v_a). The membrane's energy A g.C.g / 2 is therefore M = 2 A B^-T C B^-1, with

        C = [[S_u, nu S, 0], [nu S, S_v, 0], [0, 0, 0]] / (1 - nu^2) + diag(0, 0, S / (2 (1 + nu)))

    and S_u = S / sqrt(r), S_v = S sqrt(r): plane stress, nu the geometric mean of both Poisson ratios.
    The first six numbers are the upper triangle of M, row by row.
    """
    corners = body.vertices[body.elements]
    warp = body.warp_directions(body.vertices)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    weft = np.cross(normal / np.linalg.norm(normal, axis=1, keepdims=True), warp)
    edges = corners[:, [2, 0, 1]] - corners[:, [1, 2, 0]]
    u, v = np.einsum("eax,ex->ea", edges, warp), np.einsum("eax,ex->ea", edges, weft)
    inverse = np.linalg.inv(2.0 * np.stack([u * u, v * v, u * v], axis=2))
    s, nu, root = material.stretch_stiffness, material.poisson_ratio, np.sqrt(material.weft_stretch_ratio)
    plane = np.array([[s / root, nu * s, 0.0], [nu * s, s * root, 0.0], [0.0, 0.0, 0.0]]) / (1.0 - nu**2)
    plane[2, 2] = s / (2.0 * (1.0 + nu))
    forms = 2.0 * body.measures[:, None, None] * (inverse.transpose(0, 2, 1) @ plane @ inverse)
    out = np.zeros((len(forms), 21))
    out[:, :6] = forms[:, *np.triu_indices(3)]
    return out


def fold_weights(corners: IntArray, hinges: IntArray, weights: FloatArray) -> FloatArray:
    """Sum of the ``weights (N,)`` of ``hinges (N, 4)`` for each hinge ``corners (M, 4)`` of the same edges, edge first.

    What they weigh is a determinant, which changes sign when the ends of the edge or the two corners beside it swap.
    """
    size = int(hinges.max(initial=0)) + 1
    keys, where = np.unique(_edge_keys(hinges, size), return_inverse=True)
    totals = np.bincount(where.ravel(), weights * _parity(hinges), minlength=len(keys))
    return np.asarray(totals[np.searchsorted(keys, _edge_keys(corners, size))] * _parity(corners))


def _edge_keys(hinges: IntArray, size: int) -> IntArray:
    return np.asarray(hinges[:, :2].min(axis=1) * size + hinges[:, :2].max(axis=1))


def _parity(hinges: IntArray) -> FloatArray:
    return np.where((hinges[:, 0] < hinges[:, 1]) == (hinges[:, 2] < hinges[:, 3]), 1.0, -1.0)
