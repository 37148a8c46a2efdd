"""``muslin calibrate`` and ``export``: whether a posterior can be believed, and the posterior for other programs."""

from pathlib import Path
from typing import Annotated

import typer

from ..core.errors import InputError
from ..core.registry import REGISTRY
from ..core.store import storage_errors
from ..core.study import Study
from .console import ProgressView, command, next_step, say
from .output import check_apart, check_output, check_result, write_json
from .report import missing_extra
from .steps import Force, StudyFile, Workers

_KINDS = (
    "arviz (netCDF, .nc), json (quantiles, sd, covariance, modes), domain-randomisation (samples, .json or .toml) "
    "or slices (a picture, .png)"
)


def add_to(app: typer.Typer) -> None:
    """Add the commands of this file."""
    app.command("calibrate")(calibrate)
    app.command("export")(export)


def calibrate(
    study: StudyFile,
    simulations: Annotated[
        int,
        typer.Option(
            min=0, metavar="N", help="Judge by N fresh draws from the posterior, not by those of the fit, left out."
        ),
    ] = 0,
    predictive: Annotated[
        int, typer.Option(min=0, metavar="N", help="Posterior draws simulated for the predictive check; 0 for none.")
    ] = 100,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="PAGE.html", help="Pictures; default STUDY.calibration.html."),
    ] = None,
    json_file: Annotated[
        Path | None, typer.Option("--json", metavar="FILE", help="Write the figures to this JSON file, too.")
    ] = None,
    workers: Workers = None,
) -> None:
    """Say whether the posterior of a fit can be believed.

    Ranks known truths in the posteriors given their own simulations. The verdict is one of: calibrated,
    over-confident, under-confident, biased, misshapen, cannot-tell. Then holds every recording against what the
    posterior predicts.
    """
    try:
        from .report.calibration import write_calibration_report
    except ImportError as error:
        raise missing_extra(error) from error
    target = output or study.with_name(f"{study.stem}.calibration.html")
    with ProgressView() as progress:
        loaded = Study.load(study, workers=workers, progress=progress)
        for file, ending in ((target, ".html"), (json_file, ".json")):
            if file is not None:  # minutes of simulation must not end at a misspelt folder
                check_result(file, ending, loaded)
        found = loaded.calibrate(simulations=simulations, predictive=predictive)
    say(found.text())
    if json_file is not None:
        write_json(json_file, found.to_json())
        say(f"wrote {json_file}")
    say(f"wrote {write_calibration_report(loaded, target)}")
    next_step(command("report", study))


def export(
    study: StudyFile,
    output: Annotated[Path, typer.Argument(metavar="OUT", help="The file to write.")],
    kind: Annotated[str, typer.Option("--as", metavar="KIND", help=f"What to write: {_KINDS}.")],
    samples: Annotated[int, typer.Option(min=1, metavar="N", help="Posterior draws in it; json has none.")] = 2000,
    seed: Annotated[int, typer.Option(min=0, help="Of the draws.")] = 0,
    force: Force = False,
) -> None:
    """Write the posterior of a fit for other programs, in the units of its parameters."""
    loaded = Study.load(study)
    check_apart(output, loaded)
    check_output(output, force)
    if kind == "slices":
        _draw_slices(loaded, output)
        return
    loaded.export(kind, output, samples=samples, seed=seed)
    say(f"wrote {output}")


def _draw_slices(study: Study, output: Path) -> None:
    if output.suffix != ".png":
        raise InputError(f"slices are written to a .png file, not to {output.name}")
    try:
        from .report.figures_slices import slices_figure
    except ImportError as error:
        raise missing_extra(error) from error
    picture = slices_figure(*REGISTRY.get("step", "slices")(study))
    with storage_errors(output):
        output.write_bytes(picture)
    say(f"wrote {output}")
