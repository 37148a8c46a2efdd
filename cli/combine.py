"""``muslin combine``: what several studies say together of a parameter that their objects share."""

from pathlib import Path
from typing import Annotated

import typer

from ..core.registry import REGISTRY
from ..core.study import Study
from .console import say
from .output import check_result, write_json


def add_to(app: typer.Typer) -> None:
    """Add the commands of this file."""
    app.command("combine")(combine)


def combine(
    studies: Annotated[list[Path], typer.Argument(metavar="STUDY.toml...", help="Fitted studies, two at least.")],
    parameter: Annotated[
        list[str] | None,
        typer.Option("-p", "--parameter", metavar="NAME", help="A parameter that is the same in all; may be repeated."),
    ] = None,
    json_file: Annotated[
        Path | None, typer.Option("--json", metavar="FILE", help="Write what was found to this JSON file, too.")
    ] = None,
) -> None:
    """Say what several fits tell together of a parameter that they share, and whether they agree on it.

    One material in two scenarios, gravity in the falls of several balls: each study keeps its own model and recordings.
    """
    loaded = [Study.load(path) for path in studies]
    if json_file is not None:
        check_result(json_file, ".json", *loaded)
    found = REGISTRY.get("step", "combine")(loaded, parameter or [])
    say(found.text())
    if json_file is not None:
        write_json(json_file, found.to_json())
        say(f"wrote {json_file}")
