"""``muslin extract`` and ``muslin train``: points from videos, and what finds them."""

import inspect
import json
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from ..core.annotated_frames import annotated_frames
from ..core.arrays import FloatArray
from ..core.errors import InputError, MissingFileError
from ..core.extractor import KeypointExtractor
from ..core.frames import Frames, Video
from ..core.keypoints_coco import read_coco
from ..core.measurement import Measurement, Recording
from ..core.measurement_store import save_measurement
from ..core.registry import REGISTRY, nearest
from ..core.scenarios import PRESETS
from ..core.video_frames import VideoFrames
from ..core.video_store import load_videos
from .console import ProgressView, command, next_step, say
from .imported import summary
from .output import check_output

_OPTION = "An option of the extractor; once each. Numbers, true, false and [lists] are taken as such."

#: A point that is seen in a smaller share of the frames than this is told.
_RARE = 0.1


def add_to(app: typer.Typer) -> None:
    """Add the commands of this file."""
    app.command("extract")(extract)
    app.command("train")(train)


def extract(
    video: Annotated[Path, typer.Argument(metavar="VIDEO.zarr", help="A video, made with muslin import.")],
    extractor: Annotated[str, typer.Option(metavar="NAME", help="What finds the points; muslin plugins lists them.")],
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="RECORDING.zarr", help="The measurement to write, a Zarr store.")
    ],
    weights: Annotated[
        Path | None, typer.Option(metavar="FILE.safetensors", help="What it has learned; muslin train writes it.")
    ] = None,
    option: Annotated[list[str] | None, typer.Option(metavar="KEY=VALUE", help=_OPTION)] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace a measurement that is there already.")] = False,
) -> None:
    """Find points in every frame of a video: a measurement, with camera, gripper, motion and load of the video."""
    if output.exists() and not force:
        raise InputError(f"{output} exists already; choose another name, or say --force to replace it")
    finder, options = _extractor(extractor, option or [], weights)
    if not finder.ready:
        raise InputError(f"extractor {extractor!r} has not learned yet; give --weights FILE, which muslin train writes")
    videos = load_videos(video)
    made: list[Recording] = []
    began = time.perf_counter()
    with ProgressView() as progress:
        for k, take in enumerate(videos):
            progress(f"extracting {take.name!r}", k, len(videos))
            try:
                series = finder.extract(take.frames, take.time)
                camera = take.frames.camera
                made.append(Recording(take.name, series, take.gripper, take.motion, take.load, camera))
            except InputError as error:
                raise InputError(f"{video}, {take.name!r}: {error}") from error
    seconds = time.perf_counter() - began
    save_measurement(Measurement(tuple(made)), output, found_by={"name": extractor, **options}, overwrite=force)
    count = sum(len(take.frames) for take in videos)
    say(f"wrote {output}: {count} frames by {extractor!r} at {count / seconds:.1f} a second")
    for recording in made:
        say("  " + summary(recording))
        if rare := _rare(recording):
            say(f"    seen in less than a tenth of the frames: {rare}; look at the frames, or train with more of them")
    if any(r.series.unit == "px" and r.camera is None for r in made):
        say("  no camera is known, which comparing pixels needs; import the video with --camera FILE")
    next_step(
        command("new", "study.toml", "--measurement", output, "--scenario", "fling", "--simulator", "mujoco"),
        note=f"scenarios: {', '.join(PRESETS)}",
    )


def train(
    extractor: Annotated[str, typer.Argument(metavar="NAME", help="An extractor that learns; see muslin plugins.")],
    video: Annotated[Path, typer.Argument(metavar="VIDEO.zarr", help="A video, made with muslin import.")],
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="FILE.safetensors", help="The file of what it learns.")
    ],
    annotations: Annotated[
        Path | None,
        typer.Option(metavar="COCO.json", help="Keypoints of some frames, images named RECORDING/FRAME_NUMBER."),
    ] = None,
    option: Annotated[list[str] | None, typer.Option(metavar="KEY=VALUE", help=_OPTION)] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace a file that is there already.")] = False,
) -> None:
    """Train an extractor on the frames of a video: on all of them, or on those that are annotated."""
    check_output(output, force)
    finder, _ = _extractor(extractor, option or [], None)
    save = getattr(finder, "save", None)
    if save is None:
        raise InputError(f"extractor {extractor!r} learns nothing; use it at once: muslin extract")
    frames, keypoints = _annotated(video, annotations) if annotations else (_all(load_videos(video)), None)
    began = time.perf_counter()
    with ProgressView() as progress:
        finder.fit(frames, keypoints, progress)
    save(output)
    what = "annotated frames" if annotations else "frames"
    say(f"wrote {output}: {extractor!r}, trained on {len(frames)} {what} in {time.perf_counter() - began:.0f} s")
    next_step(command("extract", video, "--extractor", extractor, "--weights", output, "-o", "POINTS.zarr"))


def _rare(recording: Recording) -> str:
    """Numbers of the points that hardly a frame shows, of an extractor whose points keep their order."""
    share = recording.series.valid.mean(axis=0)
    few = [str(k) for k in np.flatnonzero(share < _RARE)] if recording.series.correspondence else []
    return f"point{'s' if len(few) > 1 else ''} {', '.join(few)}" if few else ""


def _annotated(video: Path, path: Path) -> tuple[Frames, FloatArray]:
    """The annotated frames and their keypoints ``(N, K, 2)`` [px]."""
    try:
        return annotated_frames(read_coco(path), VideoFrames(video))
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def _all(videos: Sequence[Video]) -> Frames:
    return Frames.joined([v.frames for v in videos])


def _extractor(name: str, given: Sequence[str], weights: Path | None) -> tuple[KeypointExtractor, dict[str, Any]]:
    """The extractor of that name, and its options; it must look at pictures."""
    make = REGISTRY.get("extractor", name)
    if not make.needs_images:
        seeing = ", ".join(n for n in REGISTRY.names("extractor") if REGISTRY.get("extractor", n).needs_images)
        raise InputError(f"extractor {name!r} takes points, not pictures; those that take them: {seeing or 'none'}")
    known = [n for n in inspect.signature(make).parameters if n != "weights"]
    options: dict[str, Any] = {}
    for text in given:
        key, equals, value = text.partition("=")
        key = key.strip().replace("-", "_")
        if not equals or key not in known:
            raise InputError(
                f"--option {text!r}: extractor {name!r} has no such option.{nearest(key, known)} Write KEY=VALUE; "
                f"options: {', '.join(known) or 'none'}"
            )
        options[key] = _value(value)
    if weights is not None:
        if "weights" not in inspect.signature(make).parameters:
            raise InputError(f"extractor {name!r} learns nothing, so it has no weights; leave --weights out")
        if not weights.is_file():
            raise MissingFileError(f"there is no file {weights}; muslin train {name} writes one")
        options["weights"] = str(weights.absolute())
    try:
        finder: KeypointExtractor = make(**options)
    except TypeError as error:
        raise InputError(
            f"extractor {name!r} cannot be made with {', '.join(given) or 'no options'}: {error}"
        ) from error
    return finder, options


def _value(text: str) -> Any:
    try:
        return json.loads(text)
    except ValueError:
        return text
