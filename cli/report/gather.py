"""Everything the report shows, read from the results store into plain values; arrays are in metres."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, cast

import numpy as np
import zarr

from ...core.arrays import FloatArray, IntArray
from ...core.errors import MuslinError, StepMissingError
from ...core.measurement_store import read_hidden
from ...core.store import read
from ...core.study.study import Study

Table = dict[str, Any]


@dataclass(frozen=True, eq=False)
class Take:
    """One recording held against the model.

    Args:
        row: its line of the comparison: ``rmse``, ``noise``, ``worst_time`` and so on.
        time: ``(T,)`` [s].
        before, after, scatter: error over time ``(T,)``; None where not known.
        measured, predicted, predicted_after: ``(T, P, 3)``.
        vertices, vertices_after: ``(T, V, 3)``.
        triangles: ``(F, 3)``.
        point_before, point_after: error of each point over all time ``(P,)``.
        rmse_after: with the effect.
    """

    name: str
    role: str
    row: Table
    time: FloatArray
    before: FloatArray
    after: FloatArray | None = None
    scatter: FloatArray | None = None
    measured: FloatArray | None = None
    predicted: FloatArray | None = None
    predicted_after: FloatArray | None = None
    vertices: FloatArray | None = None
    vertices_after: FloatArray | None = None
    triangles: IntArray | None = None
    point_before: FloatArray | None = None
    point_after: FloatArray | None = None
    rmse_after: float | None = None

    @property
    def held_out(self) -> bool:
        return self.role != "fit"

    @property
    def unit(self) -> str:
        return str(self.row.get("unit", "m"))

    @property
    def rmse(self) -> float:
        return float(self.row["rmse"])

    @property
    def noise(self) -> float | None:
        return number(self.row.get("noise"))

    @property
    def worst_frame(self) -> int:
        worst = number(self.row.get("worst_time"))
        if worst is None:
            return int(np.nanargmax(self.before))
        return int(np.abs(self.time - worst).argmin())


@dataclass(frozen=True, eq=False)
class Posterior:
    """A finished fit."""

    attrs: Table
    samples: FloatArray
    estimate: FloatArray
    estimate_sd: FloatArray

    @property
    def names(self) -> list[str]:
        return [str(n) for n in self.attrs["parameters"]]


@dataclass(frozen=True, eq=False)
class Findings:
    """What a study has found so far.

    Args:
        study: it all comes from.
        fit: always there.
        fit_after: of the study with the effect added.
        compare: attributes of the comparison, or None before that step.
        diagnose: ``result`` of the diagnosis, or None.
        paragraphs: the diagnosis in words.
        takes: one a recording, held-out ones with the largest error first.
        after_name: what "after" has that "before" has not, or "" if there is no after.
        after_inferred: "after" comes from a whole fit of its own, not from the diagnosis.
        hidden: label of a generated measurement.
    """

    study: Study
    fit: Posterior
    fit_after: Posterior | None = None
    compare: Table | None = None
    diagnose: Table | None = None
    paragraphs: list[str] = field(default_factory=list)
    takes: list[Take] = field(default_factory=list)
    after_name: str = ""
    after_inferred: bool = False
    after: Study | None = None
    hidden: Table | None = None

    @property
    def candidates(self) -> list[Table]:
        return list((self.diagnose or {}).get("candidates") or [])


def number(value: Any) -> float | None:
    """A finite number, or None."""
    try:
        out = float(value)
    except (TypeError, ValueError):
        return None
    return out if np.isfinite(out) else None


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
    takes = _takes(compare, diagnose, other)
    if not any(t.after is not None for t in takes):
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
        return ", ".join(result["effects"]) if result.get("verdict") == "named" else str(result["effects"][0])
    candidates = result.get("candidates") or []
    return str(candidates[0]["name"]) if candidates else ""


def _hidden(study: Study) -> Table | None:
    try:
        return read_hidden(study.measurement_path)
    except MuslinError:  # the measurement may have been moved away since
        return None


def _takes(compare: zarr.Group | None, diagnose: zarr.Group | None, other: zarr.Group | None) -> list[Take]:
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
        takes.append(_take(name, dict(row), group, kept, other is not None, after_rows.get(name)))
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
    measured, predicted_after = _array(group, "measured"), _array(kept, f"predicted{suffix}", time)
    rmse_after = number((after_row or {}).get("rmse"))
    if rmse_after is None and after is not None and np.isfinite(after).any():
        rmse_after = float(np.sqrt(np.nanmean(after**2)))
    triangles = _array(group, "triangles")
    return Take(
        name=name,
        role=str(row.get("role", "fit")),
        row=row,
        time=time,
        before=np.asarray(read(group, "error"), float),
        after=after,
        scatter=_array(group, "scatter", time),
        measured=measured,
        predicted=_array(group, "predicted"),
        predicted_after=predicted_after,
        vertices=_array(group, "vertices"),
        vertices_after=_array(kept, f"vertices{suffix}", time),
        triangles=None if triangles is None else triangles.astype(np.int64),
        point_before=_array(group, "point_error"),
        point_after=point_error(predicted_after, measured),
        rmse_after=rmse_after,
    )


def point_error(predicted: FloatArray | None, measured: FloatArray | None) -> FloatArray | None:
    """Root mean square over time of each point's distance ``(P,)``; None if points do not correspond."""
    if predicted is None or measured is None or predicted.shape != measured.shape:
        return None
    square = ((predicted - measured) ** 2).sum(axis=2)
    seen = np.isfinite(square)
    mean = np.where(seen, square, 0.0).sum(axis=0) / np.maximum(seen.sum(axis=0), 1)
    return np.asarray(np.where(seen.any(axis=0), np.sqrt(mean), np.nan))
