"""What was found after the diagnosis: the missing force and its law, and the motion to record next."""

from collections.abc import Sequence
from typing import Any, cast

import numpy as np
import zarr

from ...core.store import read
from .figures_force import force_figure
from .figures_motion import motion_figure
from .findings import Findings, Table, number


def further_sections(found: Findings) -> Table:
    """What the template needs of the steps ``unknown`` and ``next``; None of those that were not run."""
    unknown, proposed = found.unknown, found.proposed
    told = found.fit.attrs.get("noise") or {}
    noise = number(told.get("sd")) if told.get("unit", "m") == "m" else None
    return {
        "unknown": None if unknown is None else {"paragraphs": _text(unknown), "forces": _forces(unknown)},
        "next": None if proposed is None else {"paragraphs": _text(proposed), "motion": motion_figure(proposed, noise)},
    }


def _text(group: zarr.Group) -> list[str]:
    text = cast(Sequence[Any], group.attrs.get("text", []))
    return [text] if isinstance(text, str) else [str(line).strip() for line in text]


def _forces(group: zarr.Group) -> list[tuple[str, float, str]]:
    """Recording, its worst moment [s], and the arrows there."""
    out = []
    for name, child in sorted(group.members()):
        if not isinstance(child, zarr.Group):
            continue
        k = int(cast(int, child.attrs["worst_frame"]))
        force, sd, vertices, triangles = (
            np.asarray(read(child, n)) for n in ("force", "force_sd", "vertices", "triangles")
        )
        time = float(np.asarray(read(child, "time"))[k])
        out.append((name, time, force_figure(vertices[k], triangles.astype(np.int64), force[k], sd[k])))
    return out
