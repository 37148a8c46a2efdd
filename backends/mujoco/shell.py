"""Cloth: what MuJoCo's arrays must hold so that a flex is the sheet that was asked for."""

from typing import Any

import numpy as np

from ...core.arrays import FloatArray
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


def hinge_thickness(material: ClothMaterial) -> float:
    """Thickness t [m] at which MuJoCo's own shell of modulus E = (E t) / t has bending rigidity D.

    From D = E t^3 / (12 (1 - nu^2)), the Kirchhoff plate: t = sqrt(12 (1 - nu^2) D / (E t)).
    """
    nu = material.poisson_ratio
    return float(np.sqrt(12.0 * (1.0 - nu**2) * material.bending_rigidity / material.stretch_stiffness))


def write_stretch(view: Any, forms: FloatArray, factor: FloatArray | None) -> None:
    """Fill MuJoCo's array, each element's form times its ``factor (E,)``."""
    if factor is None:
        view[:] = forms
    else:
        np.multiply(forms, factor[:, None], out=view)
