"""What tests of videos share: a square that moves as its gripper does, filmed."""

from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path

import av
import cv2
import numpy as np

from muslin.core.arrays import FloatArray
from muslin.core.picture import Image

WIDTH, HEIGHT, RATE = 64, 48, 30.0


def place(time: FloatArray) -> FloatArray:
    """Where the gripper is along x [m]: three moves of different length and speed, standing still between."""
    moves = ((0.3, 0.25, 0.05), (0.9, 0.15, -0.03), (1.5, 0.3, 0.06))
    return np.asarray(sum(d * np.clip((time - t) / s, 0, 1) for t, s, d in moves))


def pictures(time: FloatArray, noise: float = 3.0) -> list[Image]:
    """A bright square on grey, where the gripper is at ``time``."""
    rng = np.random.default_rng(0)
    made = []
    for x in place(time):
        frame = np.full((HEIGHT, WIDTH, 3), (60, 70, 80), float)
        left = round(8 + 400 * x)
        frame[16:30, left : left + 12] = (220, 60, 40)
        made.append(np.clip(frame + rng.normal(0, noise, frame.shape), 0, 255).astype(np.uint8))
    return made


def write_video(
    path: Path, frames: Sequence[Image], time: FloatArray | None = None, *, turn: int = 0, **options: str
) -> Path:
    """An H.264 file; its time stamps are in milliseconds."""
    time = np.arange(len(frames)) / RATE if time is None else time
    with av.open(str(path), "w", options=options) as container:
        stream = container.add_stream("libx264", rate=30, options={"crf": "10", "preset": "ultrafast"})
        stream.height, stream.width = frames[0].shape[:2]
        stream.pix_fmt = "yuv420p"
        stream.codec_context.time_base = Fraction(1, 1000)
        if turn:
            stream.set_display_rotation(turn)
        for t, picture in zip(time, frames, strict=True):
            frame = av.VideoFrame.from_ndarray(picture, format="rgb24")
            frame.pts, frame.time_base = round(1000 * t), Fraction(1, 1000)
            for packet in stream.encode(frame):
                container.mux(packet)
        for packet in stream.encode():
            container.mux(packet)
    return path


def write_folder(
    path: Path, frames: Sequence[np.ndarray], times: FloatArray | None = None, ending: str = "png"
) -> Path:
    path.mkdir(parents=True)
    for k, picture in enumerate(frames):  # numbers without leading zeros: their order is by value
        cv2.imwrite(str(path / f"f{k}.{ending}"), picture[..., ::-1] if picture.ndim == 3 else picture)
    if times is not None:
        (path / "time.csv").write_text("time [s]\n" + "".join(f"{t:.6f}\n" for t in times))
    return path


def write_poses(path: Path, time: FloatArray, clock: float = 0.0) -> Path:
    """Poses at ``time``, on a clock that says ``clock`` where that of the pictures says 0."""
    rows = "".join(f"{t + clock:.6f},0,{x:.6f},0,0.3\n" for t, x in zip(time, place(time), strict=True))
    path.write_text("time,gripper,x,y,z\n" + rows)
    return path
