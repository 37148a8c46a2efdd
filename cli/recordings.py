"""``muslin import``: files of other programs to one measurement."""

import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import typer

from ..core.dataset import Dataset, DatasetNote, cropped
from ..core.errors import InputError
from ..core.importing import ImportOptions, import_together
from ..core.measurement import Measurement, Recording
from ..core.measurement_store import save_measurement
from ..core.registry import REGISTRY
from ..core.scenarios import PRESETS
from .console import command, next_step, say
from .imported import say_recordings
from .per_file import once_or_each, per_file
from .videos import all_videos, import_videos

_FILES = (
    "markers.c3d, points.npz or track.csv; video.mp4, a folder of pictures, a LeRobot data set or an MCAP or ROS bag; "
    "with --dataset the one file or folder of that set."
)
_EACH = "Once for all files (takes of a set), or once each, in their order."


def add_to(app: typer.Typer) -> None:
    """Add the commands of this file."""
    app.command("import")(import_files)


def import_files(
    files: Annotated[list[Path], typer.Argument(metavar="FILE", help=_FILES)],
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
            "--gripper",
            "--poses",
            metavar="FILE.csv",
            help="Gripper poses (C3D, CSV, videos): columns time,gripper,x,y,z and optionally qw,qx,qy,qz; positions "
            f"in the unit and axes of the points (m beside px). {_EACH}",
        ),
    ] = None,
    camera: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="CAMERA.toml",
            help="The camera of the frames, or of points in pixels, as muslin calibrate-camera writes it; a distorted "
            f"picture is undistorted. {_EACH}",
        ),
    ] = None,
    correspondence: Annotated[
        bool | None,
        typer.Option(
            "--correspondence/--no-correspondence",
            help="Whether a point is the same spot of the object in every frame; default what the file says, else yes.",
        ),
    ] = None,
    dataset: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="FILE is a file or folder of this published set; see: muslin plugins"),
    ] = None,
    take: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME",
            help="With --dataset: takes to read, as A,B,C or once each; default all. Of LeRobot: an episode, or all.",
        ),
    ] = None,
    fps: Annotated[
        float | None,
        typer.Option(
            metavar="RATE", help="Video: frames a second, where the files do not say the times, or say them wrongly."
        ),
    ] = None,
    size: Annotated[
        str | None, typer.Option(metavar="WxH", help="Video: scale frames, and the camera with them, to these pixels.")
    ] = None,
    offset: Annotated[
        list[str] | None,
        typer.Option(
            metavar="SECONDS|auto",
            help="Video: add this to the time of the frames to have that of the poses; auto finds it from the motion "
            f"in the pictures. {_EACH}",
        ),
    ] = None,
    depth: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="FOLDER", help=f"Video: 16-bit pictures of depth in mm, 0 for holes, one a frame. {_EACH}"
        ),
    ] = None,
    robot: Annotated[
        list[Path] | None,
        typer.Option(metavar="FOLDER", help=f"Video: masks, not zero where the robot is, one a frame. {_EACH}"),
    ] = None,
    image: Annotated[
        str | None, typer.Option(metavar="NAME", help="LeRobot: which camera. Bag: which topic of images.")
    ] = None,
    depth_topic: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="Bag: topic of depth, aligned with the pictures (16UC1 in mm, 32FC1 in m)."),
    ] = None,
    pose: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME",
            help="LeRobot: the feature that holds the gripper's pose. Bag: its topic, /tf:FRAME for a transform; once "
            "a gripper. none: no poses.",
        ),
    ] = None,
    pose_columns: Annotated[
        list[str] | None,
        typer.Option(
            metavar="X,Y,Z[,QW,QX,QY,QZ]",
            help="LeRobot: entries of that feature, by name or number from 0; once a gripper.",
        ),
    ] = None,
    clock: Annotated[
        str | None,
        typer.Option(metavar="header|log", help="Bag: time of measuring (default) or of writing."),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace a measurement that is there already.")] = False,
) -> None:
    """Import recorded points or videos: several files become several recordings of one store.

    C3D: labelled markers, in the unit that the file names. In all formats a point that jumps to exactly 0, 0, 0 was
    not seen.

    NPZ: time (T,) in s; points (T, P, 2 or 3) in m or px, NaN where not seen; optionally correspondence,
    gripper_pose (T, G, 3 or 7) as x y z and quaternion w x y z, gripper_time, recording, motion, load in kg, unit.

    CSV, one row an observation: columns time,point,x,y and optionally z, recording; a missing row is a
    point not seen.

    Videos: a file, or a folder of PNG or JPEG files with --fps or a file time.csv (a time in s a line), also as
    muslin render writes it; a LeRobot data set; an MCAP file or ROS bag. They become frames on the clock of the
    gripper poses, from which muslin extract takes points.

    A published set (--dataset): all of its takes or those named, with --start and --stop once or once a take.
    """
    if output.exists() and not force:  # said before a long file is read
        raise InputError(f"{output} exists already; choose another name, or say --force to replace it")
    videos: dict[str, Any] = {"fps": fps, "size": size, "offset": offset, "depth": depth, "robot": robot}
    videos |= {"image": image, "depth-topic": depth_topic, "pose": pose, "pose-columns": pose_columns, "clock": clock}
    each = {"start": start, "stop": stop, "motion": motion, "load": load, "gripper": gripper, "name": name}
    each["camera"] = camera
    seen = dataset is None and all_videos(files)
    if not seen and (wrong := [f"--{option}" for option, given in videos.items() if given is not None]):
        raise InputError(f"{wrong[0]} goes with videos, and {files[0]} is imported as points; leave it out")
    if seen:
        if correspondence is not None:
            raise InputError("--correspondence goes with points; of a video, the extractor says it")
        import_videos(files, output, unit, up, each, videos, take or [], force)
        return
    if dataset is None:
        if take:
            raise InputError("--take names takes of a published set; say which set with --dataset")
        options = ImportOptions(unit=unit, up=up, correspondence=correspondence)
        recordings = _of_files(files, options, each)
        scenario = "beam" if any(r.load for r in recordings) else "fling"  # loads hang on beams alone
    else:
        own: dict[str, object] = {"--name": name, "--motion": motion, "--load": load, "--gripper": gripper}
        own["--camera"] = camera
        own |= {"--unit": unit, "--up": up != "z", "--correspondence": correspondence is not None}
        if wrong := [option for option, given in own.items() if given]:
            raise InputError(f"{wrong[0]} does not go with --dataset, which knows that itself; leave it out")
        recordings, scenario = _of_dataset(dataset, files, take or [], start, stop), "NAME"  # none suits every set
    measurement = Measurement(tuple(recordings))
    save_measurement(measurement, output, overwrite=force)
    say(f"wrote {output}")
    say_recordings(measurement.recordings)
    next_step(
        command("new", "study.toml", "--measurement", output, "--scenario", scenario, "--simulator", "mujoco"),
        note=f"scenarios: {', '.join(PRESETS)}",
    )


def _of_files(
    files: Sequence[Path], options: ImportOptions, each: Mapping[str, Sequence[Any] | None]
) -> list[Recording]:
    """What the files hold; ``each`` are options that are given once, or once a file."""
    with _notes_said():
        told = per_file(each, len(files))
        return import_together([(file, replace(options, **own)) for file, own in zip(files, told, strict=True)])


@contextmanager
def _notes_said() -> Iterator[None]:
    """Say what readers left out or put right; other warnings go on."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", DatasetNote)
        yield
    for warning in caught:
        if issubclass(warning.category, DatasetNote):
            say(str(warning.message))
        else:
            warnings.warn_explicit(warning.message, warning.category, warning.filename, warning.lineno)


def _of_dataset(
    name: str, files: Sequence[Path], takes: Sequence[str], start: list[float] | None, stop: list[float] | None
) -> list[Recording]:
    """Takes of a published set, cropped; what its reader left out is said."""
    if len(files) != 1:
        raise InputError(
            f"--dataset reads one file or folder, but {len(files)} are named: {', '.join(map(str, files))}; import "
            "them one by one, and write the takes of one as --take A,B,C"
        )
    read: Dataset = REGISTRY.get("dataset", name)
    wanted = [part.strip() for take in takes for part in take.split(",") if part.strip()]
    if takes and not wanted:
        raise InputError("--take names no take; write --take A,B,C, or leave it out to read all")
    with _notes_said():
        recordings = read(files[0], wanted)
    starts = once_or_each(start, len(recordings), "--start", "take")
    stops = once_or_each(stop, len(recordings), "--stop", "take")
    return [cropped(r, a, b) for r, a, b in zip(recordings, starts, stops, strict=True)]
