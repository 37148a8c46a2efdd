"""What markers show of a cloth before its study is written: a grid, or a sheet that hangs elsewhere."""

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from ..core.measurement import Measurement
from ..core.scenarios import preset
from ..core.study import build_problem, parse_config
from .gridding import Grid, laid_over, seen_grid
from .laying import Sheet, seen_sheet, why_elsewhere
from .table_height import lies_at

#: A cloth that is larger or smaller than this share of another is not of its size.
_OTHER = 0.1


@dataclass(frozen=True)
class Shown:
    """What markers show; nothing at first.

    Args:
        grid: that they are, if the object is where the scenario puts it.
        sheet: that they are on, if it is elsewhere.
        table: what that says in ``[scenario]`` of the object and its grasps.
        remarks: for the person.
    """

    grid: Grid | None = None
    sheet: Sheet | None = None
    table: dict[str, Any] = field(default_factory=dict)
    remarks: list[str] = field(default_factory=list)


def shown_by_markers(whole: dict[str, Any], measured: Measurement, study: Path, size: list[float]) -> Shown:
    """What the markers of the fitted recordings show.

    Args:
        whole: the study as far as it is known, as a table.
        measured: the measurement.
        study: the study file.
        size: of the object [m], if the person gave it.
    """
    grid, remarks = _grid(whole, measured, study, bool(size))
    table: dict[str, Any] = {}
    if grid is not None:
        table = {"vertices": grid.counts}
        table |= {"size": grid.size} if _other(grid.size, whole["scenario"]["size"]) else {}
    sheet = _sheet(whole | {"scenario": whole["scenario"] | table}, measured, study, size)
    if sheet is None:
        return Shown(grid, None, table, remarks)
    table = {"size": sheet.size, "vertices": sheet.counts} | ({"grasps": sheet.grasps} if sheet.grasps else {})
    return Shown(None, sheet, table, [sheet.text()])


def _grid(whole: dict[str, Any], measured: Measurement, study: Path, sized: bool) -> tuple[Grid | None, list[str]]:
    """The grid that the points are, if they lie as its vertices do and it is as large as the person says; remarks."""
    size = whole["scenario"]["size"]
    if len(size) != 2 or (grid := seen_grid([measured[name] for name in whole["study"]["fit_on"]])) is None:
        return None, []
    other = _other(grid.size, size)
    if sized and other:
        seems = f"{grid.size[0]:g} x {grid.size[1]:g} m"
        return None, [f"warning: by how far apart the points are, they are a grid over {seems}; check --size"]
    table = whole["scenario"] | {"vertices": grid.counts, "markers": grid.markers}
    table |= {"size": grid.size} if other else {}
    draft = parse_config(whole | {"scenario": table}, str(study))
    laid = laid_over(grid, build_problem(draft, measured, study.parent))
    return laid, [] if laid is None else [laid.text(sized=not other)]


def _sheet(whole: dict[str, Any], measured: Measurement, study: Path, size: list[float]) -> Sheet | None:
    """The sheet under the markers, if they lie on one in the air or on a table, and not where the scenario puts it."""
    table, recordings = whole["scenario"], [measured[name] for name in whole["study"]["fit_on"]]
    base = preset(table["name"])
    if len(table["size"]) != 2 or (sheet := seen_sheet(base, recordings, size)) is None:
        return None
    if base.obstacles and any(lies_at(r) is None for r in recordings):  # what it touches may bend it
        return None
    draft = parse_config(whole | {"scenario": table | {"markers": [0] * len(sheet.markers)}}, str(study))
    why = why_elsewhere(build_problem(draft, measured, study.parent))
    return None if why is None else replace(sheet, why=why)


def _other(size: list[float], usual: list[float]) -> bool:
    """Whether a cloth that seems ``size`` [m] large is not one of the ``usual`` size."""
    return any(abs(a - b) > _OTHER * b for a, b in zip(size, usual, strict=True))
