"""The object at its worst moment: the predicted mesh coloured by error, and where the points really were."""

from dataclasses import dataclass, field, replace
from textwrap import fill

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import Normalize
from matplotlib.figure import FigureBase

from ...core.arrays import FloatArray, IntArray
from .compared import distance
from .findings import Take
from .style import ERROR_MAP, INK, SOFT, bare, data_uri, look, new_figure, png
from .words import plain, shown_unit

_ELEVATIONS = (8.0, 16.0, 26.0, 36.0)
#: The colour scale reaches at least so many standard deviations of the noise.
_PALE = 8.0
_EDGE = (0.12, 0.15, 0.18, 0.28)
#: Of the picture's height: so wide it is at least, that titles fit; an object smaller than this is drawn as points.
_NARROWEST, _SPECK = 0.6, 0.02
#: Letters of a line of a title, as many as fit over a picture.
_WIDEST = 44


@dataclass(frozen=True, eq=False)
class Snapshot:
    """One model at one moment, in three dimensions.

    Args:
        title: of the picture.
        predicted, measured: ``(P, 3)``.
        vertices: ``(V, 3)`` or None.
        triangles: ``(F, 3)`` or None; none of a rope, which is a line through its vertices.
        correspondence: measured point p is predicted point p.
        clamped: vertices that cannot be wrong, because they never move.
        outlines: of what stands around the object, lines ``(n, 3)``.
        in_picture: points are known in the plane y = 0 only, and the mesh in front of and behind it.
    """

    title: str
    predicted: FloatArray
    measured: FloatArray
    vertices: FloatArray | None
    triangles: IntArray | None
    correspondence: bool = True
    clamped: IntArray = field(default_factory=lambda: np.zeros(0, np.int64))
    outlines: tuple[FloatArray, ...] = ()
    in_picture: bool = False

    @property
    def paired(self) -> bool:
        return self.correspondence and self.predicted.shape == self.measured.shape

    def errors(self) -> FloatArray:
        """Distance ``(P,)`` of each predicted point to its measured one.

        Of a point that was measured along some axes only, the distance along these; NaN of one that was not seen.
        Without correspondence, how far the nearest measured one is from the object: what no camera saw is not wrong.
        """
        if self.paired:
            return distance(self.predicted - self.measured)
        gaps = self._gaps()
        if not gaps.size:
            return np.full(len(self.predicted), np.nan)
        return np.asarray(gaps.min(axis=0)[gaps.argmin(axis=1)])

    def distances(self) -> FloatArray:
        """Distance of each point that was measured ``(N,)`` to its predicted one, or to the nearest."""
        errors = self.errors() if self.paired else self._gaps().min(axis=0)
        return np.asarray(errors[np.isfinite(errors)])

    def places(self) -> FloatArray:
        """Where the measured points are drawn ``(P, 3)``: along axes that were not seen, where they are predicted."""
        if not self.paired:
            return self.measured
        seen = np.isfinite(self.measured)
        return np.where(seen.any(axis=1, keepdims=True) & ~seen, self.predicted, self.measured)

    def _gaps(self) -> FloatArray:
        """From each predicted point to each that was measured ``(Q, N)``."""
        seen = self.measured[np.isfinite(self.measured).all(axis=1)]
        return np.asarray(np.linalg.norm(self.predicted[:, None] - seen[None], axis=2))

    def vertex_errors(self) -> FloatArray:
        """Error ``(V,)`` spread from the points over the mesh by inverse distance."""
        assert self.vertices is not None
        errors = self.errors()
        known = np.isfinite(errors)
        if not known.any():
            return np.zeros(len(self.vertices))
        places = np.concatenate([self.predicted[known], self.vertices[self.clamped]])
        errors = np.concatenate([errors[known], np.zeros(len(self.clamped))])
        apart = self.vertices[:, None] - places[None]
        gaps = np.linalg.norm(apart[..., [0, 2]] if self.in_picture else apart, axis=2)
        scale = max(float(np.ptp(self.vertices, axis=0).max()), 1e-9)
        weights = 1.0 / (gaps + 0.01 * scale) ** 3
        return np.asarray(weights @ errors / weights.sum(axis=1))


def snapshots(take: Take, after_name: str, frame: int | None = None) -> list[Snapshot]:
    """Before, and after where there is one, at the worst moment of before."""
    k = take.worst_frame if frame is None else frame
    if take.measured is None or take.predicted is None:
        return []
    flat = None if take.vertices is None or take.triangles is None else take.vertices[k]
    out = [Snapshot("fitted model", take.predicted[k], take.measured[k], flat, take.triangles)]
    if take.predicted_after is not None and after_name:
        flat = None if take.vertices_after is None or take.triangles is None else take.vertices_after[k]
        out.append(Snapshot(f"with {after_name}", take.predicted_after[k], take.measured[k], flat, take.triangles))
    clamped = clamped_vertices(take.vertices)
    shown = [replace(s, correspondence=take.correspondence, clamped=clamped, outlines=take.outlines) for s in out]
    return [_spatial(s, take.unit) for s in shown]


def clamped_vertices(vertices: FloatArray | None) -> IntArray:
    """Vertices that stay where they are over all time."""
    if vertices is None:
        return np.zeros(0, np.int64)
    return np.flatnonzero(np.ptp(vertices, axis=0).max(axis=1) < 1e-6)


def _spatial(s: Snapshot, unit: str) -> Snapshot:
    """Three dimensions of two: points lie in the plane y = 0 with the second axis up; in a picture it points down."""
    up = -1.0 if unit == "px" else 1.0

    def pad(x: FloatArray) -> FloatArray:
        if x.shape[1] == 2:
            return np.stack([x[:, 0], np.zeros(len(x)), up * x[:, 1]], axis=1)
        return np.stack([x[:, 0], x[:, 2], up * x[:, 1]], axis=1) if unit == "px" else x

    vertices = None if s.vertices is None else pad(s.vertices)
    flat = s.measured.shape[1] == 2
    return replace(s, predicted=pad(s.predicted), measured=pad(s.measured), vertices=vertices, in_picture=flat)


def camera(azimuth: float, elevation: float) -> FloatArray:
    """Rows right, up and towards the eye ``(3, 3)`` of a level view; angles in radians."""
    ca, sa, ce, se = np.cos(azimuth), np.sin(azimuth), np.cos(elevation), np.sin(elevation)
    return np.array([[-sa, ca, 0.0], [-ca * se, -sa * se, ce], [ca * ce, sa * ce, se]])


def best_view(shots: list[Snapshot]) -> FloatArray:
    """The view from which one sees most of every object and of the error of the first."""
    first = shots[0]
    if first.in_picture:  # from where it was taken
        return camera(-0.5 * np.pi, 0.0)
    gaps = first.places() - first.predicted if first.paired else np.zeros((1, 3))
    gaps = gaps[np.isfinite(gaps).all(axis=1)]
    clouds = [s.predicted if s.vertices is None else s.vertices for s in shots]
    best, view = -np.inf, camera(-1.0, 0.3)
    for elevation in np.radians(_ELEVATIONS):
        for azimuth in np.radians(np.arange(-175.0, 180.0, 5.0)):
            rows = camera(azimuth, elevation)
            areas = [np.linalg.det(np.cov(rows[:2] @ c.T)) for c in clouds]
            seen = float(np.mean([max(a, 0.0) ** 0.25 for a in areas]))
            error = float(np.sqrt(((gaps @ rows[:2].T) ** 2).sum(axis=1).mean())) if len(gaps) else 0.0
            score = (seen + error) * (1.0 + 0.04 * np.cos(azimuth + 1.0))  # of equals, the customary side
            if score > best:
                best, view = score, rows
    return view


def draw_snapshot(axes: Axes, shot: Snapshot, norm: Normalize, view: FloatArray, speck: bool = False) -> None:
    """One snapshot in parallel projection, far triangles first; the points, too, of a ``speck``, too small to see."""
    flat = shot.predicted @ view.T
    around = [(line @ view.T)[:, :2] for line in shot.outlines]
    axes.add_collection(LineCollection(around, colors=SOFT, linewidths=0.7, alpha=0.6, zorder=0))
    if shot.vertices is not None and shot.triangles is not None:
        seen, errors = shot.vertices @ view.T, shot.vertex_errors()
        if not len(shot.triangles):
            colours = ERROR_MAP(norm(0.5 * (errors[1:] + errors[:-1])))
            pieces = list(np.stack([seen[:-1, :2], seen[1:, :2]], axis=1))
            rim = LineCollection(pieces, colors=SOFT, linewidths=4.6, capstyle="round", zorder=1)
            axes.add_collection(rim)
            axes.add_collection(LineCollection(pieces, colors=colours, linewidths=3.6, capstyle="round", zorder=1))
        order = np.argsort(seen[shot.triangles, 2].mean(axis=1))
        faces = shot.triangles[order]
        colours = ERROR_MAP(norm(errors[faces].mean(axis=1)))
        axes.add_collection(
            PolyCollection(list(seen[faces][..., :2]), facecolors=colours, edgecolors=_EDGE, linewidths=0.35, zorder=1)
        )
    if shot.vertices is None or shot.triangles is None or speck:
        colours = ERROR_MAP(norm(np.nan_to_num(shot.errors())))
        axes.scatter(flat[:, 0], flat[:, 1], c=colours, s=26, edgecolors=SOFT, linewidths=0.3, zorder=1)
    there = shot.places() @ view.T
    if shot.paired:
        pairs = np.stack([flat[:, :2], there[:, :2]], axis=1)
        pairs = pairs[np.isfinite(pairs).all(axis=(1, 2))]
        axes.add_collection(LineCollection(list(pairs), colors=INK, linewidths=0.6, alpha=0.7, zorder=2))
    axes.scatter(there[:, 0], there[:, 1], color=INK, s=8, linewidths=0, zorder=3)


def window(shots: list[Snapshot], view: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Low and high corner ``(2,)`` of everything drawn, with a margin, and not too narrow."""
    parts = [p for s in shots for p in (s.predicted, s.places(), s.vertices) if p is not None]
    flat = np.concatenate(parts) @ view[:2].T
    low, high = np.nanmin(flat, axis=0), np.nanmax(flat, axis=0)
    margin = 0.04 * float((high - low).max()) + 1e-9
    margins = np.array([max(margin, 0.5 * (_NARROWEST * float(high[1] - low[1]) - float(high[0] - low[0]))), margin])
    return low - margins, high + margins


def add_snapshots(figure: FigureBase, spots: list[Axes], shots: list[Snapshot], take: Take) -> None:
    """Draw snapshots that share one view, one window and one colour scale."""
    factor, label = shown_unit(take.unit)
    top = heat_top(np.concatenate([s.errors() for s in shots]), take.noise)
    norm, view = Normalize(0.0, top), best_view(shots)
    low, high = window(shots, view)
    for axes, shot in zip(spots, shots, strict=True):
        size = 0.0 if shot.vertices is None else float(np.ptp(shot.vertices, axis=0).max())
        draw_snapshot(axes, shot, norm, view, size < _SPECK * float(high[1] - low[1]))
        axes.set_xlim(float(low[0]), float(high[0]))
        axes.set_ylim(float(low[1]), float(high[1]))
        axes.set_aspect("equal")
        bare(axes)
        far = shot.distances()
        away = f"points {plain(float(np.sqrt(np.mean(far**2))) * factor)} {label} away" if len(far) else ""
        between = ":\n" if len(shot.title + away) > _WIDEST else ": "
        axes.set_title(between.join(filter(None, (fill(shot.title, _WIDEST), away))), fontsize=9.5, color=INK)
    _scale_bar(spots[0], low, high, factor, label)
    drawn = figure.colorbar(
        ScalarMappable(Normalize(0.0, top * factor), ERROR_MAP), ax=spots, shrink=0.7, aspect=28, pad=0.02
    )
    drawn.outline.set_visible(False)
    drawn.set_label(f"distance [{label}]", color=SOFT)
    drawn.ax.tick_params(length=0)


def heat_top(errors: FloatArray, noise: float | None) -> float:
    """The error of the darkest colour: the largest there is, but so large that noise alone stays pale."""
    largest = float(np.nanmax(errors)) if np.isfinite(errors).any() else 0.0
    return max(largest, _PALE * (noise or 0.0), 1e-9)


def _scale_bar(axes: Axes, low: FloatArray, high: FloatArray, factor: float, label: str) -> None:
    size = round_length(0.25 * float(high[0] - low[0]) * factor)
    x, y = float(low[0]), float(low[1])
    axes.plot([x, x + size / factor], [y, y], color=SOFT, linewidth=1.4, clip_on=False, solid_capstyle="butt")
    axes.annotate(f"{size:g} {label}", (x, y), (0, 3), textcoords="offset points", fontsize=7.5, color=SOFT)


def round_length(x: float) -> float:
    """The largest of 1, 2, 5 times a power of ten that is not above ``x``."""
    ten = 10.0 ** np.floor(np.log10(x))
    return float(max(m * ten for m in (1.0, 2.0, 5.0) if m * ten <= x * (1 + 1e-9)))


def object_figure(take: Take, after_name: str) -> str | None:
    """PNG address of the object at the worst moment, or None where shapes are not kept."""
    shots = snapshots(take, after_name)
    if not shots or not np.isfinite(shots[0].predicted).all():
        return None
    low, high = window(shots, best_view(shots))
    tall = float(np.clip((high[1] - low[1]) / (high[0] - low[0]), 0.4, 1.25))
    with look():
        figure = new_figure(4.4 * len(shots) + 0.9, 4.4 * tall + 0.4)
        spots = list(figure.subplots(1, len(shots), squeeze=False)[0])
        add_snapshots(figure, spots, shots, take)
        return data_uri(png(figure, 150))
