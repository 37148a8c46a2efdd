"""The object at its worst moment: the predicted mesh coloured by error, and where the points really were."""

from dataclasses import dataclass, replace

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import FigureBase
from mpl_toolkits.mplot3d import Axes3D
from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection

from ...core.arrays import FloatArray, IntArray
from .gather import Take
from .style import ERROR_MAP, INK, SOFT, data_uri, look, new_figure, png
from .words import shown_unit

_ELEVATION = 14.0


@dataclass(frozen=True, eq=False)
class Snapshot:
    """One model at one moment, in three dimensions.

    Args:
        title: of the picture.
        predicted, measured: ``(P, 3)``.
        vertices: ``(V, 3)`` or None.
        triangles: ``(F, 3)`` or None.
    """

    title: str
    predicted: FloatArray
    measured: FloatArray
    vertices: FloatArray | None
    triangles: IntArray | None

    @property
    def paired(self) -> bool:
        return self.predicted.shape == self.measured.shape

    def errors(self) -> FloatArray:
        """Distance ``(P,)`` of each predicted point to its measured one, or to the nearest without correspondence."""
        if self.paired:
            return np.asarray(np.linalg.norm(self.predicted - self.measured, axis=1))
        seen = self.measured[np.isfinite(self.measured).all(axis=1)]
        gaps = np.linalg.norm(self.predicted[:, None] - seen[None], axis=2)
        return np.asarray(gaps.min(axis=1) if len(seen) else np.full(len(self.predicted), np.nan))

    def vertex_errors(self) -> FloatArray:
        """Error ``(V,)`` spread from the points over the mesh by inverse distance."""
        assert self.vertices is not None
        errors = self.errors()
        known = np.isfinite(errors)
        if not known.any():
            return np.zeros(len(self.vertices))
        gaps = np.linalg.norm(self.vertices[:, None] - self.predicted[known][None], axis=2)
        scale = max(float(np.ptp(self.vertices, axis=0).max()), 1e-9)
        weights = 1.0 / (gaps + 0.01 * scale) ** 3
        return np.asarray(weights @ errors[known] / weights.sum(axis=1))


def snapshots(take: Take, after_name: str, frame: int | None = None) -> list[Snapshot]:
    """Before, and after where there is one, at the worst moment of before."""
    k = take.worst_frame if frame is None else frame
    if take.measured is None or take.predicted is None:
        return []
    flat = None if take.vertices is None or take.triangles is None else take.vertices[k]
    out = [Snapshot("model as it is", take.predicted[k], take.measured[k], flat, take.triangles)]
    if take.predicted_after is not None and after_name:
        flat = None if take.vertices_after is None or take.triangles is None else take.vertices_after[k]
        out.append(Snapshot(f"with {after_name}", take.predicted_after[k], take.measured[k], flat, take.triangles))
    return [_spatial(s) for s in out]


def _spatial(s: Snapshot) -> Snapshot:
    def pad(x: FloatArray) -> FloatArray:  # two-dimensional points lie in the plane y = 0, second axis up
        return x if x.shape[1] == 3 else np.stack([x[:, 0], np.zeros(len(x)), x[:, 1]], axis=1)

    vertices = None if s.vertices is None else pad(s.vertices)
    return replace(s, predicted=pad(s.predicted), measured=pad(s.measured), vertices=vertices)


def best_azimuth(shots: list[Snapshot]) -> float:
    """The view angle [degree] from which one sees most of the object and of its error."""
    cloud = np.concatenate([s.predicted for s in shots])
    cloud = cloud - cloud.mean(axis=0)
    gaps = np.concatenate([s.measured - s.predicted if s.paired else np.zeros((1, 3)) for s in shots[:1]])
    gaps = gaps[np.isfinite(gaps).all(axis=1)]
    scores = []
    angles = np.arange(-165.0, 180.0, 5.0)
    for angle in np.radians(angles):
        right = np.array([-np.sin(angle), np.cos(angle), 0.0])
        up = _up(angle)
        plane = np.stack([cloud @ right, cloud @ up])
        area = float(np.sqrt(max(np.linalg.det(np.cov(plane)), 0.0)))
        error = float(np.sqrt(((gaps @ right) ** 2 + (gaps @ up) ** 2).mean())) if len(gaps) else 0.0
        front = 1.0 + 0.05 * np.cos(angle + np.radians(60.0))  # of equals, the customary side
        scores.append((np.sqrt(area) + error) * front)
    return float(angles[int(np.argmax(scores))])


def _up(angle: float) -> FloatArray:
    e = np.radians(_ELEVATION)
    return np.array([-np.cos(angle) * np.sin(e), -np.sin(angle) * np.sin(e), np.cos(e)])


def draw_snapshot(axes: Axes3D, shot: Snapshot, norm: Normalize, centre: FloatArray, half: FloatArray) -> None:
    """One snapshot within a box of given centre and half sizes [m]."""
    if shot.vertices is not None and shot.triangles is not None:
        errors = shot.vertex_errors()
        faces = Poly3DCollection(
            list(shot.vertices[shot.triangles]), linewidths=0.25, edgecolors=(0.12, 0.15, 0.18, 0.35), zorder=1
        )
        faces.set_facecolor(ERROR_MAP(norm(errors[shot.triangles].mean(axis=1))))
        axes.add_collection3d(faces)
    else:
        colours = ERROR_MAP(norm(np.nan_to_num(shot.errors())))
        axes.scatter(*shot.predicted.T, c=colours, s=26, depthshade=False, edgecolors=SOFT, linewidths=0.3, zorder=1)
    if shot.paired:
        pairs = np.stack([shot.predicted, shot.measured], axis=1)
        seen = np.isfinite(pairs).all(axis=(1, 2))
        axes.add_collection3d(Line3DCollection(list(pairs[seen]), colors=INK, linewidths=0.7, alpha=0.75, zorder=2))
    axes.scatter(*shot.measured.T, color=INK, s=7, depthshade=False, linewidths=0, zorder=3)
    for setter, c, h in zip((axes.set_xlim3d, axes.set_ylim3d, axes.set_zlim3d), centre, half, strict=True):
        setter(float(c - h), float(c + h))
    axes.set_box_aspect(tuple(half / half.max()), zoom=1.25)


def box(shots: list[Snapshot]) -> tuple[FloatArray, FloatArray]:
    """Centre and half sizes of everything drawn, never flatter than a quarter of the largest side."""
    parts = [p for s in shots for p in (s.predicted, s.measured, s.vertices) if p is not None]
    cloud = np.concatenate(parts)
    low, high = np.nanmin(cloud, axis=0), np.nanmax(cloud, axis=0)
    half = 0.5 * (high - low)
    return 0.5 * (low + high), np.maximum(half, max(0.25 * float(half.max()), 1e-6)) * 1.04


def add_snapshots(figure: FigureBase, spots: list[Axes3D], shots: list[Snapshot], unit: str, bar: bool = True) -> None:
    """Draw snapshots that share one view, one box and one colour scale."""
    factor, label = shown_unit(unit)
    with np.errstate(invalid="ignore"):
        top = max([float(np.nanmax(s.errors())) for s in shots if np.isfinite(s.errors()).any()] or [1e-9])
    norm = Normalize(0.0, max(top, 1e-9))
    (centre, half), azimuth = box(shots), best_azimuth(shots)
    for axes, shot in zip(spots, shots, strict=True):
        axes.set_proj_type("ortho")
        axes.computed_zorder = False
        axes.view_init(elev=_ELEVATION, azim=azimuth)
        axes.set_axis_off()
        draw_snapshot(axes, shot, norm, centre, half)
        mean = float(np.sqrt(np.nanmean(shot.errors() ** 2))) * factor
        axes.set_title(f"{shot.title}\n{mean:.3g} {label} off", fontsize=9.5, color=INK, y=0.99)
    if bar:
        scale = ScalarMappable(Normalize(0.0, norm.vmax * factor if norm.vmax else 1.0), ERROR_MAP)
        drawn = figure.colorbar(scale, ax=spots, shrink=0.6, aspect=26, pad=0.02)
        drawn.outline.set_visible(False)  # type: ignore[operator]
        drawn.set_label(f"distance [{label}]", color=SOFT)
        drawn.ax.tick_params(length=0)


def object_figure(take: Take, after_name: str) -> str | None:
    """PNG address of the object at the worst moment, or None where shapes are not kept."""
    shots = snapshots(take, after_name)
    if not shots or not np.isfinite(shots[0].predicted).all():
        return None
    with look():
        figure = new_figure(4.4 * len(shots) + 0.8, 4.4)
        spots = [figure.add_subplot(1, len(shots), i + 1, projection="3d") for i in range(len(shots))]
        add_snapshots(figure, spots, shots, take.unit)
        return data_uri(png(figure, 150))
