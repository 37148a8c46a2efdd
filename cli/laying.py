"""A flat sheet laid under the markers of the first frame, and which of its vertices the grippers hold."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..core.arrays import FloatArray
from ..core.measurement import Recording
from ..core.scenarios.laid import before_it_moves, rigid
from ..core.scenarios.preset import Preset
from ..core.study import Problem
from .unrolling import NEAREST, placed, unrolled

#: Markers lie in a plane if they spread out of it by less than this share of what they do along it, and are no line if
#: they spread beside it by more than that one.
_FLAT, _NARROW = 0.05, 0.1
#: The sheet hangs by an edge unless it would be smaller, by more than this share, hanging some other way.
_SMALLER = 0.1
#: In a plane less steep than this nothing hangs (cosine of the angle to the vertical).
_STEEP = 0.5
#: A gripper holds the sheet if it is no further from it than this share of its size, or of the spread of its markers,
#: nor than that one from the nearest marker.
_REACH, _FAR = 0.25, 0.5
#: Markers further than this share of its size from where a scenario puts an object are elsewhere.
_ELSEWHERE = 0.15
#: The upper of two edges hangs from a gripper that is nearer to the other by less than twice this share of the size.
_UPPER = 0.05
#: The sheet is as large as the person says unless the markers spread over more than this times that.
_LARGER = 1.05
#: Vertices along the shorter side, and at most along the longer one.
_SHORT, _LONG = 9, 17
#: Directions that are tried for an edge, over a right angle.
_DIRECTIONS = 360


@dataclass(frozen=True)
class Sheet:
    """A sheet, and where markers and grippers are on it.

    Args:
        size: width and height [m]; the width is along the edge that is held, or else the upper one.
        counts: vertices along them.
        markers: where they are on it, in its own frame ``[x, y, z]`` [m], as the scenario puts it there.
        grasps: for every gripper the vertices that it holds; None: those of the scenario.
        known: the size was given.
        bent: it is not flat as it starts.
        why: it is laid here, as far as it is worth a word.
    """

    size: list[float]
    counts: list[int]
    markers: list[list[float]]
    grasps: list[list[int]] | None
    known: bool
    bent: bool = False
    why: str = ""

    def text(self) -> str:
        """What was found, for a person."""
        known = "" if self.known else " or so, as far as they go (--size W,H if it is larger)"
        held = "".join(f"; gripper {g} holds vertex {v[0]}" for g, v in enumerate(self.grasps or []))
        size = f"{self.size[0]:g} x {self.size[1]:g} m{known}"
        return (
            f"the {len(self.markers)} points are on a {'bent' if self.bent else 'flat'} sheet of {size}, which starts "
            f"where they are in the first frame of each take{held}{'; ' if self.why else ''}{self.why}"
        )


@dataclass(frozen=True, eq=False)
class _Seen:
    """Where a take starts, on the sheet laid flat and about the middle of its markers.

    Args:
        points: markers ``(P, 2)`` [m].
        hands: grippers ``(G, 2)`` [m].
        up: how steeply the sheet rises along either axis, of length one if it is upright ``(2,)``.
        frames: how many there are before a gripper moves.
        off: how far markers are from a plane, as a share of their spread in it.
    """

    points: FloatArray
    hands: FloatArray
    up: FloatArray
    frames: int
    off: float

    @property
    def bent(self) -> bool:
        """Whether the sheet is not flat in space."""
        return self.off > _FLAT

    @property
    def covered(self) -> FloatArray:
        """What the sheet goes at least as far as: several grippers are at its rim, one may hold it by a bar."""
        return np.vstack([self.points, self.hands]) if len(self.hands) > 1 else self.points


def seen_sheet(base: Preset, recordings: Sequence[Recording], size: Sequence[float]) -> Sheet | None:
    """The sheet under the markers before a gripper moves, laid flat; None if it folds in every take.

    Args:
        base: the scenario, whose cloth hangs; it says what one gripper holds.
        recordings: that are fitted.
        size: width and height [m], if the person gave them.
    """
    if len({(r.series.points.shape[1:], r.series.correspondence, r.series.unit) for r in recordings}) > 1:
        return None
    frames = [frame for r in recordings if (frame := _flattened(r, size)) is not None]
    if not frames:
        return None
    flattest = min(frames, key=lambda frame: frame.off)
    seen = replace(flattest, points=_together(flattest, frames))
    first = _edge(seen)
    # which of its four edges is row 0
    turns = [_axes(angle) for angle in np.pi / 2 * np.arange(4)]
    laid = [sheet for turn in turns if (sheet := _laid(base, seen, turn @ first, size)) is not None]
    return min(laid, key=lambda sheet: sheet[0])[1] if laid else None


def why_elsewhere(problem: Problem) -> str | None:
    """Why the first frames do not go with how a scenario holds its object, or where it puts it; None if they do."""
    for name in problem.fit_on:
        scenario, recording = problem.scenarios[name], problem.recordings[name]
        if recording.gripper is not None and recording.gripper.grippers > len(scenario.grasps) > 0:
            return ""  # is said anyway
        vertices = scenario.start_vertices()
        size = float(np.ptp(vertices, axis=0).max())
        away = np.linalg.norm(recording.series.points[0][:, None] - vertices[None], axis=2).min(axis=1)
        if (away > _ELSEWHERE * size).any():
            return (
                f"{scenario.name!r} alone would start up to {np.nanmax(away):.2g} m from them: if that is unexpected, "
                "check --up, the unit and the gripper poses (x y z, then the quaternion w x y z)"
            )
    return None


def _flattened(recording: Recording, size: Sequence[float]) -> _Seen | None:
    """Markers before a gripper moves, on a flat sheet; None if they lie on none, or not all are seen."""
    series = recording.series
    if not series.correspondence or series.unit != "m":
        return None
    first, frames = before_it_moves(recording)
    if len(first) < 3 or not np.isfinite(first).all():
        return None
    middle = first.mean(axis=0)
    first = first - middle
    _, sizes, axes = np.linalg.svd(first)
    if sizes[1] < _NARROW * sizes[0]:
        return None
    off = float(sizes[2] / sizes[0])
    places = first @ axes[:2].T if off <= _FLAT else unrolled(first)
    if places is None:
        return None
    hands = np.zeros((0, 3))
    if recording.gripper is not None:
        hands = recording.gripper.at(series.time[:1])[0, :, :3] - middle
    if len(hands) > 1:
        spread = max([float(np.ptp(first @ axes[0])), *size])
        nearest = np.linalg.norm(hands[:, None] - first[None], axis=2).min(axis=1)
        if nearest.max() > _FAR * spread:
            return None  # of another object, or in other axes
    near = len(first) if off <= _FLAT else NEAREST
    held, beside = placed(hands, first, places, near)
    if len(hands) > 1 and beside.max() > _REACH * spread:
        return None
    rise = np.linalg.lstsq(places, first[:, 2], rcond=None)[0]
    return _Seen(places, held, rise, frames, off)


def _together(flattest: _Seen, frames: Sequence[_Seen]) -> FloatArray:
    """Where the markers are on the sheet ``(P, 2)`` in the mean of all takes, each frame counting for one."""
    places, *others = (np.pad(frame.points, ((0, 0), (0, 1))) for frame in (flattest, *frames))
    each = []
    for other in others:
        turn, shift = rigid(places, other)
        each.append(((other - shift) @ turn)[:, :2])
    return np.asarray(np.average(each, axis=0, weights=[frame.frames for frame in frames]))


def _edge(seen: _Seen) -> FloatArray:
    """Axes ``(2, 2)`` along the edges of the smallest rectangle about what is covered, or of that which hangs level."""
    angles = np.pi / 2 * np.arange(_DIRECTIONS) / _DIRECTIONS
    areas = [_area(seen.covered, _axes(a)) for a in angles]
    best = _axes(angles[int(np.argmin(areas))])
    if np.linalg.norm(seen.up) < _STEEP:
        return best
    level = _axes(np.arctan2(-seen.up[0], seen.up[1]))
    return level if _area(seen.covered, level) * (1.0 - _SMALLER) <= min(areas) else best


def _axes(angle: float) -> FloatArray:
    return np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])


def _area(points: FloatArray, axes: FloatArray) -> float:
    return float(np.prod(np.ptp(points @ axes.T, axis=0)))


def _laid(base: Preset, seen: _Seen, axes: FloatArray, size: Sequence[float]) -> tuple[float, Sheet] | None:
    """The sheet with its rows along the first of ``axes``, and how far from the grippers what they hold would be [m].

    Without grippers, how little its top edge is uppermost.
    """
    spread = seen.covered @ axes.T
    low, high = spread.min(axis=0), spread.max(axis=0)
    extent = [float(e) for e in size] or [round(float(e), 3) for e in high - low]
    if any(e > _LARGER * s for e, s in zip(high - low, extent, strict=True)):
        return None
    counts = [min(_LONG, round((_SHORT - 1) * e / min(extent)) + 1) for e in extent]
    body = base.body(extent, counts)
    # a sheet larger than its markers goes on as far on either side, and downwards from several grippers
    top = high[1] if len(seen.hands) > 1 else (low[1] + high[1] + extent[1]) / 2
    origin = np.array([(low[0] + high[0]) / 2, top])
    down = int(np.argmax(np.ptp(body.vertices[:, 1:], axis=0))) + 1  # it hangs along z, or lies along y
    places = body.vertices[:, [0, down]]
    points, hands = seen.points @ axes.T - origin, seen.hands @ axes.T - origin
    markers = [[round(float(x), 4), 0.0, round(float(y), 4)] for x, y in points]
    if down == 1:
        markers = [[x, y, z] for x, z, y in markers]
    sheet = Sheet(extent, counts, markers, None, bool(size), seen.bent)
    if not len(hands):
        return -float(axes[1] @ seen.up), sheet
    if len(hands) == 1:
        grasps = base.grasps(body)
        held = places[grasps[0]].mean(axis=0) if grasps else np.zeros(2)
        away = float(np.linalg.norm(hands[0] - held))
        return away - _UPPER * max(extent) * float(axes[1] @ seen.up), sheet  # a corner is of two edges
    apart = np.linalg.norm(hands[:, None] - places[None], axis=2)
    holding = [int(v) for v in np.argmin(apart, axis=1)]
    if apart.min(axis=1).max() > _REACH * max(extent) or len(set(holding)) < len(holding):
        return None
    return float(np.abs(hands[:, 1]).mean()), replace(sheet, grasps=[[v] for v in holding])
