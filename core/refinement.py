"""The same object on a mesh of half the spacing, to see how far a coarse one is from converged."""

from dataclasses import replace

import numpy as np

from .arrays import FloatArray, IntArray
from .bending import inner_places
from .body import Body
from .clamps import clamped_segments
from .interpolation import interpolate
from .kept_bend import KeptBend
from .scenario import Scenario


def refined(scenario: Scenario) -> Scenario | None:
    """Every edge of a cloth or rope halved; markers, grasps and loads stay where they are. None for other kinds.

    A new vertex between two that the same gripper holds is held, too.
    """
    old = scenario.body
    if old.kind not in ("cloth", "rope"):
        return None
    count, edges = len(old.vertices), old.edges
    if old.kind == "rope":  # vertices are numbered along it
        kept, middles = 2 * np.arange(count), 2 * np.arange(count - 1) + 1
        chain = np.arange(2 * count - 2)
        elements, warp, grid = np.stack([chain, chain + 1], axis=1), None, (2 * count - 1,)
    else:
        kept, middles = np.arange(count), count + np.arange(len(edges))
        elements, warp, grid = _quartered(old, middles), _warp_of_parts(old.warp), None
    vertices = np.empty((count + len(edges), 3))
    vertices[kept], vertices[middles] = old.vertices, old.vertices[edges].mean(axis=1)
    markers = np.zeros((len(scenario.markers), len(vertices)))
    markers[:, kept] = scenario.markers
    grasps = [np.concatenate([kept[ids], middles[np.isin(edges, ids).all(axis=1)]]) for ids in scenario.grasps]
    body = replace(old, vertices=vertices, elements=elements, warp=warp, grid=grid)
    return replace(
        scenario,
        body=body,
        grasps=tuple(grasps),
        markers=markers,
        load_vertices=kept[scenario.load_vertices],
        kept=None if scenario.kept is None else _halved(scenario.kept, body, np.concatenate(grasps)),
    )


def _halved(bend: KeptBend, body: Body, held: IntArray) -> KeptBend:
    """The bend at the inner vertices of a rope whose segments were halved; within a clamp there is none."""
    old = np.arange(1.0, len(bend.along) + 1)
    new = 0.5 * np.arange(1.0, len(body.vertices) - 1, dtype=np.float64)
    clamped = clamped_segments(body, held)
    free = np.where(clamped[1:] & clamped[:-1], 0.0, 1.0)[:, None]

    def finer(values: FloatArray) -> FloatArray:
        """``(..., N, 2)`` at the new vertices."""
        return free * np.moveaxis(interpolate(new, old, np.moveaxis(values, -2, 0)), 0, -2)

    parts = (bend.shapes, bend.rates, bend.moments, bend.torsion)
    shapes, rates, moments, torsion = (finer(values) for values in parts)
    return KeptBend(shapes, rates, moments, torsion, bend.told_at, inner_places(body))


def _quartered(body: Body, middles: IntArray) -> IntArray:
    """Four triangles ``(4 E, 3)`` for each, by the ``middles`` of the edges."""
    of = {(int(a), int(b)): int(m) for (a, b), m in zip(body.edges, middles, strict=True)}
    of |= {(b, a): m for (a, b), m in of.items()}
    out = []
    for a, b, c in body.elements.tolist():
        ab, bc, ca = of[a, b], of[b, c], of[c, a]
        out += [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
    return np.array(out, dtype=np.int64)


def _warp_of_parts(warp: FloatArray | None) -> FloatArray | None:
    """Shares ``(4 E, 2)`` of the edges of the four parts of every triangle that point as ``warp (E, 2)`` does.

    Three parts are the triangle itself, half as large. In the middle one, with corners ab, bc and ca, the first edge
    is (c - a) / 2 and the second (c - b) / 2.
    """
    if warp is None:
        return None
    inner = np.stack([warp[:, 0] + warp[:, 1], -warp[:, 0]], axis=1)
    return np.asarray(np.stack([warp, warp, warp, inner], axis=1).reshape(-1, 2))
