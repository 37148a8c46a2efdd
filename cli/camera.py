"""``muslin calibrate-camera``: a camera file from pictures of a board."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Annotated

import typer

from ..core.camera_calibration import calibrated, placed
from ..core.chessboard import Board, Corners
from ..core.errors import InputError, MissingFileError
from ..core.importing.video import is_video
from ..core.importing.video.folder import picture_files
from ..core.importing.video.pictures import colour
from ..core.importing.video.stream import stream_frames
from ..core.picture import Image
from .console import ProgressView, command, next_step, say
from .output import check_output

#: Of a video, a picture is taken so often [s]: frames next to each other tell nothing new.
_EVERY = 0.5
#: Above this reprojection error the pictures are blurred, or the board is not flat [px].
_LARGE = 1.0
#: Above this deviation more pictures are needed [widths of the picture].
_VAGUE = 0.01


def add_to(app: typer.Typer) -> None:
    """Add the command of this file."""
    app.command("calibrate-camera")(calibrate_camera)


def calibrate_camera(
    frames: Annotated[
        list[Path],
        typer.Argument(metavar="FRAMES", help="Pictures of the board, folders of them, or a video that shows it."),
    ],
    board: Annotated[
        str,
        typer.Option(metavar="9x6", help="Inner corners of a chessboard, columns x rows; squares of a ChArUco board."),
    ],
    square: Annotated[float, typer.Option(metavar="METRES", help="Edge of a square, in m.")],
    output: Annotated[Path, typer.Option("-o", "--output", metavar="CAMERA.toml", help="The camera file to write.")],
    charuco: Annotated[
        str, typer.Option(metavar="DICTIONARY", help="The board is ChArUco, with markers as DICT_5X5_100.")
    ] = "",
    marker: Annotated[float, typer.Option(metavar="METRES", help="Edge of a marker of a ChArUco board, in m.")] = 0.0,
    world: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="IMAGE",
            help="The board lying flat at the world's origin, which its first corner is; z up. Without, the "
            "camera file has no pose worth its name.",
        ),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace a camera file that is there already.")] = False,
) -> None:
    """Calibrate a camera: focal lengths, principal point, distortion of the lens; with --world where it stands.

    Move the board to every edge of the picture, and tilt it; 10 to 20 pictures are good.
    """
    check_output(output, force)
    wanted = _board(board, square, charuco, marker)
    found, asked, size = _views(frames, wanted)
    if not found:
        what = "ChArUco board" if charuco else f"chessboard of {board} inner corners (whole, with a white edge)"
        raise InputError(f"no {what} was found in {asked} picture(s); check --board, light and sharpness")
    made = calibrated(found, *size)
    lens = made.lens
    camera, spread = lens.camera, made.spread
    told = [
        f"the board was found in {len(found)} of {asked} pictures of {size[0]} x {size[1]}",
        f"fx {camera.fx:.1f} ± {spread[0]:.1f}, fy {camera.fy:.1f} ± {spread[1]:.1f}, cx {camera.cx:.1f} ± "
        f"{spread[2]:.1f}, cy {camera.cy:.1f} ± {spread[3]:.1f} px",
        f"reprojection error {made.error:.3f} px, at worst {made.each.max():.3f} px in a picture",
    ]
    if spread.max() > _VAGUE * size[0]:
        told.append("that is vague; add pictures with the board tilted more, turned by 90 degrees, near the edges")
    if made.error > _LARGE:
        told.append(f"more than {_LARGE:g} px is much: are the pictures sharp, the board flat, --board right?")
    if world:
        seen, _, other = _views(world, wanted)
        if not seen:
            raise InputError(f"the board was not found in --world {world[0]}; take another picture of it")
        if other != size:
            raise InputError(
                f"--world has pictures of {other[0]} x {other[1]} pixels, the others {size[0]} x {size[1]}"
            )
        lens, error = placed(lens, seen)
        place = ", ".join(f"{x:.3f}" for x in lens.camera.pose[:3])
        told.append(f"the camera is at ({place}) m, reprojection error {error:.3f} px; check that in the picture")
        (u, v), (a, b) = seen[0].pixels[0], seen[0].pixels[1]
        told.append(f"  the first corner is at pixel ({u:.0f}, {v:.0f}), from there x goes to ({a:.0f}, {b:.0f})")
    else:
        told.append("no pose: the camera file puts it at the origin; give --world IMAGE before comparing with metres")
    lens.save(output)
    say(f"wrote {output}")
    for line in told:
        say("  " + line)
    next_step(command("import", "VIDEO.mp4", "--camera", output, "-o", "VIDEO.zarr"))


def _board(text: str, square: float, charuco: str, marker: float) -> Board:
    columns, _, rows = text.lower().partition("x")
    if not (columns.isdecimal() and rows.isdecimal()):
        raise InputError(f"--board must be columns x rows as 9x6, but is {text!r}")
    if marker and not charuco:
        raise InputError("--marker goes with --charuco DICTIONARY; a chessboard has no markers")
    return Board(int(columns), int(rows), square, charuco, marker)


def _views(paths: Sequence[Path], board: Board) -> tuple[list[Corners], int, tuple[int, int]]:
    """Where the board was found, in how many pictures it was looked for, and their size."""
    found: list[Corners] = []
    asked, size = 0, (0, 0)
    with ProgressView() as progress:
        for where, picture in _pictures(paths):
            own = (picture.shape[1], picture.shape[0])
            if asked and own != size:
                raise InputError(
                    f"{where} has {own[0]} x {own[1]} pixels, but those before have {size[0]} x {size[1]}; "
                    "all must be of one camera at one size"
                )
            asked, size = asked + 1, own
            view = board.find(picture)
            found += [view] if view is not None else []
            progress("looking for the board", asked, 0)
    return found, asked, size


def _pictures(paths: Sequence[Path]) -> Iterator[tuple[str, Image]]:
    for path in paths:
        if not path.exists():
            raise MissingFileError(f"there is no file or folder {path}")
        if path.is_file() and is_video(path):
            due = float("-inf")
            for time, picture in stream_frames(path):
                if time >= due:
                    due = time + _EVERY
                    yield f"{path} at {time:.2f} s", picture
        else:
            for file in picture_files(path) if path.is_dir() else (path,):
                yield str(file), colour(file.read_bytes(), str(file))
