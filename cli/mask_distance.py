"""``muslin mask-distance``: how far apart two sets of videos are, by the pixels of the object."""

from pathlib import Path
from typing import Annotated

import typer

from ..core.errors import InputError
from ..core.registry import REGISTRY
from ..core.video_store import load_videos
from .console import say
from .output import check_result, write_json


def add_to(app: typer.Typer) -> None:
    """Add the command of this file."""
    app.command("mask-distance")(mask_distance)


def mask_distance(
    one: Annotated[Path, typer.Argument(metavar="ONE.zarr", help="A video, made with muslin import.")],
    other: Annotated[Path, typer.Argument(metavar="OTHER.zarr", help="A video of the same camera and clock.")],
    hue: Annotated[
        str, typer.Option(metavar="FROM,TO", help="Hue of the object, 0 to 360 degrees; 340,20 runs through red.")
    ] = "",
    saturation: Annotated[
        str, typer.Option(metavar="LEAST,MOST", help="Its saturation, 0 grey to 1 pure; default any.")
    ] = "",
    value: Annotated[str, typer.Option(metavar="LEAST,MOST", help="Its value, 0 black to 1; default any.")] = "",
    colour: Annotated[
        str,
        typer.Option(metavar="#RRGGBB", help="Its colour, instead; default that of the pictures that muslin draws."),
    ] = "",
    tolerance: Annotated[
        float, typer.Option(metavar="DEGREES", help="How far hues lie from that of --colour at most.")
    ] = 15.0,
    speck: Annotated[int, typer.Option(metavar="PIXELS", help="Patches smaller than this are left out.")] = 20,
    json_file: Annotated[
        Path | None, typer.Option("--json", metavar="FILE", help="Write it with the curve over time to this file, too.")
    ] = None,
) -> None:
    """Say how far apart the object is in two sets of videos: the Chamfer distance of its pixels.

    The object is found by its colour. Takes of the same name are compared, a single take with each of the other side.
    The distance is averaged over time; its mean and standard deviation are over the takes.
    """
    if json_file is not None:
        check_result(json_file, ".json")
    found = REGISTRY.get("step", "mask-distance")(
        load_videos(one),
        load_videos(other),
        colour=colour or None,
        tolerance=tolerance,
        hue=_bounds(hue, "--hue"),
        saturation=_bounds(saturation, "--saturation"),
        value=_bounds(value, "--value"),
        speck=speck,
    )
    say(found.text())
    if json_file is not None:
        write_json(json_file, found.to_json())
        say(f"wrote {json_file}")


def _bounds(text: str, option: str) -> tuple[float, ...] | None:
    if not text.strip():
        return None
    try:
        bounds = tuple(float(part) for part in text.split(","))
    except ValueError:
        bounds = ()
    if len(bounds) != 2:
        raise InputError(f"{option} must be two numbers with a comma between them, but is {text!r}")
    return bounds
