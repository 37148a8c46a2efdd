"""``muslin import``: files of other programs to one measurement."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, TypeVar

import numpy as np
import typer

from ..core.errors import InputError
from ..core.importing import ImportOptions, import_file
from ..core.measurement import Measurement, Recording
from ..core.measurement_store import save_measurement
from ..core.scenarios import PRESETS
from .console import command, next_step, say

T = TypeVar("T")
_EACH = "Once for all files, or once a file, in their order."


def add_to(app: typer.Typer) -> None:
    """Add the commands of this file."""
    app.command("import")(import_files)


def import_files(
    files: Annotated[list[Path], typer.Argument(metavar="FILE", help="markers.c3d, points.npz or track.csv.")],
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="RECORDING.zarr", help="The measurement to write, a Zarr store.")
    ],
    unit: Annotated[
        str | None,
        typer.Option(metavar="m|cm|mm|px", help="Unit of the coordinates; default what the file says, else m."),
    ] = None,
    up: Annotated[
        str, typer.Option(metavar="x|y|z", help="Axis of the file that points up; the frame is turned so that it is z.")
    ] = "z",
    start: Annotated[
        list[float] | None, typer.Option(metavar="SECONDS", help=f"Drop frames before this time, in s. {_EACH}")
    ] = None,
    stop: Annotated[
        list[float] | None, typer.Option(metavar="SECONDS", help=f"Drop frames after this time, in s. {_EACH}")
    ] = None,
    name: Annotated[
        list[str] | None, typer.Option(metavar="NAME", help="Name of the recording; default the file's. Once a file.")
    ] = None,
    motion: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME",
            help=f"What was done; recordings of one motion and load are repeats, which tell the noise. {_EACH}",
        ),
    ] = None,
    load: Annotated[
        list[float] | None, typer.Option(metavar="KG", help=f"Mass hung on the object, in kg. {_EACH}")
    ] = None,
    gripper: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="FILE.csv",
            help="Gripper poses, for C3D and CSV: columns time,gripper,x,y,z and optionally qw,qx,qy,qz; positions in "
            f"the unit and axes of the points (m beside px). {_EACH}",
        ),
    ] = None,
    correspondence: Annotated[
        bool | None,
        typer.Option(
            "--correspondence/--no-correspondence",
            help="Whether a point is the same spot of the object in every frame; default what the file says, else yes.",
        ),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace a measurement that is there already.")] = False,
) -> None:
    """Import recorded points: several files become several recordings of one measurement.

    C3D: labelled markers, in the unit that the file names.

    NPZ: time (T,) in s; points (T, P, 2 or 3) in m or px, NaN where not seen; optionally correspondence,
    gripper_pose (T, G, 3 or 7) as x y z and quaternion w x y z, gripper_time, recording, motion, load in kg, unit.

    CSV, one row an observation: columns time,point,x,y and optionally z, recording; a missing row is a
    point not seen.
    """
    if output.exists() and not force:  # said before a long file is read
        raise InputError(f"{output} exists already; choose another name, or say --force to replace it")
    options = ImportOptions(unit=unit, up=up, correspondence=correspondence)
    recordings: list[Recording] = []
    for k, file in enumerate(files):
        own = replace(
            options,
            start=_each(start, k, files, "--start"),
            stop=_each(stop, k, files, "--stop"),
            motion=_each(motion, k, files, "--motion"),
            load=_each(load, k, files, "--load"),
            gripper=_each(gripper, k, files, "--gripper"),
            name=_name(name, k, files),
        )
        recordings += import_file(file, own)
    measurement = Measurement(tuple(recordings))
    save_measurement(measurement, output, overwrite=force)
    say(f"wrote {output}")
    for recording in measurement.recordings:
        say("  " + _summary(recording))
    next_step(
        command("new", "study.toml", "--measurement", output, "--scenario", "fling", "--simulator", "mujoco"),
        note=f"scenarios: {', '.join(PRESETS)}",
    )


def _each(values: Sequence[T] | None, k: int, files: Sequence[Path], option: str) -> T | None:
    if not values:
        return None
    if len(values) == 1:
        return values[0]
    if len(values) != len(files):
        raise InputError(f"{option} is given {len(values)} times for {len(files)} files; give it once, or once a file")
    return values[k]


def _name(names: Sequence[str] | None, k: int, files: Sequence[Path]) -> str | None:
    if names and len(names) == 1 and len(files) > 1:
        raise InputError(f"--name is given once for {len(files)} files; give it once a file, in their order")
    return _each(names, k, files, "--name")


def _summary(recording: Recording) -> str:
    series = recording.series
    frames, count, axes = series.points.shape
    seen = float(np.mean(series.valid))
    span = np.ptp(series.points[series.valid], axis=0)
    extent = " x ".join(f"{s:.3g}" for s in span)
    parts = [
        f"{recording.name}: {frames} frames from {series.time[0]:g} to {series.time[-1]:g} s",
        f"{count} points{'' if series.correspondence else ' without correspondence'}, {seen:.1%} seen",
        f"within {extent} {series.unit}{'' if axes == 3 else ' (x, y)'}",
    ]
    if recording.gripper is not None:
        parts.append(f"{recording.gripper.grippers} gripper(s)")
    if recording.load:
        parts.append(f"load {recording.load:g} kg")
    return ", ".join(parts)
