"""Sheets: constant-strain triangles of orthotropic Saint Venant-Kirchhoff material, and their bending."""

from typing import Protocol

import numpy as np

from ...core.arrays import FloatArray
from ...core.body import Body
from ...core.material import ClothMaterial
from .elasticity import Elasticity
from .sparse import Operator, operator


class Bending(Protocol):
    """What a sheet's bending adds."""

    #: Own stiffness of every vertex ``(V,)`` [N/m].
    diagonal: FloatArray

    def forces(self, positions: FloatArray) -> FloatArray: ...

    def stiffness(self, motion: FloatArray) -> FloatArray: ...


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
        corners = body.vertices[body.elements]
        edges = corners[:, 1:] - corners[:, :1]
        warp = body.warp_directions(body.vertices)
        normal = np.cross(edges[:, 0], edges[:, 1])
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        inverse = np.linalg.inv(edges @ np.stack([warp, np.cross(normal, warp)], axis=2))
        gradients = np.concatenate([-inverse.sum(axis=2, keepdims=True), inverse], axis=2)
        count, size = len(body.elements), len(body.vertices)
        rows = np.arange(2 * count).reshape(2, count).T[:, :, None]
        columns = np.broadcast_to(body.elements[:, None, :], gradients.shape)
        #: From positions to F: first all derivatives along the warp, then all along the weft.
        self._forward: Operator = operator(
            np.broadcast_to(rows, gradients.shape), columns, gradients, (2 * count, size)
        )
        self._back: Operator = operator(columns, np.broadcast_to(rows, gradients.shape), gradients, (size, 2 * count))
        s, nu, root = material.stretch_stiffness, material.poisson_ratio, np.sqrt(material.weft_stretch_ratio)
        self._moduli = np.array([[s / root, nu * s, 0.0], [nu * s, s * root, 0.0], [0.0, 0.0, 0.0]]) / (1.0 - nu**2)
        self._moduli[2, 2] = s / (2.0 * (1.0 + nu))
        # Stress as moduli times (F_u.F_u, F_v.F_v, F_u.F_v) less what that is at rest.
        self._half_moduli = self._moduli * np.array([0.5, 0.5, 1.0])
        self._prestress = self._half_moduli @ np.array([[1.0], [1.0], [0.0]])
        self._area, self._weight = body.measures, body.measures
        self._bending = bending
        self._count = count
        self._strain = np.empty((3, count))
        steep = (gradients**2).sum(axis=1) * (body.measures * np.linalg.eigvalsh(self._moduli)[-1] * 1.5)[:, None]
        self.diagonal = bending.diagonal + np.bincount(body.elements.ravel(), steep.ravel(), minlength=size)

    def scale_stretch(self, factor: FloatArray | None) -> None:
        self._weight = self._area if factor is None else self._area * factor

    def forces(self, positions: FloatArray) -> FloatArray:
        shape = self._forward(positions)
        self._u, self._v = shape[: self._count], shape[self._count :]
        e = self._strain
        np.einsum("ij,ij->i", self._u, self._u, out=e[0])
        np.einsum("ij,ij->i", self._v, self._v, out=e[1])
        np.einsum("ij,ij->i", self._u, self._v, out=e[2])
        stress = self._half_moduli @ e
        stress -= self._prestress
        return self._bending.forces(positions) - self._pull(stress)

    def stiffness(self, motion: FloatArray) -> FloatArray:
        rate = self._forward(motion)
        u, v, e = rate[: self._count], rate[self._count :], self._strain
        np.einsum("ij,ij->i", self._u, u, out=e[0])
        np.einsum("ij,ij->i", self._v, v, out=e[1])
        np.einsum("ij,ij->i", self._u, v, out=e[2])
        e[2] += np.einsum("ij,ij->i", self._v, u)
        return self._bending.stiffness(motion) + self._pull(self._moduli @ e)

    def _pull(self, stress: FloatArray) -> FloatArray:
        """What ``stress (3, E)`` [N/m] does to the vertices."""
        stress *= self._weight
        first, second, shear = stress[0][:, None], stress[1][:, None], stress[2][:, None]
        load = np.empty((2 * self._count, 3))
        np.multiply(self._u, first, out=load[: self._count])
        load[: self._count] += shear * self._v
        np.multiply(self._v, second, out=load[self._count :])
        load[self._count :] += shear * self._u
        return self._back(load)
