"""Annotations and the video that they are of, brought together."""

import re

import numpy as np

from .annotations import SEEN, Annotations
from .arrays import FloatArray
from .errors import InputError
from .frames import Frames
from .video_frames import VideoFrames

#: A frame of a recording, perhaps with the ending of a picture.
_FRAME = re.compile(r"(?P<recording>[^/\\]+)[/\\]0*(?P<number>\d+)(\.[A-Za-z]+)?")


def frame_name(recording: str, number: int) -> str:
    """The name of a frame in annotations, numbers from 0."""
    return f"{recording}/{number}"


def places(annotations: Annotations, video: VideoFrames) -> list[tuple[str, int]]:
    """Recording and number of every annotated frame.

    Names are ``RECORDING/NUMBER``, numbers from 0. The files of a folder may have any names where they are as many as
    the video's one recording has frames: then they are its frames in the order of the names, numbers by value.

    Raises:
        InputError: a frame is not in the video, its size is another, or the recording is not the one annotated.
    """
    matches = (_FRAME.fullmatch(name) for name in annotations.frames)
    if any(m is not None and m["recording"] in video.recordings for m in matches):
        found = [_of_name(name, video) for name in annotations.frames]
    else:
        found = _of_folder(annotations, video)
    for name, size, (recording, _) in zip(annotations.frames, annotations.sizes, found, strict=True):
        if size.all() and tuple(size) != video.size(recording):
            width, height = video.size(recording)
            raise InputError(
                f"frame {name!r} was annotated at {size[0]} x {size[1]} pixels, but {video.path} has {width} x "
                f"{height}; import the video at the size of the annotations"
            )
    for recording in {r for r, _ in found}:
        if annotations.video.get(recording, video.fingerprint(recording)) != video.fingerprint(recording):
            raise InputError(
                f"recording {recording!r} of {video.path} has other frames than the one that was annotated; "
                "give the video that the annotations are of"
            )
    return found


def annotated_frames(annotations: Annotations, video: VideoFrames) -> tuple[Frames, FloatArray]:
    """What an extractor learns from: the frames that are finished, and their keypoints.

    Returns:
        N frames, and keypoints ``(N, K, 2)`` [px], NaN for what is not seen (hidden, or not in the picture).

    Raises:
        InputError: as :func:`places`; or no frame is finished; or the frames have several sizes.
    """
    found = places(annotations, video)
    kept = np.flatnonzero(annotations.finished)
    if not (annotations.flags[kept] == SEEN).any():
        raise InputError(
            f"none of the {len(annotations)} frames has all its keypoints decided and one seen; go on with: muslin "
            "annotate"
        )
    recordings = list(dict.fromkeys(found[n][0] for n in kept))
    sizes = {video.size(r) for r in recordings}
    if len(sizes) > 1:
        told = ", ".join(f"{w} x {h}" for w, h in sorted(sizes))
        raise InputError(f"{video.path} has frames of several sizes ({told}), which cannot be learned from together")
    order = sorted(kept, key=lambda n: (recordings.index(found[n][0]), found[n][1]))
    parts = [video.some(r, [found[n][1] for n in order if found[n][0] == r]) for r in recordings]
    points = np.where((annotations.flags == SEEN)[..., None], annotations.points, np.nan)
    return Frames.joined(parts), points[order]


def _of_name(name: str, video: VideoFrames) -> tuple[str, int]:
    match = _FRAME.fullmatch(name)
    if match is None or match["recording"] not in video.recordings:
        raise InputError(
            f"frame {name!r} is of no recording of {video.path}, which has {', '.join(video.recordings)}; "
            "names of frames are RECORDING/NUMBER"
        )
    recording, number = match["recording"], int(match["number"])
    if number >= video.count(recording):
        count = video.count(recording)
        raise InputError(f"there is no frame {name!r}: {recording!r} of {video.path} has {count} frames, from 0")
    return recording, number


def _of_folder(annotations: Annotations, video: VideoFrames) -> list[tuple[str, int]]:
    recording = video.recordings[0]
    if len(video.recordings) > 1 or len(annotations) != video.count(recording):
        raise InputError(
            f"frames are named like {annotations.frames[0]!r}, which tells no place in {video.path}; name "
            f"them RECORDING/NUMBER as {frame_name(recording, 0)!r}, or have every picture of the folder that it was "
            "imported from in the file"
        )
    order = sorted(range(len(annotations)), key=lambda n: _natural(annotations.frames[n]))
    rank = {n: k for k, n in enumerate(order)}
    return [(recording, rank[n]) for n in range(len(annotations))]


def _natural(name: str) -> list[tuple[int, str]]:
    return [(int(part), "") if part.isdigit() else (0, part) for part in re.split(r"(\d+)", name)]
