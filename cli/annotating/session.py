"""Annotations while they are made: a change is on disk before it counts, and overwrites none that it does not know."""

import threading
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from ...core.annotations import HIDDEN, Annotations
from ...core.errors import InputError, StoreError
from ...core.keypoints_coco import write_coco
from ...core.video_frames import VideoFrames
from ..images import png

_Place = Annotated[float, Field(allow_inf_nan=False)]


class _Point(BaseModel):
    """One keypoint as the page sends it: place [px], which is null where there is none, and flag."""

    model_config = ConfigDict(extra="forbid", strict=True)
    u: _Place | None
    v: _Place | None
    flag: Annotated[int, Field(ge=-1, le=2)]


class _Change(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True)
    frame: int
    version: int
    points: list[_Point]


class StaleError(InputError):
    """A change was made to a frame that has changed since.

    Args:
        frame: what the page should show now.
    """

    def __init__(self, message: str, frame: dict[str, Any]) -> None:
        super().__init__(message)
        self.frame = frame


class Session:
    """One person, perhaps with several tabs, one file.

    Args:
        annotations: to begin with.
        places: recording and number of each of their frames.
        video: that they are of.
        file: to write after every change.
    """

    def __init__(self, annotations: Annotations, places: list[tuple[str, int]], video: VideoFrames, file: Path) -> None:
        self.annotations = annotations
        self.file = file
        self._places = places
        self._video = video
        self._versions = [0] * len(annotations)
        self._lock = threading.Lock()
        self._on_disk = _identity(file)

    def state(self) -> dict[str, Any]:
        """All that the page needs to begin."""
        with self._lock:
            return {
                "video": self._video.path.name,
                "file": self.file.name,
                "names": self.annotations.names,
                "skeleton": self.annotations.skeleton,
                "frames": [self._frame(n) for n in range(len(self.annotations))],
            }

    def picture(self, number: int) -> bytes:
        """The PNG of one of the frames that are annotated; :class:`InputError` for any other."""
        if not 0 <= number < len(self._places):
            raise InputError(f"there are frames 0 to {len(self._places) - 1}, but not {number}")
        return png(self._video.rgb(*self._places[number]))

    def change(self, posted: bytes) -> int:
        """Save the points of one frame; returns the frame's new version.

        Raises:
            StaleError: the frame is not the one that was changed; nothing is saved.
            InputError: the points cannot be right; nothing is saved.
            StoreError: the file cannot be written, or another program wrote it; what it held, it holds.
        """
        try:
            change = _Change.model_validate_json(posted)
        except ValidationError as error:
            first = error.errors()[0]
            raise InputError(f"{'.'.join(map(str, first['loc'])) or 'the post'}: {first['msg']}") from error
        with self._lock:
            names, n = self.annotations.names, change.frame
            if not 0 <= n < len(self._versions):
                raise InputError(f"there are frames 0 to {len(self._versions) - 1}, but not {n}")
            if len(change.points) != len(names):
                raise InputError(f"{len(change.points)} points for {len(names)} keypoints")
            if change.version != self._versions[n]:
                message = f"frame {self.annotations.frames[n]} was changed in another tab"
                raise StaleError(message, self._frame(n))
            flags = np.array([p.flag for p in change.points], np.int8)
            points = np.array([(np.nan if p.u is None else p.u, np.nan if p.v is None else p.v) for p in change.points])
            self._save(self.annotations.with_frame(n, points, flags))
            self._versions[n] += 1
            return self._versions[n]

    def finish(self) -> Annotations:
        """What was annotated, once no change is under way."""
        with self._lock:
            return self.annotations

    def _save(self, changed: Annotations) -> None:
        if _identity(self.file) != self._on_disk:
            raise StoreError(
                f"another program wrote or removed {self.file.name} meanwhile; nothing was overwritten: move that file "
                "away, or end this muslin annotate and start it again to go on from it"
            )
        write_coco(changed, self.file)
        self._on_disk = _identity(self.file)
        self.annotations = changed

    def _frame(self, n: int) -> dict[str, Any]:
        a, (recording, number) = self.annotations, self._places[n]
        width, height = self._video.size(recording)
        points = [
            {"u": float(u) if f >= HIDDEN else None, "v": float(v) if f >= HIDDEN else None, "flag": int(f)}
            for (u, v), f in zip(a.points[n], a.flags[n], strict=True)
        ]
        place = {"recording": recording, "number": number, "width": width, "height": height}
        return {**place, "version": self._versions[n], "points": points}


def _identity(file: Path) -> tuple[int, int, int] | None:
    """Changes whenever a file is replaced or written."""
    try:
        stat = file.stat()
    except FileNotFoundError:
        return None
    return stat.st_ino, stat.st_mtime_ns, stat.st_size
