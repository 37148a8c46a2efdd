"""One take of a video as a reader found it, before its frames are read."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from ...lens import Lens
from ...picture import DepthImage, Image
from ..raw import RawGripper


@dataclass(frozen=True, eq=False)
class RawVideo:
    """A take whose frames are read when they are asked for, one after the other.

    Args:
        where: the file, for messages.
        name: that it has by itself.
        frames: gives time [s] and picture ``(H, W, 3)`` of every frame.
        depth, robot: files of these layers, one a frame; empty where there are none.
        depths: gives time [s] and depth ``(H, W)`` [m] of every picture of a depth camera with times of its own.
        gripper: poses that the file holds, on the clock of the frames.
        lens: that the file names.
        origin: what the clock of the file says where time is 0 [s].
        notes: what a person should know about it.
    """

    where: str
    name: str
    frames: Callable[[], Iterator[tuple[float, Image]]]
    depth: tuple[Path, ...] = ()
    robot: tuple[Path, ...] = ()
    depths: Callable[[], Iterator[tuple[float, DepthImage]]] | None = None
    gripper: RawGripper | None = None
    lens: Lens | None = None
    origin: float = 0.0
    notes: tuple[str, ...] = ()
