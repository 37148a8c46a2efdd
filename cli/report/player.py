"""The recording as a small film: meshes and points of every frame, packed for the script in the page."""

import base64
import json
from typing import Any

import numpy as np

from ...core.arrays import FloatArray
from .figures_object import Snapshot, best_view, heat_top, snapshots
from .findings import Findings, Table, Take
from .words import shown_unit

_MOST_BYTES = 600_000
_FEWEST_FRAMES = 12
_MISSING = -32768


def player_data(found: Findings) -> Table | None:
    """The film of the first recording that keeps its meshes: ``name`` and ``data`` (JSON); None if there is none."""
    for take in found.takes:
        if take.vertices is not None and take.triangles is not None and take.measured is not None:
            frames = _frames(take)
            if len(frames) >= _FEWEST_FRAMES:
                return {"name": take.name, "data": _pack(take, found.after_label, frames)}
    return None


def _frames(take: Take) -> list[int]:
    """Frames that fit into the page, evenly spread, the worst one among them."""
    assert take.vertices is not None and take.measured is not None
    models = 1 if take.vertices_after is None else 2
    each = models * take.vertices.shape[1] * 7 + take.measured.shape[1] * 6 * (1 + models)
    stride = max(1, -(-len(take.time) * each // _MOST_BYTES))
    return list(range(take.worst_frame % stride, len(take.time), stride))


def _pack(take: Take, name: str, frames: list[int]) -> str:
    film = [snapshots(take, name, k) for k in frames]
    film = [f for f in film if f and f[0].vertices is not None]
    measured = np.stack([f[0].places() for f in film])
    shown = np.concatenate([measured, np.stack([f[0].predicted for f in film])], axis=1)
    low, high = np.nanmin(shown, axis=(0, 1)), np.nanmax(shown, axis=(0, 1))
    centre, reach = 0.5 * (low + high), 2.0 * float((high - low).max()) + 1e-9

    def packed(values: FloatArray) -> str:
        scaled = np.clip((values - centre) / reach * 32000, -32000, 32000)
        return _base64(np.where(np.isfinite(scaled), np.nan_to_num(np.rint(scaled)), _MISSING).astype("<i2"))

    models, top = [], heat_top(np.concatenate([f[0].errors() for f in film]), take.noise)
    for i, shot in enumerate(film[0]):
        shots: list[Snapshot] = [f[i] for f in film]
        errors = np.stack([s.vertex_errors() for s in shots])
        models.append(
            {
                "title": shot.title,
                "vertices": packed(np.stack([np.asarray(s.vertices) for s in shots])),
                "predicted": packed(np.stack([s.predicted for s in shots])) if shot.paired else "",
                "heat": _base64(np.clip(255 * errors / top, 0, 255).astype(np.uint8)),
                "rms": [_rms(s) * shown_unit(take.unit)[0] for s in shots],
            }
        )
    worst = int(np.abs(np.array(frames) - take.worst_frame).argmin())
    table: dict[str, Any] = {
        "time": [round(float(take.time[k]), 4) for k in frames],
        "worst": worst,
        "unit": shown_unit(take.unit)[1],
        "view": np.round(best_view(film[worst]), 5).tolist(),
        "triangles": np.asarray(take.triangles).ravel().tolist(),
        "measured": packed(measured),
        "outlines": [packed(line) for line in film[worst][0].outlines if (np.abs(line - centre) < reach).all()],
        "models": models,
        "reach": reach,
    }
    return json.dumps(table, separators=(",", ":")).replace("<", "\\u003c")


def _rms(shot: Snapshot) -> float:
    far = shot.distances()
    return round(float(np.sqrt(np.mean(far**2))), 5) if len(far) else 0.0


def _base64(values: Any) -> str:
    return base64.b64encode(np.ascontiguousarray(values).tobytes()).decode("ascii")
