"""Which frames are annotated, and what is known of them from files that are there."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from ...core.annotated_frames import frame_name, places
from ...core.annotations import UNDECIDED, Annotations, blank
from ...core.errors import InputError
from ...core.keypoints_coco import read_coco
from ...core.video_frames import VideoFrames

#: Frames to annotate where nothing is said; as many as real frames in the paper.
COUNT = 125


def resumed(path: Path, video: VideoFrames, names: tuple[str, ...]) -> Annotations:
    """The annotations of a file that muslin wrote for this video; ``names`` are those asked for, or none."""
    found = read_coco(path)
    if not found.video:
        raise InputError(f"{path} is of another program; take it in with --import {path} and another name after -o")
    places(found, video)  # raises unless all are frames of this video
    if names and names != found.names:
        raise InputError(
            f"{path} has the keypoints {','.join(found.names)}, not {','.join(names)}; leave --names out to go on with "
            "it, or write another file"
        )
    return found


def spread(video: VideoFrames, every: int | None, count: int | None) -> list[tuple[str, int]]:
    """Every so many frames of each take, or so many in the middle of equal stretches of all takes."""
    if every is not None:
        return [(r, k) for r in video.recordings for k in range(0, video.count(r), every)]
    everything = [(r, k) for r in video.recordings for k in range(video.count(r))]
    number = min(count or COUNT, len(everything))
    middles = ((np.arange(number) + 0.5) * len(everything) / number).astype(int)
    return [everything[k] for k in middles]


def joined(
    video: VideoFrames,
    names: tuple[str, ...],
    chosen: list[tuple[str, int]],
    begun: Annotations | None,
    taken: Annotations | None,
) -> tuple[Annotations, int]:
    """The annotations to go on with, and how many of their frames are from ``taken``.

    Args:
        video: that they are of.
        names: of the keypoints; none: those of ``begun``, else of ``taken``.
        chosen: recordings and numbers of frames to annotate; none: those of ``begun`` and ``taken``. Frames of which
            something is decided are always among them.
        begun: what is in the file.
        taken: from another program; counts where the file has nothing.
    """
    known = [a for a in (begun, taken) if a is not None]
    names = names or (known[0].names if known else ())
    if not names:
        raise InputError("which keypoints are to be annotated? Name them, as --names corner_a,corner_b,corner_c")
    at = [(a, dict(zip(places(a, video), range(len(a)), strict=True)), _order(a.names, names)) for a in known]
    wanted = set(chosen)
    for a, numbers, _ in at:
        wanted |= {place for place, n in numbers.items() if not chosen or (a.flags[n] != UNDECIDED).any()}
    rank = {r: k for k, r in enumerate(video.recordings)}
    found = sorted(wanted, key=lambda place: (rank[place[0]], place[1]))
    sizes = np.array([video.size(r) for r, _ in found], np.int64)
    prints = {r: video.fingerprint(r) for r in dict.fromkeys(r for r, _ in found)}
    made = blank(names, tuple(frame_name(*place) for place in found), sizes, prints)
    points, flags, filled = made.points.copy(), made.flags.copy(), 0
    for n, place in enumerate(found):
        for a, numbers, order in at:
            k = numbers.get(place)
            if k is not None and (a.flags[k] != UNDECIDED).any():
                points[n], flags[n] = a.points[k, order], a.flags[k, order]
                filled += a is taken
                break
    skeleton = known[0].skeleton if known and known[0].names == names else ()
    return replace(made, points=points, flags=flags, skeleton=skeleton), filled


def _order(having: tuple[str, ...], wanted: tuple[str, ...]) -> list[int]:
    if set(having) != set(wanted):
        raise InputError(
            f"the imported keypoints are {','.join(having)}, but {','.join(wanted)} are to be annotated; rename them "
            "in the file, or leave --names out"
        )
    return [having.index(name) for name in wanted]
