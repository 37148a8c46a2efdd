"""``muslin next``: the motion to record next."""

from pathlib import Path
from typing import Annotated

import typer

from ..core.registry import REGISTRY
from ..core.study import Study
from .console import ProgressView, command, next_step, say
from .output import check_apart, check_output, check_result, check_two, write_json
from .steps import Force, StudyFile, Workers

Box = tuple[float, float, float, float, float, float]


def add_to(app: typer.Typer) -> None:
    """Add the command of this file."""
    app.command("next")(next_experiment)


def next_experiment(
    study: StudyFile,
    effects: Annotated[
        tuple[str, str] | None,
        typer.Option("--effects", metavar="A B", help="Tell these two apart, whatever the diagnosis says."),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--out", metavar="MOTION.csv", help="Write the motion to this file, for a robot to play."),
    ] = None,
    max_speed: Annotated[float | None, typer.Option(help="Of a gripper, in m/s.")] = None,
    max_acceleration: Annotated[float | None, typer.Option(help="Of a gripper, in m/s².")] = None,
    workspace: Annotated[
        Box | None,
        typer.Option(metavar="X0 X1 Y0 Y1 Z0 Z1", help="How far from the pose where the recordings start, in m."),
    ] = None,
    max_turn: Annotated[float | None, typer.Option(help="Angle from the start pose, in rad; 0 does not turn.")] = None,
    max_turn_speed: Annotated[float | None, typer.Option(help="Of a gripper, in rad/s.")] = None,
    duration: Annotated[float | None, typer.Option(help="Of the motion, in s.")] = None,
    rate: Annotated[float, typer.Option(help="Of the samples in the file, in Hz.")] = 100.0,
    simulations: Annotated[
        int, typer.Option(min=1, metavar="N", help="About how many rollouts the search may take.")
    ] = 400,
    json_file: Annotated[
        Path | None, typer.Option("--json", metavar="FILE", help="Write the result to this JSON file, too.")
    ] = None,
    force: Force = False,
    workers: Workers = None,
) -> None:
    """Propose the gripper motion that settles what a diagnosis left open.

    Where effects are tied: the motion on which they disagree most, and how surely the right one would be named
    after it. Where effects could not be seen: the motion that would show most of them. Limits that are not given are
    what the recordings show that the robot can do.

    The file has the columns time,gripper,x,y,z,qw,qx,qy,qz in seconds and metres, z up; a recording of it is imported
    with the same file.
    """
    with ProgressView() as progress:
        loaded = Study.load(study, workers=workers, progress=progress)
        if output is not None:
            check_apart(output, loaded)
            check_output(output, force)
        if json_file is not None:
            check_result(json_file, ".json", loaded)
            if output is not None:
                check_two(output, json_file)
        found = REGISTRY.get("step", "next")(
            loaded,
            effects=effects or (),
            simulations=simulations,
            max_speed=max_speed,
            max_acceleration=max_acceleration,
            workspace=workspace,
            max_turn=max_turn,
            max_turn_speed=max_turn_speed,
            duration=duration,
            rate=rate,
        )
    say(found.text())
    if json_file is not None:
        write_json(json_file, found.to_json())
        say(f"wrote {json_file}")
    if output is not None and found.motion is not None:
        found.write(output)
        say(f"wrote {output}: time [s], gripper, x y z [m], quaternion w x y z")
    elif output is not None:
        say(f"{output} is not written: there is no motion to write")
    if found.motion is not None:
        say("record it, import it beside the other recordings, and fit and diagnose again")
    next_step(command("report", study))
