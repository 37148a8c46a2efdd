"""Linear triangles and tetrahedra of Saint Venant-Kirchhoff material, all at once in numpy."""

import numpy as np

from ...core.arrays import FloatArray
from ...core.body import Body


class Elements:
    r"""Constant-strain elements of dimension ``d`` (2 for cloth, 3 for solids), ``E`` of them on ``V`` vertices.

    .. math:: F = \partial x / \partial X, \quad E = (F^T F - 1) / 2, \quad
        W = A\, (\lambda\, tr(E)^2 / 2 + \mu\, E : E)

    Everything is expressed by the *strain matrix* B of a shape, ``(E, s, 3 (d + 1))``: for a motion u of the
    vertices, B u is the strain rate in the ``s = d (d + 1) / 2`` components, scaled so that its square is twice the
    energy. So the stiffness is :math:`B^T B`, and the strain itself, for E is quadratic, is
    :math:`B x / 2 - B_0 X / 2`.

    Args:
        body: the mesh at rest.
        lame: lambda and mu, [N/m] for a sheet in plane stress, [Pa] for a solid.

    References:
        Bonet and Wood, *Nonlinear Continuum Mechanics for Finite Element Analysis*, 2008, section 6.
    """

    def __init__(self, body: Body, lame: tuple[float, float]) -> None:
        corners = body.vertices[body.elements]
        edges = corners[:, 1:] - corners[:, :1]
        d = edges.shape[1]
        if d == 2:
            first = edges[:, 0] / np.linalg.norm(edges[:, 0], axis=1, keepdims=True)
            normal = np.cross(first, edges[:, 1])
            normal /= np.linalg.norm(normal, axis=1, keepdims=True)
            frame = np.stack([first, np.cross(normal, first)], axis=1)
            edges = edges @ frame.transpose(0, 2, 1)
        inverse = np.linalg.inv(edges)
        #: Gradients of the shape functions ``(E, d, d + 1)`` [1/m]; times the corners, F transposed.
        self._gradients = np.ascontiguousarray(np.concatenate([-inverse.sum(axis=2, keepdims=True), inverse], axis=2))
        self._elements = body.elements
        self._slots = (3 * body.elements[:, :, None] + np.arange(3)).reshape(len(body.elements), -1)
        self._flat_slots = self._slots.ravel()
        self._count = len(body.vertices)
        self._spread = _spread(self._gradients, body.measures, lame)
        self._rest = 0.5 * self._strain(self.strain_matrix(body.vertices), body.vertices)
        steep = (self._gradients**2).sum(axis=1) * body.measures[:, None] * (lame[0] + 2.0 * lame[1])
        #: No less than the stiffness of each vertex against its own motion, at rest ``(V,)`` [N/m].
        self.diagonal_bound = np.bincount(body.elements.ravel(), steep.ravel(), minlength=self._count)

    def strain_matrix(self, positions: FloatArray) -> FloatArray:
        """B at ``positions (V, 3)`` [m]."""
        deformation = np.matmul(self._gradients, positions[self._elements])
        return np.asarray(np.matmul(self._spread, deformation)).reshape(len(self._elements), -1, self._slots.shape[1])

    def _strain(self, matrix: FloatArray, motion: FloatArray) -> FloatArray:
        return np.asarray(np.einsum("esk,ek->es", matrix, motion.ravel().take(self._slots)))

    def _pull(self, matrix: FloatArray, strain: FloatArray) -> FloatArray:
        local = np.einsum("esk,es->ek", matrix, strain)
        total = np.bincount(self._flat_slots, local.ravel(), minlength=3 * self._count)
        return np.asarray(total, dtype=np.float64).reshape(-1, 3)

    def forces(self, matrix: FloatArray, positions: FloatArray) -> FloatArray:
        """Elastic nodal forces ``(V, 3)`` [N] at ``positions (V, 3)`` [m], of which ``matrix`` is the strain matrix."""
        return -self._pull(matrix, 0.5 * self._strain(matrix, positions) - self._rest)

    def stiffness(self, matrix: FloatArray, motion: FloatArray) -> FloatArray:
        """Material stiffness times ``motion (V, 3)``.

        Only the part of the tangent that comes from strain rates: symmetric, never negative, and zero for
        every rigid motion of the present shape, which is what a damping C = beta K needs.
        """
        return self._pull(matrix, self._strain(matrix, motion))


def _spread(gradients: FloatArray, measures: FloatArray, lame: tuple[float, float]) -> FloatArray:
    """What makes B from F transposed: ``(E, s (d + 1), d)``."""
    d = gradients.shape[1]
    pairs = [(a, a) for a in range(d)] + [(a, b) for a in range(d) for b in range(a + 1, d)]
    moduli = np.diag(np.full(len(pairs), 2.0 * lame[1]))
    moduli[:d, :d] += lame[0]
    root = np.linalg.cholesky(moduli).T
    component = np.zeros((len(pairs), d, d))
    for s, (a, b) in enumerate(pairs):
        component[s, a, b] += 0.5 if a == b else np.sqrt(0.5)
        component[s, b, a] += 0.5 if a == b else np.sqrt(0.5)
    weighted = np.einsum("st,tab->sab", root, component)
    spread = np.einsum("e,sab,eaj->esjb", np.sqrt(measures), weighted, gradients)
    return np.ascontiguousarray(spread.reshape(len(measures), -1, d))


def plane_stress(stretch_stiffness: float, poisson_ratio: float) -> tuple[float, float]:
    """Lambda and mu [N/m] of a sheet of stretch stiffness E t [N/m]."""
    return (
        stretch_stiffness * poisson_ratio / (1.0 - poisson_ratio**2),
        stretch_stiffness / (2.0 * (1.0 + poisson_ratio)),
    )


def volumetric(youngs_modulus: float, poisson_ratio: float) -> tuple[float, float]:
    """Lambda and mu [Pa] of a solid of Young's modulus E [Pa]."""
    return (
        youngs_modulus * poisson_ratio / ((1.0 + poisson_ratio) * (1.0 - 2.0 * poisson_ratio)),
        youngs_modulus / (2.0 * (1.0 + poisson_ratio)),
    )
