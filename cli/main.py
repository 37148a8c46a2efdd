"""The command ``muslin``."""

import os
import sys
import traceback
from collections.abc import Sequence
from typing import Annotated, NoReturn

import typer

from ..core.threads import one_thread
from ..core.version import __version__
from . import (
    annotate,
    bench,
    calibrate,
    camera,
    combine,
    extracting,
    inspection,
    mask_distance,
    next,
    recordings,
    render,
    simulators,
    starting,
    steps,
    unknown,
)
from .failure import INTERRUPTED, describe, usage_text

app = typer.Typer(
    name="muslin",
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    help="Make simulators of cloth, ropes and soft solids match reality: fit a simulator to a recording, see where it "
    "fails, learn which physical effect is missing, add it. All units are SI; z is up.",
    epilog="A first study: muslin import, new, fit, compare, diagnose, add, report; every command names the next.",
)


def _version(asked: bool) -> None:
    if asked:
        typer.echo(f"muslin {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version and exit.")
    ] = False,
    debug: Annotated[
        bool,
        typer.Option("--debug", help="Show the traceback of an error; so does MUSLIN_DEBUG=1. May stand anywhere."),
    ] = False,
) -> None:
    """Options of every command."""


for _group in (
    recordings,
    camera,
    annotate,
    extracting,
    starting,
    steps,
    next,
    unknown,
    calibrate,
    combine,
    inspection,
    render,
    mask_distance,
    bench,
    simulators,
):
    _group.add_to(app)


def run(arguments: Sequence[str] | None = None) -> NoReturn:
    """Run one command line and exit.

    Status 0: done. 1: the command ran and its answer is no. 2: something given was wrong; one line on
    standard error says what. 70: a fault of muslin or of a plugin. 130: interrupted.

    Args:
        arguments: without the program's name; None takes those of the process.
    """
    given = list(sys.argv[1:] if arguments is None else arguments)
    debug = "--debug" in given or os.environ.get("MUSLIN_DEBUG", "") not in ("", "0")
    given = [a for a in given if a != "--debug"] or ["--help"]
    try:
        with one_thread():
            status = app(args=given, prog_name="muslin", standalone_mode=False)
        sys.stdout.flush()
    except (KeyboardInterrupt, typer.Abort):
        status = INTERRUPTED
    except BrokenPipeError:
        # the reader of our output is gone; keep Python from complaining again at its exit
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        status = 0
    except Exception as error:
        usage = usage_text(error)
        message, status = (usage, 2) if usage is not None else describe(error)
        if debug:
            traceback.print_exc()
        print(f"muslin: error: {message}", file=sys.stderr)
    if status == INTERRUPTED:
        goes_on = "; run again, it goes on from what it has simulated" if "fit" in given[:1] else ""
        print(f"muslin: interrupted{goes_on}", file=sys.stderr)
    sys.exit(status if isinstance(status, int) else 0)
