"""What a person says about a file that is imported; it wins over what the file says about itself."""

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class ImportOptions:
    """Options of one file.

    Args:
        unit: of the coordinates in the file: ``"m"``, ``"cm"``, ``"mm"`` or ``"px"``; None takes the
            file's own word, or metres.
        up: axis of the file that points up: ``"x"``, ``"y"`` or ``"z"``.
        start, stop: keep frames with ``start <= time <= stop`` [s]; None keeps all.
        name: of the recording; None takes the file's own word, or the file name without its suffix.
        motion: recordings of one motion are repeats; None takes the file's own word, or the name.
        load: mass hung on the object [kg]; None takes the file's own word, or zero.
        correspondence: whether point p is the same spot in every frame; None takes the file's own
            word, or true.
        gripper: CSV file of gripper poses.
        camera: camera file of the pictures that points in pixels are of, or of the frames of a video.
    """

    unit: str | None = None
    up: str = "z"
    start: float | None = None
    stop: float | None = None
    name: str | None = None
    motion: str | None = None
    load: float | None = None
    correspondence: bool | None = None
    gripper: Path | None = None
    camera: Path | None = None
