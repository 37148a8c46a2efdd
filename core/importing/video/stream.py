"""Video files, through PyAV: it gives every frame the time at which it is to be shown, OpenCV a mean rate at best."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import InputError
from ...optional import library
from ...picture import Image
from .options import VideoOptions
from .raw import RawVideo

#: How much of a file's end may lack before it counts as cut off [s].
LACKING = 0.5


def read_stream(path: Path, options: VideoOptions) -> list[RawVideo]:
    """The one take of a video file. Its time begins with the first frame."""

    def frames() -> Iterator[tuple[float, Image]]:
        first = None
        for k, (time, picture) in enumerate(stream_frames(path, options.fps is None)):
            first = time if first is None else first
            yield (time - first if options.fps is None else k / options.fps), picture

    return [RawVideo(str(path), path.stem, frames)]


def stream_frames(path: Path, timed: bool = True, begin: float = 0.0) -> Iterator[tuple[float, Image]]:
    """Time on the file's clock [s] and picture ``(H, W, 3)`` of every frame, turned as it is to be shown.

    Args:
        path: of the file.
        timed: false where the times do not matter; then they may lack, and are NaN.
        begin: nothing before this time is wanted [s]; some of it may come all the same.

    Raises:
        InputError: no video, a part of it cannot be decoded, it is cut off, or frames have no time.
    """
    av = library("av", "videos", "perception")
    try:
        container = av.open(str(path))
    except (av.error.FFmpegError, ValueError) as error:
        raise InputError(
            f"{path} cannot be opened as a video ({_reason(error)}); it is damaged, cut off or of no known format"
        ) from error
    with container:
        if not container.streams.video:
            kinds = sorted({s.type for s in container.streams}) or ["nothing"]
            raise InputError(f"{path} holds no pictures, only {' and '.join(kinds)}; give the file of the camera")
        stream = container.streams.video[0]
        stream.thread_type = "AUTO"
        if begin > 0:
            container.seek(int(begin / stream.time_base), stream=stream)
        count, last = 0, float("nan")
        for frame in _decoded(container, stream, path, av):
            if timed and frame.time is None:
                raise InputError(f"{path}: frame {count} has no time; give the rate of the camera with --fps")
            last = float("nan") if frame.time is None else float(frame.time)
            count += 1
            yield last, _upright(frame)
        _check_end(container, stream, path, last, count)


def _decoded(container: Any, stream: Any, path: Path, av: Any) -> Iterator[Any]:
    last = None
    try:
        for frame in container.decode(stream):
            if frame.is_corrupt:
                raise InputError(f"{path} is damaged {_after(last)}; {_advice(last)}")
            last = frame.time
            yield frame
    except av.error.FFmpegError as error:
        raise InputError(f"{path} cannot be decoded {_after(last)} ({_reason(error)}); {_advice(last)}") from error


def _check_end(container: Any, stream: Any, path: Path, last: float, count: int) -> None:
    """A file that is cut off ends before the time that its header says."""
    told = [float(container.duration) * 1e-6] if container.duration else []
    told += [float(stream.duration * stream.time_base)] if stream.duration else []
    begin = float(stream.start_time * stream.time_base) if stream.start_time else 0.0
    if not count:
        raise InputError(f"{path} has no frame that can be decoded; it is damaged or cut off")
    if told and (stream.duration or len(container.streams) == 1) and last + LACKING < begin + min(told):
        raise InputError(
            f"{path} is cut off: it says that it lasts {min(told):.3g} s, but there are frames to {last - begin:.3g} s "
            f"only; {_advice(last - begin)}"
        )


def _upright(frame: Any) -> Image:
    """The picture as a player shows it: phones write it as the sensor lies, and beside it how to turn it."""
    picture = frame.to_ndarray(format="rgb24")
    return np.ascontiguousarray(np.rot90(picture, round(frame.rotation / 90)))


def _after(last: float | None) -> str:
    return "from its first frame on" if last is None else f"after {last:.3f} s"


def _advice(last: float | None) -> str:
    keep = "" if last is None else f", or keep what is whole with --stop {max(0.0, last - 0.1):.2f}"
    return f"copy it again{keep}"


def _reason(error: Exception) -> str:
    return str(getattr(error, "strerror", None) or error).splitlines()[0]
