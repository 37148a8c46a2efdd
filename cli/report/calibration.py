"""The page about a calibration, and the same as a section of the report."""

from pathlib import Path
from typing import Any, cast

import numpy as np
import zarr
from jinja2 import Environment, PackageLoader, StrictUndefined

from ...core.store import read, write_text
from ...core.study.study import Study
from .figures_calibration import coverage_figure, predictive_figure, rank_figure
from .findings import Table
from .words import words


def calibration_section(group: zarr.Group | None) -> Table | None:
    """What the template of the section needs; None where nothing was calibrated.

    Args:
        group: results of the step ``calibrate``.
    """
    if group is None:
        return None
    result = cast(Table, dict(cast(Any, group.attrs["result"])))
    names = [str(n) for n in cast(Any, group.attrs["parameters"])]
    rank, region, tarp, weight = (
        np.asarray(read(group, n), float) for n in ("rank", "region_rank", "tarp_rank", "weight")
    )
    cases, checks = float(result["cases"]), list(result["predictive"])
    replicates = [np.asarray(read(group, f"replicate_{c['recording']}"), float) for c in checks]
    return {
        **result,
        "told": told(result, names),
        "tone": {"calibrated": "good", "cannot-tell": "open"}.get(str(result["verdict"]), "bad"),
        "rows": [{**row, "name": words(str(row["name"]))} for row in result["rows"]],
        "ranks": [(words(n), rank_figure(n, rank[:, k], weight, cases, k)) for k, n in enumerate(names)],
        "coverage": coverage_figure(region, tarp, rank, weight, cases),
        "compared": predictive_figure(checks, replicates) if checks else "",
    }


def told(result: Table, names: list[str]) -> str:
    """The verdict as one sentence, parameters in words."""
    text = "; it is ".join(str(s) for s in result["sentences"])
    for name in names:
        text = text.replace(name, words(name))
    return text.capitalize() if result["verdict"] == "cannot-tell" else f"The posterior is {text}"


def write_calibration_report(study: Study, path: Path) -> Path:
    """Write one self-contained HTML file about a calibrated study.

    Raises:
        StepMissingError: it has not been calibrated.
    """
    environment = Environment(
        loader=PackageLoader("muslin.cli"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    section = calibration_section(study.step_results("calibrate"))
    page = environment.get_template("calibration.html.j2").render(calibration=section, title=study.path.stem)
    write_text(path, page)
    return path
