"""Everything the report shows, read from the results store."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, cast

import numpy as np
import zarr

from ...core.arrays import FloatArray
from ...core.errors import MuslinError, StepMissingError
from ...core.measurement import Recording
from ...core.measurement_store import read_hidden
from ...core.store import read
from ...core.study.objects import obstacles_of
from ...core.study.study import Study
from .compared import read_compared
from .findings import Findings, Posterior, Table, Take, number
from .outlines import outlines


def gather(study: Study, after: Study | None = None) -> Findings:
    """Read a study's results.

    Raises:
        StepMissingError: it has not been fitted.
    """
    fit = _posterior(study.step_results("fit"))
    compare, diagnose = _step(study, "compare"), _step(study, "diagnose")
    other = _step(after, "compare") if after is not None else None
    result = cast(Table, dict(cast(Table, diagnose.attrs["result"]))) if diagnose is not None else None
    if after is not None and other is not None:
        name = ", ".join(e for e in after.config.effects if e not in study.config.effects) or after.path.stem
    else:
        name = _shown_effect(result)
    known = _recordings(study)
    takes = _takes(compare, diagnose, other, {n: r.series.correspondence for n, r in known.items()})
    takes = [_pictured(_surrounded(t, study), known.get(t.name)) for t in takes]
    if not name or not any(t.after is not None for t in takes):
        takes = [t.without_after() for t in takes]
        name = ""
    after_fit = _step(after, "fit") if after is not None else None
    text = diagnose.attrs.get("text", []) if diagnose is not None else []
    return Findings(
        study=study,
        fit=fit,
        fit_after=_posterior(after_fit) if after_fit is not None else None,
        compare=dict(compare.attrs) if compare is not None else None,
        diagnose=result,
        paragraphs=[text] if isinstance(text, str) else [str(p) for p in cast(Sequence[Any], text)],
        takes=takes,
        after_name=name,
        after_inferred=other is not None,
        after=after,
        hidden=_hidden(study),
        calibration=_step(study, "calibrate"),
        unknown=_step(study, "unknown"),
        proposed=_step(study, "next"),
    )


def _step(study: Study | None, name: str) -> zarr.Group | None:
    if study is None:
        return None
    try:
        return study.step_results(name)
    except StepMissingError:
        return None


def _posterior(group: zarr.Group) -> Posterior:
    values = [np.asarray(read(group, n), float) for n in ("posterior_samples", "estimate", "estimate_sd")]
    return Posterior(dict(group.attrs), *values)


def _shown_effect(result: Table | None) -> str:
    if not result:
        return ""
    if result.get("effects"):
        tied = [result["effects"][0], *(result.get("further") or [])]
        return ", ".join(result["effects"] if result.get("verdict") == "named" else tied)
    candidates = result.get("candidates") or []
    return str(candidates[0]["name"]) if candidates and result.get("verdict") != "no-misfit" else ""


def _recordings(study: Study) -> dict[str, Recording]:
    """By name; empty if the measurement has been moved away since."""
    try:
        return {r.name: r for r in study.measurement.recordings}
    except MuslinError:
        return {}


def _pictured(take: Take, recording: Recording | None) -> Take:
    """Meshes where the camera saw them ``(T, V, 3)``: pixels, and their distance in pixels of its middle."""
    if take.unit != "px":
        return take
    camera = None if recording is None else recording.camera

    def seen(vertices: FloatArray | None) -> FloatArray | None:
        if vertices is None or camera is None:
            return None
        pixels, depth = camera.project(vertices)
        away = camera.fx * (depth / np.nanmedian(depth) - 1.0)
        return np.concatenate([pixels, away[..., None]], axis=-1)

    return replace(take, vertices=seen(take.vertices), vertices_after=seen(take.vertices_after))


def _surrounded(take: Take, study: Study) -> Take:
    if take.vertices is None or take.unit != "m":
        return take
    try:
        obstacles = obstacles_of(study.config.scenario, study.path.parent)
    except MuslinError:  # a mesh may have been moved away since
        return take
    flat = take.vertices.reshape(-1, 3)
    return replace(take, outlines=tuple(outlines(obstacles, np.nanmin(flat, axis=0), np.nanmax(flat, axis=0))))


def _hidden(study: Study) -> Table | None:
    try:
        return read_hidden(study.measurement_path)
    except MuslinError:  # the measurement may have been moved away since
        return None


def _takes(
    compare: zarr.Group | None, diagnose: zarr.Group | None, other: zarr.Group | None, paired: Mapping[str, bool]
) -> list[Take]:
    if compare is None:
        return []
    rows = cast(Sequence[Mapping[str, Any]], compare.attrs["rows"])
    after_rows = {r["recording"]: r for r in cast(Any, other.attrs["rows"])} if other is not None else {}
    takes = []
    for row in rows:
        name = str(row["recording"])
        group = compare.get(name)
        if not isinstance(group, zarr.Group):
            continue
        kept = _child(other, name) if other is not None else _child(diagnose, name)
        take = _take(name, dict(row), group, kept, other is not None, after_rows.get(name))
        takes.append(replace(take, correspondence=paired.get(name, True), compared=read_compared(group)))
    return sorted(takes, key=lambda t: (not t.held_out, -t.rmse))


def _child(group: zarr.Group | None, name: str) -> zarr.Group | None:
    child = group.get(name) if group is not None else None
    return child if isinstance(child, zarr.Group) else None


def _array(group: zarr.Group | None, name: str, like: FloatArray | None = None) -> FloatArray | None:
    if group is None or name not in group:
        return None
    values = np.asarray(read(group, name), float)
    return None if like is not None and len(values) != len(like) else values


def _take(
    name: str, row: Table, group: zarr.Group, kept: zarr.Group | None, inferred: bool, after_row: Table | None
) -> Take:
    time = np.asarray(read(group, "time"), float)
    suffix = "" if inferred else "_after"
    after = _array(kept, f"error{suffix}", time)
    predicted_after = _array(kept, f"predicted{suffix}", time)
    rmse_after = number((after_row or {}).get("rmse"))
    if rmse_after is None and after is not None and np.isfinite(after).any():
        rmse_after = float(np.sqrt(np.nanmean(after**2)))
    before = _array(kept, "error_before", time) if not inferred else None
    measured, predicted = _array(group, "measured"), _array(group, "predicted")
    vertices, points = _array(group, "vertices"), _array(group, "point_error")
    refitted = _array(kept, "predicted_before", time) if before is not None else None
    if refitted is not None:  # the diagnosis refits the plain model too, so that both had the same chance
        predicted, vertices = refitted, _array(kept, "vertices_before", time)
        refitted_points = point_error(predicted, measured)
        points = points if refitted_points is None else refitted_points
    triangles = _array(group, "triangles")
    return Take(
        name=name,
        role=str(row.get("role", "fit")),
        row=row,
        time=time,
        before=np.asarray(read(group, "error"), float) if before is None else before,
        after=after,
        scatter=_array(group, "scatter", time),
        measured=measured,
        predicted=predicted,
        predicted_after=predicted_after,
        vertices=vertices,
        vertices_after=_array(kept, f"vertices{suffix}", time),
        triangles=None if triangles is None else triangles.astype(np.int64),
        point_before=points,
        point_after=point_error(predicted_after, measured),
        rmse_before=None if before is None else float(np.sqrt(np.nanmean(before**2))),
        rmse_after=rmse_after,
    )


def point_error(predicted: FloatArray | None, measured: FloatArray | None) -> FloatArray | None:
    """Root mean square of each point over what is seen of it ``(P,)``; None if points do not correspond."""
    if predicted is None or measured is None or predicted.shape != measured.shape:
        return None
    apart = predicted - measured
    seen = np.isfinite(apart)
    mean = np.where(seen, apart, 0.0) ** 2
    count = seen.sum(axis=(0, 2))
    return np.asarray(np.where(count > 0, np.sqrt(mean.sum(axis=(0, 2)) / np.maximum(count, 1)), np.nan))
