"""Sheets: constant-strain triangles of orthotropic Saint Venant-Kirchhoff material, and their bending."""

from functools import cache
from typing import Any, NamedTuple

import numpy as np

from ...core.arrays import FloatArray, IntArray
from ...core.body import Body
from ...core.material import ClothMaterial
from .bending import Bending
from .compiled import compiled
from .elasticity import Elasticity, Kernels, kernels


class MembraneData(NamedTuple):
    """Of E triangles.

    Args:
        corners: ``(E, 3)``.
        gradients: from corners to the derivatives along warp and weft ``(E, 2, 3)`` [1/m].
        area: ``(E,)`` [m2], times the factor on the stretch stiffness.
        moduli: C_uu, C_uv, C_vv and C_ss ``(4,)`` [N/m].
        shape: the two derivatives of the remembered shape ``(E, 2, 3)``.
        bending: of the same sheet.
    """

    corners: IntArray
    gradients: FloatArray
    area: FloatArray
    moduli: FloatArray
    shape: FloatArray
    bending: Any


class Membrane(Elasticity):
    r"""Triangles with a frame along the warp, so that all have one matrix of moduli.

    .. math:: E = (F^T F - 1) / 2, \quad W = A\, e^T C\, e / 2, \quad e = (E_{uu}, E_{vv}, 2 E_{uv})

        C = \frac{S}{1 - \nu^2} \begin{pmatrix} r^{-1/2} & \nu & 0 \\ \nu & r^{1/2} & 0 \\
        0 & 0 & (1 - \nu) / 2 \end{pmatrix}

    with r the ratio of weft over warp, plane stress, and :math:`\nu` the geometric mean of both Poisson ratios.

    Args:
        body: mesh in its rest shape.
        material: of the sheet.
        bending: of the same sheet.

    References:
        Bonet and Wood, *Nonlinear Continuum Mechanics for Finite Element Analysis*, 2008, section 6;
        Volino, Magnenat-Thalmann and Faure, *A simple approach to nonlinear tensile stiffness*, 2009.
    """

    def __init__(self, body: Body, material: ClothMaterial, bending: Bending) -> None:
        self.kernels = _kernels(type(bending))
        corners = body.vertices[body.elements]
        edges = corners[:, 1:] - corners[:, :1]
        warp = body.warp_directions(body.vertices)
        normal = np.cross(edges[:, 0], edges[:, 1])
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        inverse = np.linalg.inv(edges @ np.stack([warp, np.cross(normal, warp)], axis=2))
        gradients = np.concatenate([-inverse.sum(axis=2, keepdims=True), inverse], axis=2)
        s, nu, root = material.stretch_stiffness, material.poisson_ratio, np.sqrt(material.weft_stretch_ratio)
        moduli = np.array([s / root, nu * s, s * root, s * (1.0 - nu) / 2.0]) / (1.0 - nu**2)
        self._area = body.measures
        self.data = MembraneData(
            np.array(body.elements, np.int64, order="C"),
            np.ascontiguousarray(gradients),
            np.array(self._area, order="C"),
            moduli,
            np.zeros((len(edges), 2, 3)),
            bending.data,
        )
        highest = np.linalg.eigvalsh([[moduli[0], moduli[1], 0], [moduli[1], moduli[2], 0], [0, 0, moduli[3]]])[-1]
        steep = (gradients**2).sum(axis=1) * (self._area * highest * 1.5)[:, None]
        self.diagonal = bending.diagonal + np.bincount(body.elements.ravel(), steep.ravel(), len(body.vertices))

    def scale_stretch(self, factor: FloatArray | None) -> None:
        self.data.area[:] = self._area if factor is None else self._area * factor


@cache
def _kernels(bending: type[Bending]) -> Kernels:
    own = bending.kernels()
    return kernels(
        own.kind,
        compiled(membrane_forces, own.kind, bending_forces=own.forces),
        compiled(membrane_stiffness, own.kind, bending_stiffness=own.stiffness),
    )


def bending_forces(data: Any, positions: FloatArray, out: FloatArray) -> None:
    """Stands for that of the bending, which is compiled in."""
    raise NotImplementedError


def bending_stiffness(data: Any, motion: FloatArray, out: FloatArray) -> None:
    """Stands for that of the bending, which is compiled in."""
    raise NotImplementedError


def membrane_forces(data: MembraneData, positions: FloatArray, out: FloatArray) -> None:
    """Elastic nodal forces ``out (V, 3)`` [N]."""
    bending_forces(data.bending, positions, out)
    c_uu, c_uv, c_vv, c_ss = data.moduli[0], data.moduli[1], data.moduli[2], data.moduli[3]
    for e in range(len(data.corners)):
        a, b, c = data.corners[e, 0], data.corners[e, 1], data.corners[e, 2]
        g, shape = data.gradients[e], data.shape[e]
        uu = vv = uv = 0.0
        for k in range(3):
            u = g[0, 0] * positions[a, k] + g[0, 1] * positions[b, k] + g[0, 2] * positions[c, k]
            v = g[1, 0] * positions[a, k] + g[1, 1] * positions[b, k] + g[1, 2] * positions[c, k]
            shape[0, k], shape[1, k] = u, v
            uu += u * u
            vv += v * v
            uv += u * v
        first, second = 0.5 * (uu - 1.0), 0.5 * (vv - 1.0)
        area = data.area[e]
        warp, weft = area * (c_uu * first + c_uv * second), area * (c_uv * first + c_vv * second)
        shear = area * c_ss * uv
        for k in range(3):
            along = warp * shape[0, k] + shear * shape[1, k]
            across = weft * shape[1, k] + shear * shape[0, k]
            out[a, k] -= g[0, 0] * along + g[1, 0] * across
            out[b, k] -= g[0, 1] * along + g[1, 1] * across
            out[c, k] -= g[0, 2] * along + g[1, 2] * across


def membrane_stiffness(data: MembraneData, motion: FloatArray, out: FloatArray) -> None:
    """Stiffness times ``motion (V, 3)``."""
    bending_stiffness(data.bending, motion, out)
    c_uu, c_uv, c_vv, c_ss = data.moduli[0], data.moduli[1], data.moduli[2], data.moduli[3]
    for e in range(len(data.corners)):
        a, b, c = data.corners[e, 0], data.corners[e, 1], data.corners[e, 2]
        g, shape = data.gradients[e], data.shape[e]
        first = second = both = 0.0
        for k in range(3):
            u = g[0, 0] * motion[a, k] + g[0, 1] * motion[b, k] + g[0, 2] * motion[c, k]
            v = g[1, 0] * motion[a, k] + g[1, 1] * motion[b, k] + g[1, 2] * motion[c, k]
            first += shape[0, k] * u
            second += shape[1, k] * v
            both += shape[0, k] * v + shape[1, k] * u
        area = data.area[e]
        warp, weft = area * (c_uu * first + c_uv * second), area * (c_uv * first + c_vv * second)
        shear = area * c_ss * both
        for k in range(3):
            along = warp * shape[0, k] + shear * shape[1, k]
            across = weft * shape[1, k] + shear * shape[0, k]
            out[a, k] += g[0, 0] * along + g[1, 0] * across
            out[b, k] += g[0, 1] * along + g[1, 1] * across
            out[c, k] += g[0, 2] * along + g[1, 2] * across
