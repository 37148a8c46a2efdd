"""The gripper's pose in a LeRobot data set: some entries of some vector, which sets name as they like."""

import re
from collections.abc import Mapping
from typing import Any

import numpy as np

from ...errors import InputError
from ..raw import RawGripper
from .lerobot_files import LeRobotFiles
from .options import VideoOptions

_POSITION, _TURN = ("x", "y", "z"), ("qw", "qx", "qy", "qz")
#: Looked at first where nobody says which.
_USUAL = ("observation.state", "action")


def gripper_of(
    files: LeRobotFiles, table: Mapping[str, list[Any]], options: VideoOptions
) -> tuple[RawGripper | None, tuple[str, ...]]:
    """Poses ``(T, G, 3 or 7)`` of an episode's table, and what was taken for them.

    Raises:
        InputError: nothing tells which entries they are; the message lists those that there are.
    """
    if options.pose == ("none",):
        return None, ()
    if len(options.pose) > 1:
        raise InputError(
            f"{files.path}: of a LeRobot data set --pose names one feature; give --pose-columns once a gripper"
        )
    wanted = options.pose[0] if options.pose else None
    known = {key: _entries(f) for key, f in files.features.items() if key in table and _is_vector(f)}
    if wanted is not None and wanted not in known:
        raise InputError(f"{files.path} has no feature {wanted!r} of numbers; it has {_listed(known)}")
    if options.pose_columns:
        feature = wanted or next((k for k in _USUAL if k in known), "")
        if not feature:
            raise InputError(f"{files.path}: say with --pose in which feature the pose is: {_listed(known)}")
        chosen = [_chosen(text, feature, known[feature], files) for text in options.pose_columns]
    else:
        order = [wanted] if wanted else [*(k for k in _USUAL if k in known), *known]
        guessed = next(((k, c) for k in order if (c := _guessed(known[k]))), None)
        if guessed is None:
            raise InputError(
                f"{files.path}: nothing is named x, y and z, so say where the gripper's pose is with --pose FEATURE "
                "--pose-columns X,Y,Z[,QW,QX,QY,QZ] (names, or numbers from 0), or --pose none for no poses; there is "
                f"{_listed({wanted: known[wanted]} if wanted else known)}"
            )
        feature, chosen = guessed[0], [guessed[1]]
    values = np.asarray(table[feature], float).reshape(len(table["timestamp"]), -1)
    poses = np.stack([values[:, columns] for columns in chosen], axis=1)
    taken = "; ".join(", ".join(known[feature][c] for c in columns) for columns in chosen)
    return RawGripper(np.asarray(table["timestamp"], float), poses), (f"gripper pose: {feature} ({taken})",)


def _chosen(text: str, feature: str, entries: list[str], files: LeRobotFiles) -> list[int]:
    """The columns of ``x,y,z`` or ``x,y,z,qw,qx,qy,qz``, by name or number."""
    parts = [p.strip() for p in text.split(",")]
    if len(parts) not in (3, 7):
        raise InputError(f"--pose-columns must be 3 (x,y,z) or 7 (x,y,z,qw,qx,qy,qz), but {text!r} has {len(parts)}")
    found = []
    for part in parts:
        number = entries.index(part) if part in entries else int(part) if part.isdecimal() else -1
        if not 0 <= number < len(entries):
            raise InputError(f"{files.path}: {feature} has no entry {part!r}; it has {_listed({feature: entries})}")
        found.append(number)
    return found


def _guessed(entries: list[str]) -> list[int]:
    """The columns named x, y, z, with those of a quaternion if they are there; none if that is not clear."""

    def place(axis: str) -> int | None:
        ends = [k for k, name in enumerate(entries) if re.search(rf"(^|[._\- ]){axis}$", name.lower())]
        return ends[0] if len(ends) == 1 else None

    position, turn = [place(a) for a in _POSITION], [place(a) for a in _TURN]
    if any(p is None for p in position):
        return []
    return [p for p in (*position, *(() if any(t is None for t in turn) else turn)) if p is not None]


def _is_vector(feature: Mapping[str, Any]) -> bool:
    shape = feature.get("shape") or []
    return str(feature.get("dtype", "")).startswith("float") and len(shape) == 1 and int(shape[0]) >= 3


def _entries(feature: Mapping[str, Any]) -> list[str]:
    """Names of a vector's entries; their numbers where it has none."""
    names = feature.get("names")
    if isinstance(names, Mapping):
        names = [n for group in names.values() for n in (group if isinstance(group, list) else [group])]
    count = int(feature["shape"][0])
    return (
        [str(n) for n in names] if isinstance(names, list) and len(names) == count else [str(k) for k in range(count)]
    )


def _listed(known: Mapping[str, list[str]]) -> str:
    return "; ".join(f"{key} ({', '.join(entries)})" for key, entries in known.items()) or "none"
