"""``muslin bench-material``: whether a simulator's object is what its material says."""

from pathlib import Path
from typing import Annotated

import typer

from ..core.bench import TESTS, lines, run_bench
from ..core.registry import REGISTRY
from .console import ProgressView, say
from .output import check_output, write_json


def add_to(app: typer.Typer) -> None:
    """Add the command of this file."""
    app.command("bench-material")(bench_material)


def bench_material(
    simulator: Annotated[str, typer.Option("--simulator", "-s", help="Name of the simulator.")],
    test: Annotated[
        list[str] | None, typer.Option("--test", help=f"Only this test; may be repeated. {', '.join(TESTS)}.")
    ] = None,
    full: Annotated[
        bool, typer.Option("--full/--quick", help="The whole grid of materials and meshes (ten minutes), or a part.")
    ] = False,
    json_file: Annotated[Path | None, typer.Option("--json", help="Write the results here, too.")] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace the file of --json if it is there.")] = False,
) -> None:
    """Measure what a simulator makes of a material: virtual tests held against their closed forms.

    A miss is shown and leaves the exit status at 0: this measures, and does not judge.
    """
    made = REGISTRY.get("simulator", simulator)()
    if json_file is not None:
        check_output(json_file, force)
    with ProgressView() as progress:
        report = run_bench(made, test or (), not full, progress)
    for line in lines(report):
        say(line)
    if json_file is not None:
        write_json(json_file, report.to_json())
        say(f"wrote {json_file}")
