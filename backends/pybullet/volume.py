"""Solids: stable Neo-Hookean cells, with assumed strains in boxes so that they bend as they should."""

from functools import cache
from itertools import product
from typing import NamedTuple

import numpy as np

from ...core.arrays import FloatArray, IntArray
from ...core.body import Body
from ...core.material import SolidMaterial
from .compiled import compiled
from .elasticity import Elasticity, Kernels, kernels

#: Of a box [-1, 1]^3, in the order of its corners: the four shapes that are not linear: yz, xz, xy and xyz.
_CORNERS = np.array(list(product((-1.0, 1.0), repeat=3)))
_X, _Y, _Z = _CORNERS.T
_HOURGLASS = np.stack([_Y * _Z, _X * _Z, _X * _Y, _X * _Y * _Z]) / 8.0


class VolumeData(NamedTuple):
    """Of C cells of K corners with M motions besides the linear ones.

    Args:
        cells: ``(C, K)``.
        gradients: from corners to F transposed and the other motions ``(C, 3 + M, K)``.
        size: volumes ``(C,)`` [m3].
        factor: on the stiffness ``(C,)``.
        form: twice the energy of the other motions in the rest frame ``(C, 3 M, 3 M)`` [N/m].
        mu, lame: Lame's constants [Pa].
        shape: F transposed and the other motions of the remembered shape ``(C, 3 + M, 3)``.
    """

    cells: IntArray
    gradients: FloatArray
    size: FloatArray
    factor: FloatArray
    form: FloatArray
    mu: float
    lame: float
    shape: FloatArray


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
        self.kernels = _kernels()
        e, nu = material.youngs_modulus, material.poisson_ratio
        mu, lame = e / (2.0 * (1.0 + nu)), e * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))
        boxes = box_cells(body)
        cells = body.elements if boxes is None else boxes
        corners, count = body.vertices[cells], len(cells)
        if boxes is None:
            edges = corners[:, 1:] - corners[:, :1]
            inverse = np.linalg.inv(edges)
            gradients = np.concatenate([-inverse.sum(axis=2, keepdims=True), inverse], axis=2)
            size, form = body.measures, np.zeros((count, 0, 0))
        else:
            axes = np.einsum("ka,ckx->cax", _CORNERS / 8.0, corners)  # half edges
            half = np.linalg.norm(axes, axis=2)
            gradients = np.broadcast_to(_CORNERS.T / 8.0, (count, 3, 8)) / half[:, :, None]
            size = 8.0 * half.prod(axis=1)
            form = _hourglass_form(half, size, e, nu)
            gradients = np.concatenate([gradients, np.broadcast_to(_HOURGLASS, (count, 4, 8))], axis=1)
        self._share = None if boxes is None else _cell_of(body, boxes)
        self.data = VolumeData(
            np.array(cells, np.int64, order="C"),
            np.array(gradients, order="C"),
            np.array(size, np.float64),
            np.ones(count),
            np.array(form, order="C"),
            float(mu),
            float(lame),
            np.zeros((count, gradients.shape[1], 3)),
        )
        steep = (gradients[:, :3] ** 2).sum(axis=1) * (size * (lame + 2.0 * mu))[:, None]
        if boxes is not None:
            steep += np.einsum("cii->c", form)[:, None] / 64.0
        self.diagonal = np.asarray(np.bincount(cells.ravel(), steep.ravel(), len(body.vertices)), np.float64)

    def scale_stretch(self, factor: FloatArray | None) -> None:
        own = self.data.factor
        if factor is None:
            own[:] = 1.0
        elif self._share is None:
            own[:] = factor
        else:
            own[:] = np.bincount(self._share, factor, len(own)) / np.bincount(self._share, minlength=len(own))


@cache
def _kernels() -> Kernels:
    parts = {f.__name__: compiled(f, "solid") for f in (gather, scatter, hourglass)}
    forces = compiled(volume_forces, "solid", **parts)
    return kernels("solid", forces, compiled(volume_stiffness, "solid", **parts))


def gather(data: VolumeData, cell: int, vectors: FloatArray, out: FloatArray) -> None:
    """Set ``out (3 + M, 3)`` to F transposed and the other motions of a cell."""
    gradients, corners = data.gradients[cell], data.cells[cell]
    out[:] = 0.0
    for row in range(gradients.shape[0]):
        for c in range(len(corners)):
            for k in range(3):
                out[row, k] += gradients[row, c] * vectors[corners[c], k]


def scatter(data: VolumeData, cell: int, sign: float, load: FloatArray, out: FloatArray) -> None:
    """Add to ``out (V, 3)`` what ``load (3 + M, 3)``, as :func:`gather` sees it, does to a cell's corners."""
    gradients, corners = data.gradients[cell], data.cells[cell]
    for c in range(len(corners)):
        for row in range(gradients.shape[0]):
            for k in range(3):
                out[corners[c], k] += sign * gradients[row, c] * load[row, k]


def hourglass(data: VolumeData, cell: int, amplitudes: FloatArray, load: FloatArray) -> None:
    """Add to ``load`` the forces of ``amplitudes (12,)``, the hourglass motions in the rest frame."""
    form, shape = data.form[cell], data.shape[cell]
    for mode in range(4):
        for a in range(3):
            answer = 0.0
            for j in range(12):
                answer += form[3 * mode + a, j] * amplitudes[j]
            answer *= data.factor[cell]
            for k in range(3):
                load[3 + mode, k] += answer * shape[a, k]
                load[a, k] += answer * shape[3 + mode, k]


def volume_forces(data: VolumeData, positions: FloatArray, out: FloatArray) -> None:
    """Elastic nodal forces ``out (V, 3)`` [N]."""
    out[:] = 0.0
    load, amplitudes = np.empty(data.shape.shape[1:]), np.empty(12)
    for cell in range(len(data.cells)):
        shape = data.shape[cell]
        gather(data, cell, positions, shape)
        load[:] = 0.0
        for a in range(3):
            b, c = (a + 1) % 3, (a + 2) % 3
            for k in range(3):
                m, n = (k + 1) % 3, (k + 2) % 3
                load[a, k] = shape[b, m] * shape[c, n] - shape[b, n] * shape[c, m]  # cofactor
        volume = shape[0, 0] * load[0, 0] + shape[0, 1] * load[0, 1] + shape[0, 2] * load[0, 2]
        swell, weight = (data.lame + data.mu) * (volume - 1.0) - data.mu, data.size[cell] * data.factor[cell]
        for a in range(3):
            for k in range(3):
                load[a, k] = weight * (data.mu * shape[a, k] + swell * load[a, k])
        if len(shape) > 3:
            for mode in range(4):
                for a in range(3):
                    amplitudes[3 * mode + a] = 0.0
                    for k in range(3):
                        amplitudes[3 * mode + a] += shape[3 + mode, k] * shape[a, k]
            hourglass(data, cell, amplitudes, load)
        scatter(data, cell, -1.0, load, out)


def volume_stiffness(data: VolumeData, motion: FloatArray, out: FloatArray) -> None:
    """Stiffness times ``motion (V, 3)``."""
    out[:] = 0.0
    rate, load = np.empty(data.shape.shape[1:]), np.empty(data.shape.shape[1:])
    amplitudes, strain = np.empty(12), np.empty((3, 3))  # strain: twice the rate of Green's
    for cell in range(len(data.cells)):
        shape = data.shape[cell]
        gather(data, cell, motion, rate)
        for a in range(3):
            for b in range(3):
                strain[a, b] = 0.0
                for k in range(3):
                    strain[a, b] += shape[a, k] * rate[b, k] + rate[a, k] * shape[b, k]
        weight = data.size[cell] * data.factor[cell]
        swell = 0.5 * data.lame * (strain[0, 0] + strain[1, 1] + strain[2, 2])
        load[:] = 0.0
        for a in range(3):
            for k in range(3):
                load[a, k] = swell * shape[a, k]
                for b in range(3):
                    load[a, k] += data.mu * strain[a, b] * shape[b, k]
                load[a, k] *= weight
        if len(shape) > 3:
            for mode in range(4):
                for a in range(3):
                    amplitudes[3 * mode + a] = 0.0
                    for k in range(3):
                        amplitudes[3 * mode + a] += rate[3 + mode, k] * shape[a, k] + shape[3 + mode, k] * rate[a, k]
            hourglass(data, cell, amplitudes, load)
        scatter(data, cell, 1.0, load, out)


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
