"""Annotations: where a person saw the keypoints of an object in frames of a video."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt

from .arrays import FloatArray
from .errors import InputError

#: What is known of a keypoint in a frame. COCO has the last three.
UNDECIDED, ABSENT, HIDDEN, SEEN = -1, 0, 1, 2
#: Most keypoints of one object.
MOST_KEYPOINTS = 100
_LARGEST = 1e6


@dataclass(frozen=True, eq=False)
class Annotations:
    """Keypoints of one object in N frames.

    Points are kept to a thousandth of a pixel, so that writing and reading changes nothing.

    Args:
        names: of the K keypoints.
        frames: names of the N frames: ``RECORDING/NUMBER`` in a video store, or the files of a folder of pictures.
        points: ``(N, K, 2)``, right and down [px], (0, 0) the centre of the upper left pixel; NaN where there is none.
        flags: ``(N, K)``: 2 seen, 1 hidden by something yet placed, 0 not in the picture, -1 not yet decided.
        sizes: width and height of the frames ``(N, 2)`` [px], 0 where not known.
        skeleton: pairs of keypoints with a line between them, from 0.
        video: what tells the recordings that the frames are from, by name; see
            :meth:`~muslin.core.video_frames.VideoFrames.fingerprint`. Empty where another program wrote the file.
    """

    names: tuple[str, ...]
    frames: tuple[str, ...]
    points: FloatArray
    flags: npt.NDArray[np.int8]
    sizes: npt.NDArray[np.int64]
    skeleton: tuple[tuple[int, int], ...] = ()
    video: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        check_keypoint_names(self.names)
        shape = (len(self.frames), len(self.names))
        if self.points.shape != (*shape, 2) or self.flags.shape != shape or self.sizes.shape != (shape[0], 2):
            raise InputError(
                f"{shape[0]} frames of {shape[1]} keypoints have points of shape {self.points.shape}, flags "
                f"{self.flags.shape} and sizes {self.sizes.shape}"
            )
        if len(set(self.frames)) < len(self.frames):
            twice = next(f for f in self.frames if self.frames.count(f) > 1)
            raise InputError(f"frame {twice!r} is annotated twice; keep one of the two")
        if any(not 0 <= k < shape[1] for pair in self.skeleton for k in pair):
            raise InputError(f"the skeleton names keypoints that are not among the {shape[1]}")
        if not np.isin(self.flags, (UNDECIDED, ABSENT, HIDDEN, SEEN)).all():
            raise InputError("flags of keypoints must be 2 (seen), 1 (hidden), 0 (absent) or -1 (undecided)")
        placed = self.flags >= HIDDEN
        wrong: npt.NDArray[np.bool_] = placed & ~(np.abs(self.points) <= _LARGEST).all(axis=2)  # false for NaN
        if wrong.any():
            n, k = np.argwhere(wrong)[0]
            u, v = self.points[n, k]
            raise InputError(f"frame {self.frames[n]!r}: {self.names[k]} is marked, but at ({u:g}, {v:g})")
        for n, k in np.argwhere(placed & self._outside()):
            (u, v), (width, height) = self.points[n, k], self.sizes[n]
            raise InputError(
                f"frame {self.frames[n]!r}: {self.names[k]} is at ({u:g}, {v:g}), outside of the picture of {width} x "
                f"{height} pixels; were the pictures scaled after they were annotated?"
            )
        object.__setattr__(self, "points", np.where(placed[..., None], np.round(self.points, 3) + 0.0, np.nan))

    def _outside(self) -> npt.NDArray[np.bool_]:
        """``(N, K)``: farther than half a pixel beyond the edge of a picture whose size is known."""
        beyond: npt.NDArray[np.bool_] = np.logical_or(self.points < -1.0, self.points > self.sizes[:, None])
        known: npt.NDArray[np.bool_] = np.all(self.sizes > 0, axis=1)
        return np.asarray(beyond.any(axis=2) & known[:, None])

    def __len__(self) -> int:
        return len(self.frames)

    @property
    def finished(self) -> npt.NDArray[np.bool_]:
        """``(N,)``: every keypoint of the frame is decided."""
        return np.asarray((self.flags != UNDECIDED).all(axis=1))

    def with_frame(self, number: int, points: FloatArray, flags: npt.NDArray[np.int8]) -> "Annotations":
        """Another ``points (K, 2)`` [px] and ``flags (K,)`` for one frame."""
        all_points, all_flags = self.points.copy(), self.flags.copy()
        all_points[number], all_flags[number] = points, flags
        return replace(self, points=all_points, flags=all_flags)


def blank(
    names: tuple[str, ...],
    frames: tuple[str, ...],
    sizes: npt.NDArray[np.int64],
    video: Mapping[str, str],
    skeleton: tuple[tuple[int, int], ...] = (),
) -> Annotations:
    """Frames of which nothing is decided yet; arguments as of :class:`Annotations`."""
    shape = (len(frames), len(names))
    flags = np.full(shape, UNDECIDED, np.int8)
    return Annotations(names, frames, np.full((*shape, 2), np.nan), flags, sizes, skeleton, video)


def check_keypoint_names(names: tuple[str, ...]) -> None:
    """Raise :class:`InputError` unless keypoints may be called so."""
    if not 1 <= len(names) <= MOST_KEYPOINTS:
        raise InputError(f"annotations need 1 to {MOST_KEYPOINTS} keypoints, got {len(names)}")
    for name in names:
        if not name.strip() or not name.isprintable() or len(name) > 60:
            raise InputError(f"a keypoint needs a name of 1 to 60 printable characters, got {name!r}")
    if len(set(names)) < len(names):
        twice = next(n for n in names if names.count(n) > 1)
        raise InputError(f"two keypoints are named {twice!r}; give each a name of its own")
