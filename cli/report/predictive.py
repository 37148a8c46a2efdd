"""What the posterior predicts, as a small film: measured points, the best fit, and posterior draws, in level views."""

import base64
import json
from typing import Any

import numpy as np
from matplotlib.tri import Triangulation

from ...core.arrays import FloatArray, IntArray
from .compared import Compared, view_name
from .figures_points import flat_layout
from .findings import Findings, Table, Take

_MOST_BYTES = 160_000
_MOST_POINTS, _FEWEST_FRAMES = 150, 12
#: Neighbours on the object are joined unless they are so many times as far apart as most.
_LONG = 1.9
_MISSING = -32768


def predictive_data(found: Findings) -> Table | None:
    """The film of the first recording that has draws: ``name`` and ``data`` (JSON); None if there is none."""
    for take in found.takes:
        if take.compared is not None and take.measured is not None and len(take.compared.draws):
            return {"name": take.name, "draws": len(take.compared.draws), "data": _pack(take, take.compared)}
    return None


def _pack(take: Take, c: Compared) -> str:
    assert take.measured is not None
    shown = _spread(c.predicted.shape[1], _MOST_POINTS)
    dots = _spread(take.measured.shape[1], 2 * _MOST_POINTS)
    axes, views = c.predicted.shape[2], c.views
    each = 2 * axes * (len(dots) + len(shown) * (1 + len(c.draws)))
    frames = _spread(len(take.time), max(_FEWEST_FRAMES, _MOST_BYTES // each))
    measured, best = take.measured[frames][:, dots], c.predicted[frames][:, shown]
    draws = c.draws[:, frames][:, :, shown]
    everything = np.concatenate([measured.reshape(-1, axes), best.reshape(-1, axes)])
    low, high = np.nanmin(everything, axis=0), np.nanmax(everything, axis=0)
    centre, reach = 0.5 * (low + high), 2.0 * float((high - low).max()) + 1e-9

    def packed(values: FloatArray) -> str:
        scaled = np.clip((values - centre) / reach * 32000, -32000, 32000)
        return _base64(np.where(np.isfinite(scaled), np.nan_to_num(np.rint(scaled)), _MISSING).astype("<i2"))

    shapes = np.concatenate([measured, best, *draws], axis=1)
    table: dict[str, Any] = {
        "time": [round(float(take.time[k]), 4) for k in frames],
        "worst": int(np.abs(frames - take.worst_frame).argmin()),
        "phase": [c.phases[c.motion[k]] for k in frames],
        "axes": axes,
        "paired": take.correspondence and len(dots) == len(shown),
        "views": [
            {"name": view_name(v), "rows": np.round(v, 5).tolist(), "size": _extent(shapes @ v.T, reach)} for v in views
        ],
        "lines": _lines(best[0], take.triangles).ravel().tolist(),
        "measured": packed(measured),
        "best": packed(best),
        "draws": [packed(d) for d in draws],
    }
    return json.dumps(table, separators=(",", ":")).replace("<", "\\u003c")


def _extent(flat: FloatArray, reach: float) -> list[float]:
    """The largest width and height of any frame of ``flat (T, N, 2)``, in packed numbers."""
    return [float(x) / reach * 32000 for x in (np.nanmax(flat, axis=1) - np.nanmin(flat, axis=1)).max(axis=0)]


def _lines(points: FloatArray, triangles: IntArray | None) -> IntArray:
    """Pairs of points ``(N, 2)`` to join, so that their shape is seen: neighbours, by their first frame."""
    count = len(points)
    if triangles is None or not len(triangles) or count < 4:
        return np.stack([np.arange(count - 1), np.arange(1, count)], axis=1)
    try:
        edges = Triangulation(*flat_layout(points).T).edges
    except (RuntimeError, ValueError):  # all on one line, or on one spot
        return np.stack([np.arange(count - 1), np.arange(1, count)], axis=1)
    length = np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1)
    return np.asarray(edges[length <= _LONG * np.median(length)], np.int64)


def _spread(count: int, most: int) -> IntArray:
    return np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(np.int64))


def _base64(values: Any) -> str:
    return base64.b64encode(np.ascontiguousarray(values).tobytes()).decode("ascii")
