"""Solids that are regular boxes, however turned: MuJoCo's quadratic cells have exactly their vertices as nodes."""

import numpy as np

from ...core.arrays import FloatArray, IntArray
from ...core.body import Body


def quadratic_cells(body: Body) -> tuple[int, int, int] | None:
    """Cells of a quadratic flex whose nodes are exactly the vertices of a regular box, if there are such."""
    if body.kind != "solid" or body.grid is None or len(body.grid) != 3 or any(n % 2 == 0 for n in body.grid):
        return None
    turn, counts = frame(body), np.array(body.grid)
    lattice = np.stack(np.meshgrid(*(np.linspace(0.0, 1.0, n) for n in counts), indexing="ij"), axis=-1).reshape(-1, 3)
    local = (body.vertices - body.vertices[0]) @ turn
    off = np.abs(local - lattice * local[-1]).max() if (local[-1] > 0).all() else np.inf
    if np.linalg.det(turn) < 0.0 or off > 1e-9 * np.abs(local).max():
        return None
    a, b, c = (int(n - 1) // 2 for n in counts)
    return (a, b, c)


def frame(body: Body) -> FloatArray:
    """The box's own axes as columns ``(3, 3)``; exactly those of the world if they nearly are."""
    assert body.grid is not None
    corners = body.vertices.reshape(*body.grid, 3)
    edges = np.stack([corners[-1, 0, 0], corners[0, -1, 0], corners[0, 0, -1]], axis=1) - corners[0, 0, 0][:, None]
    turn = edges / np.linalg.norm(edges, axis=0)
    return np.eye(3) if np.abs(turn - np.eye(3)).max() < 1e-12 else np.asarray(turn)


def cell_of_elements(body: Body, cells: tuple[int, int, int]) -> IntArray:
    """The quadratic cell ``(E,)`` in which every tetrahedron of a regular box lies, last axis fastest."""
    local = (body.vertices - body.vertices[0]) @ frame(body)
    middles = local[body.elements].mean(axis=1)
    index = np.floor(middles / local[-1] * cells).astype(np.int64)
    return np.asarray(np.ravel_multi_index(tuple(index.T), cells))
