"""Smooth accelerations in time and over a mesh: the functions that an unknown force is put together from."""

from dataclasses import dataclass

import numpy as np
from scipy import linalg, sparse
from scipy.sparse.linalg import eigsh

from ....core.arrays import FloatArray, IntArray
from ....core.body import Body

#: A wave over the whole object and one of this half period are equally rough [s].
HALF_PERIOD = 0.25
#: Functions of time and modes of the mesh to choose from.
MOST_TIMES, MOST_MODES = 16, 12
#: Larger meshes are not decomposed as dense matrices.
_DENSE = 800


@dataclass(frozen=True, eq=False)
class Basis:
    """Products of a mode of the mesh and a cosine of time, along each axis: K functions.

    Args:
        modes: ``(V, P)``, orthonormal under the share of each vertex in the object.
        weights: those shares ``(V,)``, adding up to one; zero where a gripper holds.
        start, end: of the recording [s]; before and after, the force stays as it is there.
        pairs: mode and cosine of every function, ``(K / 3, 2)``; function 3 k + a is pair k along axis a.
        roughness: of every pair ``(K / 3,)``: squared wave number in space and time.
    """

    modes: FloatArray
    weights: FloatArray
    start: float
    end: float
    pairs: IntArray
    roughness: FloatArray

    def __len__(self) -> int:
        return 3 * len(self.pairs)

    def cosines(self, times: FloatArray) -> FloatArray:
        """``(T, Q)`` at ``times (T,)`` [s], of mean square one."""
        share = np.clip((times - self.start) / (self.end - self.start), 0.0, 1.0)
        order = np.arange(int(self.pairs[:, 1].max()) + 1)
        return np.asarray(np.where(order > 0, np.sqrt(2.0), 1.0) * np.cos(np.pi * order * share[:, None]))

    def table(self, coefficients: FloatArray) -> FloatArray:
        """Coefficients ``(K,)`` [m/s2] by cosine, mode and axis ``(Q, P, 3)``."""
        out = np.zeros((int(self.pairs[:, 1].max()) + 1, self.modes.shape[1], 3))
        out[self.pairs[:, 1], self.pairs[:, 0]] = coefficients.reshape(-1, 3)
        return out

    def accelerations(self, times: FloatArray, coefficients: FloatArray) -> FloatArray:
        """``(T, V, 3)`` [m/s2]."""
        modal = np.einsum("tq,qpx->tpx", self.cosines(times), self.table(coefficients))
        return np.asarray(np.einsum("vp,tpx->tvx", self.modes, modal))

    def project(self, times: FloatArray, accelerations: FloatArray) -> FloatArray:
        """Coefficients ``(K,)`` [m/s2] that come nearest to ``accelerations (T, V, 3)``, by least squares."""
        weighted = self.modes * self.weights[:, None]
        modal = np.linalg.lstsq(weighted.T @ self.modes, weighted.T, rcond=1e-6)[0]
        values = np.einsum("pv,tvx->tpx", modal, accelerations)
        cosines, out = self.cosines(times), np.zeros((len(self.pairs), 3))
        for mode in np.unique(self.pairs[:, 0]):
            mine = self.pairs[:, 0] == mode
            out[mine] = np.linalg.lstsq(cosines[:, self.pairs[mine, 1]], values[:, mode], rcond=1e-6)[0]
        return out.ravel()


def make_basis(body: Body, held: IntArray, times: FloatArray, size: int, markers: int) -> Basis:
    """The ``size`` smoothest functions on a body.

    Args:
        body: the mesh.
        held: vertices ``(H,)`` that a gripper holds.
        times: of the recording ``(T,)`` [s].
        size: functions, a multiple of three.
        markers: points seen; there are no more modes than these can tell apart.
    """
    free = np.setdiff1d(np.arange(len(body.vertices)), held)
    weights = np.zeros(len(body.vertices))
    weights[free] = body.vertex_measures[free] / body.vertex_measures[free].sum()
    count = max(1, min(MOST_MODES, len(free), markers))
    waves, modes = mesh_modes(body, count)
    duration = float(times[-1] - times[0])
    rough = (waves[:, None] ** 2) + (np.arange(min(MOST_TIMES, len(times))) * HALF_PERIOD / duration) ** 2
    order = np.argsort(rough, axis=None, kind="stable")[: size // 3]
    pairs = np.stack(np.unravel_index(order, rough.shape), axis=1).astype(np.int64)
    used = int(pairs[:, 0].max()) + 1
    return Basis(modes[:, :used], weights, float(times[0]), float(times[-1]), pairs, rough.ravel()[order])


def mesh_modes(body: Body, count: int) -> tuple[FloatArray, FloatArray]:
    """The lowest modes of the graph Laplacian of a mesh, weighed by what each vertex stands for.

    Eigenvectors of L y = s M y, with the Laplacian L of the edges, weighed by their inverse squared length, and
    M of the vertices: Fourier modes of a mesh (Taubin 1995, "A signal processing approach to fair surface design").

    Returns:
        Half waves over the object ``(count,)``, rising from zero, counted in the first mode that is not constant;
        and the modes ``(V, count)`` of mean square one.
    """
    number = len(body.vertices)
    share = body.vertex_measures / body.vertex_measures.sum()
    first, second = body.edges.T
    stiff = 1.0 / body.edge_lengths(body.vertices) ** 2 * np.sqrt(share[first] * share[second])
    joined = sparse.coo_matrix((stiff, (first, second)), (number, number))
    joined = joined + joined.T
    laplacian = sparse.diags(np.asarray(joined.sum(axis=1)).ravel()) - joined
    root = sparse.diags(1.0 / np.sqrt(share))
    scaled = (root @ laplacian @ root).tocsc()
    if number <= _DENSE:
        values, vectors = linalg.eigh(scaled.toarray(), subset_by_index=[0, min(count, number - 1)])
    else:
        start = np.random.default_rng(0).normal(size=number)  # the same modes every time
        values, vectors = eigsh(scaled, count + 1, sigma=-1e-3 * float(scaled.diagonal().mean()), v0=start)
        order = np.argsort(values)
        values, vectors = values[order], vectors[:, order]
    modes = vectors / np.sqrt(share)[:, None]
    modes = modes * np.where(modes[np.argmax(np.abs(modes), axis=0), np.arange(modes.shape[1])] < 0, -1.0, 1.0)
    squared = np.maximum(values, 0.0)
    waves = np.sqrt(squared / squared[1]) if len(squared) > 1 and squared[1] > 0 else np.zeros(len(squared))
    return np.asarray(waves[:count]), np.asarray(modes[:, :count])
