"""Test statistics of residuals: how large they are, where, and whether neighbours in time and space go together."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.spatial import cKDTree

from ....core.arrays import FloatArray, IntArray
from .groups import Partition
from .held import Held
from .sayings import where

#: Successive frames that are averaged.
FRAMES = (4, 16)
#: Points that are averaged: a point and its nearest ones in the rest shape.
NEIGHBOURS = 4


@dataclass(frozen=True, eq=False)
class Statistic:
    """A sum of squares of weighted means of residuals; each has expectation one if they are white of variance one.

    Args:
        name: what it sees, in words.
        rows: ``(K, N)``, of norm one.
        relative: divided by the mean square of all residuals, so that it does not depend on the strength of the noise.
    """

    name: str
    rows: sparse.csr_array
    relative: bool

    def of(self, residuals: FloatArray) -> FloatArray:
        """Mean squares ``(R,)`` of residuals ``(N, R)``; relative ones are one where there are no residuals at all."""
        mean = ((self.rows @ residuals) ** 2).mean(axis=0)
        if not self.relative:
            return np.asarray(mean)
        total = (residuals**2).mean(axis=0)
        return np.asarray(np.divide(mean, total, out=np.ones_like(mean), where=total > 0.0))


def all_statistics(takes: Sequence[Held], sorted_by: Sequence[Partition]) -> list[Statistic]:
    """Statistics of the residuals of ``takes``, one recording after the other, each in the order of ``held.seen``.

    Args:
        takes: fitted recordings.
        sorted_by: partitions of these.
    """
    size = sum(int(h.seen.sum()) for h in takes)
    out = [Statistic("the error as a whole", sparse.eye_array(size, format="csr"), relative=False)]
    for p in sorted_by:
        labels = np.concatenate(
            [np.broadcast_to(x[..., None], h.seen.shape)[h.seen] for x, h in zip(p.labels, takes, strict=True)]
        )
        for k, name in enumerate(p.names):
            inside = np.flatnonzero(labels == k)
            if 0 < len(inside) < size:
                out.append(Statistic(_said(p.title, name), _select(inside, size), relative=False))
    for frames in (1, *FRAMES, 0):
        for points in (1, NEIGHBOURS, 0):
            if (frames, points) != (1, 1):
                parts = [_smooth(h, frames, points) for h in takes]
                rows = sparse.block_diag(parts, format="csr")
                name = f"residuals that go together over {_spans(frames, points)}"
                out.append(Statistic(name, sparse.csr_array(rows), relative=True))
    return [s for s in out if s.rows.shape[0]]


def _said(title: str, name: str) -> str:
    return f"the error in recording {name}" if title == "recording" else f"the error {where(name)}"


def _spans(frames: int, points: int) -> str:
    time = {0: "all frames", 1: ""}.get(frames, f"{frames} frames")
    space = {0: "all points", 1: ""}.get(points, "neighbouring points")
    return " and ".join(x for x in (space, time) if x)


def _select(which: IntArray, size: int) -> sparse.csr_array:
    ones = np.ones(len(which))
    return sparse.csr_array((ones, (np.arange(len(which)), which)), shape=(len(which), size))


def _smooth(held: Held, frames: int, points: int) -> sparse.csr_array:
    """Means over ``frames`` frames and ``points`` points of one recording; 0 for all of them. Rows of norm one."""
    times, count, axes = len(held.partner), held.shown.series.points.shape[1], held.seen.shape[2]
    if frames == 0:
        in_time = sparse.csr_array(np.ones((1, times)))
    else:
        block = np.arange(times) // frames
        in_time = sparse.csr_array((np.ones(times), (block, np.arange(times))))
    in_space = sparse.csr_array(np.ones((1, count)) if points == 0 else _neighbours(held, points))
    cells = sparse.kron(sparse.kron(in_time, in_space), sparse.eye_array(axes), format="csr")
    points_of = np.broadcast_to(held.partner[..., None], held.seen.shape)
    index = (np.arange(times)[:, None, None] * count + points_of) * axes + np.arange(axes)
    seen = index[held.seen]
    put = sparse.csr_array((np.ones(len(seen)), (seen, np.arange(len(seen)))), shape=(times * count * axes, len(seen)))
    rows = sparse.csr_array(cells @ put)
    norm = np.sqrt(rows.multiply(rows).sum(axis=1))
    kept = norm > 0
    return sparse.csr_array(sparse.diags_array(1.0 / norm[kept]) @ rows[kept])


def _neighbours(held: Held, points: int) -> sparse.csr_array:
    body = held.scenario.body
    places = held.scenario.markers @ body.vertices if held.marked else body.vertices[held.usual_vertex]
    near = cKDTree(places).query(places, k=min(points, len(places)))[1].reshape(len(places), -1)
    rows = np.repeat(np.arange(len(places)), near.shape[1])
    return sparse.csr_array((np.ones(near.size), (rows, near.ravel())), shape=(len(places), len(places)))
