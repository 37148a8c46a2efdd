"""``muslin unknown``: the force that no named effect explains, and the law it follows; and adding that law."""

from pathlib import Path
from typing import Annotated

import typer

from ..core.registry import REGISTRY
from ..core.study import Study
from .console import ProgressView, command, next_step, say
from .output import check_result, write_json


def add_to(app: typer.Typer) -> None:
    """Add the command of this file."""
    app.command("unknown")(unknown)


def unknown(
    study: Annotated[Path, typer.Argument(metavar="STUDY.toml", help="A fitted study.")],
    json_file: Annotated[
        Path | None,
        typer.Option("--json", metavar="FILE", help="Write what was found to this JSON file, too; it is a law file."),
    ] = None,
    workers: Annotated[
        int | None, typer.Option(min=1, metavar="N", help="Worker processes; default one a core.")
    ] = None,
) -> None:
    """Estimate the force that the model lacks, and seek a simple law for it.

    For a misfit that no named effect explains. The force is the smoothest one that makes the model follow the
    recordings; the law is the sum of few terms that does the same, checked on held-out recordings.
    """
    with ProgressView() as progress:
        loaded = Study.load(study, workers=workers, progress=progress)
        if json_file is not None:
            check_result(json_file, ".json", loaded)
        found = REGISTRY.get("step", "unknown")(loaded)
    say(found.text())
    result = found.to_json()
    if json_file is not None:
        write_json(json_file, result)
        say(f"wrote {json_file}")
    if result["law"] is None:
        next_step(command("report", study))
    elif json_file is None:
        next_step(command("unknown", study, "--json", study.with_name(f"{study.stem}-law.json")))
    else:
        next_step(command("add", "--law", json_file, study))
