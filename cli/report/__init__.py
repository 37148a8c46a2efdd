"""The report: one self-contained HTML page of everything a study has found."""

from pathlib import Path

from ...core.errors import InputError, MuslinError, StepMissingError
from ...core.store import write_text
from ...core.study.study import Study

__all__ = ["missing_extra", "overview_figure", "write_report"]


def write_report(study: Study, output: Path | None = None, after: Study | None = None) -> Path:
    """Write the report of a study as far as it has come: after fit, after compare, or after diagnose.

    Args:
        study: at least fitted.
        output: HTML file; default ``STEM.report.html`` beside the study file.
        after: the same study with an effect added, compared, whose errors are then shown as "after".

    Returns:
        Where the report is.

    Raises:
        StepMissingError: the study has not been fitted, or ``after`` not compared.
        InputError: ``after`` is about other recordings.
    """
    try:
        from .page import render
    except ImportError as error:
        raise missing_extra(error) from error
    path = output or study.path.with_name(f"{study.path.stem}.report.html")
    if after is not None:
        _check_after(study, after)
    page = render(study, after)
    path.parent.mkdir(parents=True, exist_ok=True)
    write_text(path, page)
    return path


def _check_after(study: Study, after: Study) -> None:
    if after.fingerprint("compare")["measured"] != study.fingerprint("compare")["measured"]:
        raise InputError(f"{after.path} is about other recordings than {study.path}; --after takes a study made by add")
    try:
        after.step_results("compare")
    except StepMissingError as error:
        raise StepMissingError(
            f"{after.path} has not been compared, or not since it changed; run: muslin fit {after.path} && "
            f"muslin compare {after.path}"
        ) from error


def overview_figure(study: Study, after: Study | None = None) -> bytes:
    """One wide PNG of a compared study: error over time, and the object at its worst moment."""
    try:
        from .overview import draw_overview
    except ImportError as error:
        raise missing_extra(error) from error
    return draw_overview(study, after)


def missing_extra(error: ImportError) -> Exception:
    """What to raise where pictures cannot be made: which extra to install, or the error itself if that is no matter."""
    if (error.name or "").split(".")[0] in ("matplotlib", "mpl_toolkits", "jinja2"):
        return MuslinError(f"a report needs {error.name}; install it with: pip install 'muslin[report]'")
    return error
