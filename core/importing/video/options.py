"""What a person says about a video that is imported; it wins over what the file says about itself."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from ..options import ImportOptions

#: Which of a bag's two times is taken: when a thing was measured, or when it was written.
Clock = Literal["header", "log"]


@dataclass(frozen=True)
class VideoOptions(ImportOptions):
    """Options of one video; ``unit`` and ``up`` are those of the gripper poses.

    Args:
        fps: frames a second, where the files do not say when frames were taken, or say it wrongly.
        size: width and height that frames are scaled to [px]; None keeps theirs.
        offset: added to the time of the frames to have that of the poses [s]; None: found from the motion.
        depth: folder of 16-bit pictures in millimetres, 0 where there is none, one a frame.
        robot: folder of masks that are not zero where the robot is, one a frame.
        image: camera of a LeRobot data set, or image topic of a bag; None: the only one.
        depth_topic: topic of a bag with depth that is aligned with its pictures.
        pose: feature of a LeRobot data set, or pose topics of a bag, one a gripper; empty: the only one there is;
            ``("none",)``: no poses.
        pose_columns: for each gripper, the entries of that feature that are x, y, z and optionally qw, qx, qy, qz.
        takes: episodes of a LeRobot data set; none: all.
        clock: of a bag.
    """

    fps: float | None = None
    size: tuple[int, int] | None = None
    offset: float | None = 0.0
    depth: Path | None = None
    robot: Path | None = None
    image: str | None = None
    depth_topic: str | None = None
    pose: tuple[str, ...] = ()
    pose_columns: tuple[str, ...] = ()
    takes: tuple[str, ...] = ()
    clock: Clock = "header"
