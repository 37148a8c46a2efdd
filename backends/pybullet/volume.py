"""Solids: stable Neo-Hookean cells, with assumed strains in boxes so that they bend as they should."""

from itertools import product

import numpy as np

from ...core.arrays import FloatArray, IntArray
from ...core.body import Body
from ...core.material import SolidMaterial
from .elasticity import Elasticity
from .sparse import Operator, operator

#: Of a box [-1, 1]^3, in the order of its corners: the four shapes that are not linear: yz, xz, xy and xyz.
_CORNERS = np.array(list(product((-1.0, 1.0), repeat=3)))
_X, _Y, _Z = _CORNERS.T
_HOURGLASS = np.stack([_Y * _Z, _X * _Z, _X * _Y, _X * _Y * _Z]) / 8.0


class Volume(Elasticity):
    r"""Cells with one deformation gradient F, taken in their middle.

    .. math:: W = V \left( \mu (tr F^T F - 3) / 2 - \mu (J - 1) + (\lambda + \mu) (J - 1)^2 / 2 \right),
        \quad J = \det F

    whose linearisation at rest is Hooke's law, and which resists inversion. A general mesh has tetrahedra as
    cells, and bends too stiffly where it is coarse. A regular grid of boxes has those as cells; what their other
    motions :math:`q_a` cost, ``a`` in yz, xz, xy, xyz, is a quadratic form in :math:`F^T q_a`, which makes it exact for
    pure bending and torsion of a box, in rest coordinates x / (L / 2) in [-1, 1]:

    - bending, of the pair of normal strains linear in one coordinate, plane stress, shear relaxed:
      :math:`V E (e_1^2 + 2 \nu e_1 e_2 + e_2^2) / (6 (1 - \nu^2))` with :math:`e = 2 q / L`;
    - torsion: :math:`V \mu g^2 / 6` for every shear strain linear in a coordinate;
    - the xyz shapes :math:`V E e^2 / 18`.

    Args:
        body: mesh in its rest shape.
        material: of the solid.

    References:
        Smith, de Goes and Kim, *Stable Neo-Hookean flesh simulation*, 2018; Belytschko and Bindeman, *Assumed
        strain stabilization of the eight node hexahedral element*, 1993.
    """

    def __init__(self, body: Body, material: SolidMaterial) -> None:
        e, nu = material.youngs_modulus, material.poisson_ratio
        self._mu = e / (2.0 * (1.0 + nu))
        self._lame = e * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))
        boxes = box_cells(body)
        self._cells = body.elements if boxes is None else boxes
        corners = body.vertices[self._cells]
        if boxes is None:
            edges = corners[:, 1:] - corners[:, :1]
            inverse = np.linalg.inv(edges)
            gradients = np.concatenate([-inverse.sum(axis=2, keepdims=True), inverse], axis=2)
            self._size = body.measures
            self._modes = 0
        else:
            axes = np.einsum("ka,ckx->cax", _CORNERS / 8.0, corners)  # half edges
            half = np.linalg.norm(axes, axis=2)
            gradients = np.broadcast_to(_CORNERS.T / 8.0, (len(half), 3, 8)) / half[:, :, None]
            self._size = 8.0 * half.prod(axis=1)
            self._modes = 4
            self._form = _hourglass_form(half, self._size, e, nu)
            gradients = np.concatenate([gradients, np.broadcast_to(_HOURGLASS, (len(half), 4, 8))], axis=1)
        count, size, each = len(self._cells), len(body.vertices), 3 + self._modes
        rows = np.arange(count * each).reshape(count, each)[:, :, None]
        columns = self._cells[:, None, :]
        rows, columns = np.broadcast_arrays(rows, columns)
        self._forward: Operator = operator(rows, columns, gradients, (count * each, size))
        self._back: Operator = operator(columns, rows, gradients, (size, count * each))
        self._weight, self._factor = self._size, np.ones(count)
        self._share = None if boxes is None else _cell_of(body, boxes)
        steep = (gradients[:, :3] ** 2).sum(axis=1) * (self._size * (self._lame + 2.0 * self._mu))[:, None]
        if self._modes:
            steep += np.einsum("cii->c", self._form)[:, None] / 64.0
        self.diagonal = np.asarray(np.bincount(self._cells.ravel(), steep.ravel(), minlength=size), np.float64)

    def scale_stretch(self, factor: FloatArray | None) -> None:
        if factor is None:
            self._factor = np.ones(len(self._cells))
        elif self._share is None:
            self._factor = factor
        else:
            total = np.bincount(self._share, factor, minlength=len(self._cells))
            self._factor = total / np.bincount(self._share, minlength=len(self._cells))
        self._weight = self._size * self._factor

    def forces(self, positions: FloatArray) -> FloatArray:
        shape = self._forward(positions).reshape(len(self._cells), -1, 3)
        f = self._f = shape[:, :3]  # F transposed
        cofactor = np.stack(
            [np.cross(f[:, 1], f[:, 2]), np.cross(f[:, 2], f[:, 0]), np.cross(f[:, 0], f[:, 1])], axis=1
        )
        volume = np.einsum("ci,ci->c", f[:, 0], cofactor[:, 0])
        swell = (self._lame + self._mu) * (volume - 1.0) - self._mu
        load = np.empty_like(shape)
        load[:, :3] = self._weight[:, None, None] * (self._mu * f + swell[:, None, None] * cofactor)
        if self._modes:
            self._q = shape[:, 3:]
            self._hourglass(load, np.matmul(self._q, f.transpose(0, 2, 1)))
        return -self._back(load.reshape(-1, 3))

    def stiffness(self, motion: FloatArray) -> FloatArray:
        rate = self._forward(motion).reshape(len(self._cells), -1, 3)
        f, g = self._f, rate[:, :3]
        product = np.matmul(f, g.transpose(0, 2, 1))
        strain = product + product.transpose(0, 2, 1)  # twice the rate of Green's strain
        trace = np.einsum("cii->c", strain)
        stress = self._mu * strain + (0.5 * self._lame * trace)[:, None, None] * np.eye(3)
        load = np.empty_like(rate)
        load[:, :3] = self._weight[:, None, None] * np.matmul(stress, f)
        if self._modes:
            moved = np.matmul(rate[:, 3:], f.transpose(0, 2, 1)) + np.matmul(self._q, g.transpose(0, 2, 1))
            self._hourglass(load, moved)
        return self._back(load.reshape(-1, 3))

    def _hourglass(self, load: FloatArray, amplitudes: FloatArray) -> None:
        """Add the forces of ``amplitudes (C, 4, 3)``, the hourglass motions in the rest frame."""
        flat = amplitudes.reshape(len(amplitudes), 12, 1)
        answer = np.matmul(self._form, flat).reshape(-1, 4, 3) * self._factor[:, None, None]
        load[:, 3:] = np.matmul(answer, self._f)
        load[:, :3] += np.matmul(answer.transpose(0, 2, 1), self._q)


def box_cells(body: Body) -> IntArray | None:
    """Corners ``(C, 8)`` of the cells of a regular grid of boxes, z fastest; None if it is not one."""
    if body.grid is None or len(body.grid) != 3 or np.prod(body.grid) != len(body.vertices):
        return None
    index = np.arange(len(body.vertices)).reshape(body.grid)
    a, b, c = body.grid
    cells = np.stack(
        [index[i : a - 1 + i, j : b - 1 + j, k : c - 1 + k].ravel() for i, j, k in product((0, 1), repeat=3)], axis=1
    )
    corners = body.vertices[cells]
    modes = np.einsum("ak,ckx->cax", np.concatenate([_CORNERS.T / 8.0, _HOURGLASS]), corners)
    size = np.linalg.norm(modes[:, :3], axis=2).min(axis=1)
    angles = np.einsum("cax,cbx->cab", modes[:, :3], modes[:, :3]) * (1.0 - np.eye(3))
    is_box = np.abs(angles).max(axis=(1, 2)) <= 1e-6 * size**2
    is_box &= np.abs(modes[:, 3:]).max(axis=(1, 2)) <= 1e-6 * size
    right_handed = np.linalg.det(modes[:, :3]) > 0
    volume = 8.0 * np.linalg.det(modes[:, :3]).sum()
    whole = abs(volume - body.measures.sum()) <= 1e-6 * abs(volume)
    return cells if bool(is_box.all() and right_handed.all() and whole) else None


def _cell_of(body: Body, cells: IntArray) -> IntArray:
    """The cell that each tetrahedron lies in ``(E,)``."""
    middle = body.vertices[body.elements].mean(axis=1)
    centres = body.vertices[cells].mean(axis=1)
    return np.array([int(np.argmin(((centres - m) ** 2).sum(axis=1))) for m in middle], np.int64)


def _hourglass_form(half: FloatArray, volume: FloatArray, modulus: float, poisson: float) -> FloatArray:
    """Twice the energy of the hourglass amplitudes ``(C, 12, 12)`` [N/m], index 3 mode + component."""
    form = np.zeros((len(half), 4, 3, 4, 3))
    shear = modulus / (2.0 * (1.0 + poisson))
    for d in range(3):  # the coordinate that strains are linear in
        i, j = (d + 1) % 3, (d + 2) % 3
        # Normal strain e_i = d u_i / d x_i of the shape x_i x_d in component i; that shape is mode j, likewise mode i.
        plane = volume / 3.0 * modulus / (1.0 - poisson**2)
        form[:, j, i, j, i] += plane / half[:, i] ** 2
        form[:, i, j, i, j] += plane / half[:, j] ** 2
        cross = plane * poisson / (half[:, i] * half[:, j])
        form[:, j, i, i, j] += cross
        form[:, i, j, j, i] += cross
        # Shear g_ij = d u_i / d x_j + d u_j / d x_i of u_i ~ x_j x_d (mode i) and u_j ~ x_i x_d (mode j).
        twist = volume / 3.0 * shear
        form[:, i, i, i, i] += twist / half[:, j] ** 2
        form[:, j, j, j, j] += twist / half[:, i] ** 2
        form[:, i, i, j, j] += twist / (half[:, i] * half[:, j])
        form[:, j, j, i, i] += twist / (half[:, i] * half[:, j])
        form[:, 3, d, 3, d] += volume / 9.0 * modulus / half[:, d] ** 2
    return form.reshape(-1, 12, 12)
