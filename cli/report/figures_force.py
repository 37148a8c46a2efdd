"""The estimated missing force at its worst moment: arrows on the object."""

import numpy as np
from matplotlib.collections import LineCollection

from ...core.arrays import FloatArray, IntArray
from .figures_object import camera, round_length
from .style import AFTER, BEFORE, INK, SOFT, bare, data_uri, look, new_figure, png

#: Length of the longest arrow, as a share of the size of the object.
LONGEST = 0.3
#: Vertices that get an arrow at most; of more, the ones with the largest force.
ARROWS = 150
#: Forces smaller than so many of their standard deviations are drawn pale.
CLEAR = 2.0


def force_figure(
    vertices: FloatArray, triangles: IntArray, force: FloatArray, force_sd: FloatArray | None = None
) -> str:
    """PNG address of one moment: the mesh, and an arrow of the force on every vertex.

    Args:
        vertices: ``(V, 3)`` [m].
        triangles: ``(F, 3)``; none of a rope, which is a line through its vertices.
        force: ``(V, 3)`` [N].
        force_sd: its standard deviation; what is not clearly off zero is drawn pale.
    """
    view = _best_view(vertices, force)
    flat, push = vertices @ view[:2].T, force @ view[:2].T
    size, strength = np.linalg.norm(force, axis=1), float(np.linalg.norm(force, axis=1).max())
    extent = max(float(np.ptp(vertices, axis=0).max()), 1e-9)
    arrows = push * (LONGEST * extent / strength if strength > 0 else 0.0)
    shown = np.argsort(-size, kind="stable")[:ARROWS]
    clear = np.ones(len(force), bool) if force_sd is None else size > CLEAR * np.linalg.norm(force_sd, axis=1)
    lines = _edges(triangles, len(vertices))
    with look():
        figure = new_figure(5.0, 4.4)
        axes = figure.subplots()
        axes.add_collection(LineCollection(list(flat[lines]), colors=SOFT, linewidths=0.5, alpha=0.6, zorder=1))
        for some, colour, alpha in ((shown[~clear[shown]], BEFORE, 0.25), (shown[clear[shown]], BEFORE, 0.95)):
            axes.quiver(
                *flat[some].T, *arrows[some].T, angles="xy", scale_units="xy", scale=1.0, color=colour, alpha=alpha,
                width=0.004, zorder=2,
            )  # fmt: skip
        reach = np.concatenate([flat, flat[shown] + arrows[shown]])
        low, high = reach.min(axis=0), reach.max(axis=0)
        margin = 0.05 * float((high - low).max()) + 1e-9
        if strength > 0:
            told = round_length(strength)
            end = float(low[0] + LONGEST * extent * told / strength)
            axes.plot([low[0], end], [low[1] - margin, low[1] - margin], color=AFTER, linewidth=2.0)
            axes.annotate(f"{told:.2g} N", (low[0], low[1] - margin), (0, 4), textcoords="offset points", color=INK)
        axes.set_xlim(float(low[0] - margin), float(high[0] + margin))
        axes.set_ylim(float(low[1] - 2 * margin), float(high[1] + margin))
        axes.set_aspect("equal")
        bare(axes)
        return data_uri(png(figure, 150))


def _edges(triangles: IntArray, count: int) -> IntArray:
    """Pairs of vertices ``(N, 2)`` to join by lines."""
    if not len(triangles):
        return np.stack([np.arange(count - 1), np.arange(1, count)], axis=1)
    sides = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    return np.unique(np.sort(sides, axis=1), axis=0)


def _best_view(vertices: FloatArray, force: FloatArray) -> FloatArray:
    """The view ``(3, 3)`` from which one sees most of the object and of the force on it."""
    best, view = -np.inf, camera(-1.0, 0.3)
    scale = max(float(np.ptp(vertices, axis=0).max()), 1e-9)
    largest = max(float(np.abs(force).max()), 1e-300)
    for azimuth in np.radians(np.arange(-170.0, 180.0, 10.0)):
        rows = camera(azimuth, 0.3)
        area = max(float(np.linalg.det(np.cov(rows[:2] @ (vertices / scale).T))), 0.0) ** 0.25
        seen = area + float(np.sqrt(((force / largest @ rows[:2].T) ** 2).sum(axis=1).mean()))
        if seen > best:
            best, view = seen, rows
    return view
