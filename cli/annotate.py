"""``muslin annotate``: mark keypoints in frames of a video, on a page in the browser."""

import webbrowser
from pathlib import Path
from typing import Annotated

import typer

from ..core.annotated_frames import places
from ..core.annotations import UNDECIDED, Annotations
from ..core.errors import InputError
from ..core.keypoints_coco import read_coco, write_coco
from ..core.video_frames import VideoFrames
from .annotating.choosing import COUNT, joined, resumed, spread
from .annotating.server import AnnotationServer
from .annotating.session import Session
from .console import command, next_step, say
from .output import check_output


def add_to(app: typer.Typer) -> None:
    """Add the command of this file."""
    app.command("annotate")(annotate)


def annotate(
    video: Annotated[Path, typer.Argument(metavar="VIDEO.zarr", help="A video store, from: muslin import")],
    output: Annotated[
        Path,
        typer.Option(
            "-o",
            "--output",
            metavar="KEYPOINTS.json",
            help="The file to write, COCO keypoints; one that is there is gone on with.",
        ),
    ],
    names: Annotated[
        str,
        typer.Option(metavar="NAME,NAME,…", help="The keypoints, as corner_a,corner_b; default those of the file."),
    ] = "",
    every: Annotated[int | None, typer.Option(metavar="N", help="Annotate every N-th frame of each take.")] = None,
    count: Annotated[
        int | None,
        typer.Option(metavar="N", help=f"Annotate N frames, spread evenly over all takes; default {COUNT}."),
    ] = None,
    other: Annotated[
        Path | None,
        typer.Option("--import", metavar="OTHER.json", help="Begin with COCO keypoints that another program wrote."),
    ] = None,
    category: Annotated[
        str, typer.Option(metavar="NAME", help="With --import: the category, where several have keypoints.")
    ] = "",
    browser: Annotated[
        bool, typer.Option("--browser/--no-browser", help="Open the page, or only print its address.")
    ] = True,
) -> None:
    """Mark keypoints in frames of a video, on a page in the browser; every change is saved at once.

    The page is served to this machine alone. Done on the page, or Ctrl-C here, ends it; the same command goes on later.

    The file holds COCO keypoints, which other programs read; their images are RECORDING/NUMBER, frames from 0.
    """
    frames = VideoFrames(video)
    check_output(output, force=True)
    wanted = tuple(n.strip() for n in names.split(",")) if names else ()
    if every is not None and count is not None:
        raise InputError("--every and --count both say how many frames; give one of them")
    for option, value in (("--every", every), ("--count", count)):
        if value is not None and value < 1:
            raise InputError(f"{option} must be 1 or more, but is {value}")
    if category and other is None:
        raise InputError("--category goes with --import")
    begun = resumed(output, frames, wanted) if output.exists() else None
    taken = read_coco(other, category) if other is not None else None
    asked = every is not None or count is not None
    chosen = spread(frames, every, count) if asked or (begun is None and taken is None) else []
    annotations, filled = joined(frames, wanted, chosen, begun, taken)
    if taken is not None:
        say(f"took {filled} annotated frames from {other}")
        write_coco(annotations, output)
    elif begun is not None:
        say(f"going on with {output}: {_told(annotations)}")
    after = command("train", "heatmap", video, "--annotations", output, "-o", output.with_suffix(".safetensors"))
    session = Session(annotations, places(annotations, frames), frames, output)
    _serve(AnnotationServer(session, after), browser)
    _summary(session.finish(), output, after, command("annotate", video, "-o", output))


def _serve(server: AnnotationServer, browser: bool) -> None:
    """Until the page says that it is done, or Ctrl-C."""
    try:
        say(f"annotate at {server.url}")
        opened = browser and webbrowser.open(server.url)
        place = "it is open in your browser" if opened else "open it in a browser on this machine"
        say(f"{place}; Done there or Ctrl-C here ends")
        server.serve_forever(poll_interval=0.1)
    except KeyboardInterrupt:
        say("")
    finally:
        server.server_close()


def _summary(annotations: Annotations, output: Path, after: str, again: str) -> None:
    if not (annotations.flags != UNDECIDED).any():
        say(f"nothing was annotated{'' if output.exists() else f', and {output} not written'}")
    else:
        say(f"wrote {output}: {_told(annotations)}")
    if annotations.finished.all():
        next_step(after)
    elif annotations.finished.any():
        next_step(after, again)
    elif output.exists():
        next_step(again)


def _told(annotations: Annotations) -> str:
    finished = annotations.finished
    begun = (annotations.flags != UNDECIDED).any(axis=1) & ~finished
    halves = f", {int(begun.sum())} more begun" if begun.any() else ""
    return f"{int(finished.sum())} of {len(annotations)} frames annotated{halves}"
