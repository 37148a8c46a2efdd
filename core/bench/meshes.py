"""Meshes of the virtual tests: strips along the grid, diagonal and irregular, and a round sheet."""

from typing import Literal

import numpy as np

from ..arrays import FloatArray
from ..body import Body

Style = Literal["grid", "diagonal", "irregular"]
#: How far a vertex of an irregular mesh is moved, over the size of a cell.
_JITTER = 0.25
_SEED = 20


def strip(low: float, high: float, width: float, cells: tuple[int, int], style: Style = "grid") -> Body:
    """A level strip at z = 0 along x, centred on y = 0; the warp runs along x.

    Args:
        low: x of its start [m]. If it is below zero, a row of vertices must fall on x = 0 to be held.
        high: x of its end [m].
        width: [m].
        cells: along and across.
        style: ``"grid"``: squares cut by alternating diagonals. ``"diagonal"``: with a vertex in every cell,
            which is a square grid at 45 degrees. ``"irregular"``: vertices moved at random, but for those on
            the rim and on x = 0, which slide along it; diagonals at random.
    """
    x, y = np.linspace(low, high, cells[0] + 1), np.linspace(-width / 2, width / 2, cells[1] + 1)
    xx, yy = np.meshgrid(x, y, indexing="ij")
    index = np.arange(xx.size).reshape(xx.shape)
    a, b, c, d = index[:-1, :-1].ravel(), index[1:, :-1].ravel(), index[1:, 1:].ravel(), index[:-1, 1:].ravel()
    one = (np.add.outer(np.arange(cells[0]), np.arange(cells[1])) % 2 == 0).ravel()
    points = np.stack([xx.ravel(), yy.ravel(), np.zeros(xx.size)], axis=1)
    if style == "diagonal":
        middle = len(points) + np.arange(len(a))
        points = np.concatenate([points, (points[a] + points[c]) / 2])
        sides = [(a, b), (b, c), (c, d), (d, a)]
        return Body("cloth", points, np.concatenate([np.stack([p, q, middle], axis=1) for p, q in sides]))
    if style == "irregular":
        rng = np.random.default_rng(_SEED)
        moved = rng.uniform(-_JITTER, _JITTER, (len(points), 2)) * [(high - low) / cells[0], width / cells[1]]
        on_line = np.min(np.abs(points[:, :1] - [low, 0.0, high]), axis=1) < 1e-9
        moved[on_line, 0] = 0.0
        moved[np.abs(points[:, 1]) > width / 2 - 1e-9, 1] = 0.0
        points[:, :2] += moved
        one = rng.random(len(one)) < 0.5
    first = np.where(one[:, None], np.stack([a, b, c], axis=1), np.stack([a, b, d], axis=1))
    second = np.where(one[:, None], np.stack([a, c, d], axis=1), np.stack([b, c, d], axis=1))
    return Body("cloth", points, np.concatenate([first, second]))


def disc(radius: float, rings: int) -> Body:
    """A level round sheet at z = 0: ring k has 6 k vertices, turned at random, so that no fold is preferred."""
    rng = np.random.default_rng(_SEED)
    points: list[FloatArray] = [np.zeros((1, 3))]
    triangles: list[tuple[int, int, int]] = []

    def vertex(ring: int, place: int) -> int:
        return 1 + 3 * ring * (ring - 1) + place % (6 * ring) if ring else 0

    for k in range(1, rings + 1):
        turn = 2 * np.pi * (np.arange(6 * k) + rng.uniform(-_JITTER, _JITTER)) / (6 * k)
        r = radius * k / rings
        points.append(np.stack([r * np.cos(turn), r * np.sin(turn), 0 * turn], axis=1))
        for s in range(6):
            for j in range(k):
                inner, outer = vertex(k - 1, s * (k - 1) + j), s * k + j
                triangles.append((inner, vertex(k, outer), vertex(k, outer + 1)))
                if j < k - 1:
                    triangles.append((inner, vertex(k, outer + 1), vertex(k - 1, s * (k - 1) + j + 1)))
    return Body("cloth", np.concatenate(points), np.array(triangles, np.int64))
