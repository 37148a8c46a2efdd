"""What a report tells, as plain values; arrays are in the unit of the measurement."""

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import zarr

from ...core.arrays import FloatArray, IntArray
from ...core.study.study import Study
from .compared import Compared

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
        triangles: ``(F, 3)``; none of a rope, whose vertices follow each other.
        outlines: of what stands around the object, lines ``(n, 3)``.
        point_before, point_after: error of each point over all time ``(P,)``.
        rmse_before, rmse_after: root mean square over all of it.
        correspondence: point p of the measurement is point p of the prediction.
        compared: what else the comparison keeps of it.
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
    outlines: tuple[FloatArray, ...] = ()
    point_before: FloatArray | None = None
    point_after: FloatArray | None = None
    rmse_before: float | None = None
    rmse_after: float | None = None
    correspondence: bool = True
    compared: Compared | None = None

    def without_after(self) -> "Take":
        return replace(self, after=None, predicted_after=None, vertices_after=None, point_after=None, rmse_after=None)

    @property
    def held_out(self) -> bool:
        return self.role != "fit"

    @property
    def unit(self) -> str:
        return str(self.row.get("unit", "m"))

    @property
    def rmse(self) -> float:
        return float(self.row["rmse"]) if self.rmse_before is None else self.rmse_before

    @property
    def noise(self) -> float | None:
        return number(self.row.get("noise"))

    @property
    def worst_frame(self) -> int:
        worst = number(self.row.get("worst_time"))
        if worst is None or self.rmse_before is not None:
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
        calibration, unknown, proposed: results of the steps ``calibrate``, ``unknown`` and ``next``, or None.
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
    calibration: zarr.Group | None = None
    unknown: zarr.Group | None = None
    proposed: zarr.Group | None = None

    @property
    def after_label(self) -> str:
        """``after_name`` in words, and whether it is only a candidate."""
        named = self.after_inferred or (self.diagnose or {}).get("verdict") == "named"
        text = self.after_name.replace("-", " ")
        return f"{text} (candidate)" if text and not named else text

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
