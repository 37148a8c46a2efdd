"""``muslin compare-simulators``: the same draws on several simulators."""

from pathlib import Path
from typing import Annotated

import typer

from ..core.comparison import compare_simulators as run_comparison
from ..core.errors import InputError, MuslinError
from ..core.material import UNITS
from ..core.parameters import Parameter
from ..core.scenarios import preset
from .console import ProgressView, say
from .output import check_output, write_json


def add_to(app: typer.Typer) -> None:
    """Add the command of this file."""
    app.command("compare-simulators")(compare_simulators)


def compare_simulators(
    scenario: Annotated[str, typer.Argument(metavar="SCENARIO", help="A built-in scenario, as fling or winding.")],
    simulators: Annotated[
        str, typer.Option("--simulators", metavar="A,B", help="Names, separated by commas.")
    ] = "mujoco,pybullet",
    draws: Annotated[int, typer.Option(min=1, metavar="N", help="Draws from the prior, the same on each.")] = 50,
    parameter: Annotated[
        list[str] | None,
        typer.Option("--parameter", metavar="NAME=LOW:HIGH[:log]", help="What is drawn; may be given again."),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Of the draws.")] = 0,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="REPORT.html", help="Default SCENARIO.simulators.html.")
    ] = None,
    json_file: Annotated[
        Path | None, typer.Option("--json", metavar="FILE", help="Write the figures here, too.")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace files that are there already.")] = False,
    workers: Annotated[int | None, typer.Option(min=1, metavar="N", help="Processes; default one a core.")] = None,
) -> None:
    """Run the same draws on several simulators and report how far apart they are, where, and when."""
    try:
        from .report.simulators import write_simulator_report
    except ImportError as error:
        if (error.name or "").split(".")[0] not in ("matplotlib", "jinja2"):
            raise
        raise MuslinError(f"a report needs {error.name}; install it with: pip install 'muslin[report]'") from error
    target = output or Path(f"{scenario}.simulators.html")
    base = preset(scenario)
    for file in (target, json_file):
        if file is not None:
            check_output(file, force)
    names = [s.strip() for s in simulators.split(",") if s.strip()]
    space = None if parameter is None else [_parameter(p, base.kind) for p in parameter]
    with ProgressView() as progress:
        found = run_comparison(scenario, names, draws, parameters=space, seed=seed, workers=workers, progress=progress)
    say(found.text())
    if json_file is not None:
        write_json(json_file, found.to_json())
        say(f"wrote {json_file}")
    say(f"wrote {write_simulator_report(found, base.body().edges, target)}")


def _parameter(text: str, kind: str) -> Parameter:
    name, _, bounds = text.partition("=")
    parts = bounds.split(":")
    try:
        if len(parts) not in (2, 3) or (len(parts) == 3 and parts[2] not in ("log", "linear")):
            raise ValueError(text)
        low, high = float(parts[0]), float(parts[1])
    except ValueError:
        raise InputError(f"--parameter takes NAME=LOW:HIGH or NAME=LOW:HIGH:log, got {text!r}") from None
    if name not in UNITS[kind]:
        raise InputError(f"--parameter: a {kind} has no {name!r}; it has {', '.join(UNITS[kind])}")
    return Parameter(name, UNITS[kind][name], low, high, "log" if parts[2:] == ["log"] else "linear")
