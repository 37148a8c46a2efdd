"""Whether the measured points are a grid that covers a cloth, and how large that is."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..core.arrays import FloatArray
from ..core.errors import InputError
from ..core.measurement import Recording
from ..core.scenarios.spacing import MATTERS, off_places
from ..core.study import Problem

#: So many lines make a grid at least; so many vertices along each side make a mesh at least.
_FEWEST_LINES, _FEWEST_VERTICES = 3, 8
#: So much of the distances between neighbours must be within so much of the usual one.
_MOST, _ALIKE = 0.8, 0.2


@dataclass(frozen=True)
class Grid:
    """Points row by row, every ``every``-th vertex of a mesh, of which there are ``counts`` along a row and a column.

    Args:
        counts: vertices along a row, and along a column.
        every: from point to point.
        size: width and height [m], as far as the distances between neighbours tell.
        off: how far the points sit from those vertices, by their distances, root mean square [m].
    """

    counts: list[int]
    every: int
    size: list[float]
    off: float = 0.0

    @property
    def markers(self) -> list[int] | str:
        """The vertices under the points."""
        across, down = self.counts
        if self.every == 1:
            return "all"
        return [row * across + column for row in range(0, down, self.every) for column in range(0, across, self.every)]

    @property
    def uneven(self) -> bool:
        """Whether the points had better be placed by their distances."""
        return self.off > MATTERS

    def text(self, sized: bool) -> str:
        """What was found, for a person, who has said how large the cloth is or not."""
        across, down = ((n - 1) // self.every + 1 for n in self.counts)
        every = {1: "every", 2: "every other", 3: "every third", 4: "every fourth"}[self.every]
        size = "" if sized else f", of a cloth of {self.size[0]:g} x {self.size[1]:g} m by how far apart they are"
        off = f"; they sit {1e3 * self.off:.2g} mm from the even places that they are given" if self.uneven else ""
        return (
            f"the {across * down} points are a grid of {across} x {down} on {every} vertex along both sides{size}{off}"
        )


def seen_grid(recordings: Sequence[Recording]) -> Grid | None:
    """The grid that the points of ``recordings`` are, or None.

    Row by row, or column by column, as neighbours along rows and columns are as far apart as one another, in all but
    the few that a tracker pulls in at the edges.
    """
    series = [r.series for r in recordings]
    count = series[0].points.shape[1]
    if not all(s.correspondence and s.unit == "m" and s.points.shape[1:] == (count, 3) for s in series):
        return None
    points = np.concatenate([s.points for s in series])
    found: list[tuple[float, Grid]] = []
    for across in range(_FEWEST_LINES, count // _FEWEST_LINES + 1):
        if count % across:
            continue
        grid = points.reshape(len(points), -1, across, 3)
        steps = [_step(np.diff(grid, axis=axis)) for axis in (2, 1)]
        if steps[0] is not None and steps[1] is not None:
            lines = [across, count // across]
            every = -(-(_FEWEST_VERTICES - 1) // (min(lines) - 1))
            size = [round(step * (n - 1), 3) for step, n in zip(steps, lines, strict=True) if step is not None]
            found.append((steps[0] + steps[1], Grid([(n - 1) * every + 1 for n in lines], every, size)))
    # rows of half the length leap to and fro: of what is even enough, the grid has its neighbours nearest
    return min(found, key=lambda told: told[0])[1] if found else None


def laid_over(grid: Grid, problem: Problem) -> Grid | None:
    """The grid with how far its points are from their vertices; None if these are numbered some other way.

    Args:
        grid: that was seen.
        problem: of a study that has it.
    """
    across = (grid.counts[0] - 1) // grid.every + 1
    away = np.zeros(8)
    for name in problem.fit_on:
        scenario, first = problem.scenarios[name], problem.recordings[name].series.points[0]
        seen = np.isfinite(first).all(axis=1)
        if seen.any():
            places = (scenario.markers @ scenario.start_vertices()).reshape(-1, across, 3)
            away += [np.mean(np.linalg.norm(first - other, axis=1)[seen]) for other in _numbered_otherwise(places)]
    if not away.any() or np.argmin(away) > 0:
        return None
    try:
        off = off_places(problem.scenarios[problem.fit_on[0]], [problem.recordings[name] for name in problem.fit_on])
    except InputError:  # too few frames
        return grid
    return replace(grid, off=float(np.sqrt(np.mean(np.sum(off**2, axis=1)))))


def _numbered_otherwise(places: FloatArray) -> list[FloatArray]:
    """Where the points of a grid ``(R, C, 3)`` would be in all eight ways to number them; first as they are."""
    down, across = places.shape[:2]
    row, column = (v.ravel() for v in np.meshgrid(np.linspace(0, 1, down), np.linspace(0, 1, across), indexing="ij"))
    made = []
    for turned in (False, True):
        a, b = (column, row) if turned else (row, column)
        for u in (a, 1 - a):
            for v in (b, 1 - b):
                i, j = np.rint(u * (down - 1)).astype(int), np.rint(v * (across - 1)).astype(int)
                made.append(places[i, j])
    return made


def _step(between: FloatArray) -> float | None:
    """How far neighbours ``(T, ..., 3)`` are apart [m], if most are as far as one another."""
    apart = np.linalg.norm(between, axis=-1).reshape(len(between), -1)
    seen = np.isfinite(apart).any(axis=0)
    if not seen.any():
        return None
    usual = np.nanmedian(apart[:, seen], axis=0)
    step = float(np.median(usual))
    alike = np.abs(usual - step) <= _ALIKE * step
    return step if step > 0 and alike.sum() >= _MOST * len(seen) else None
