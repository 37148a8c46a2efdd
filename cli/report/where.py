"""Rows of the table that says which recordings, phases and parts carry the error above the noise."""

from .findings import Findings, Table, number
from .words import length, share

_TITLES = {
    "recording": "recording",
    "phase": "what the object does",
    "contact": "contact",
    "distance": "distance from the grasp",
    "place": "place on the object",
}


def group_rows(found: Findings) -> list[Table]:
    """One group a row; the first of each partition has its ``title``."""
    groups = list((found.compare or {}).get("groups") or [])
    unit = found.takes[0].unit if found.takes else "m"
    rows, last = [], ""
    for g in groups:
        own = number(g.get("share"))
        rows.append(
            {
                "title": _TITLES.get(g["partition"], g["partition"]) if g["partition"] != last else "",
                "name": g["name"],
                "note": g["note"],
                "portion": share(g["portion"]),
                "rmse": length(g["rmse"], unit),
                "expected": length(g["expected"], unit),
                "scatter": length(g["scatter"] if g["scatter"] > 1e-3 * g["expected"] else 0.0, unit),
                "share": share(max(own, 0.0)) if own is not None else "–",
                "width": round(100 * min(max(own or 0.0, 0.0), 1.0), 1),
                "width_portion": round(100 * g["portion"], 1),
            }
        )
        last = g["partition"]
    return rows
