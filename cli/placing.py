"""Where the measured points sit on the mesh, as far as the first frame tells."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from ..core.body import Body
from ..core.differences import rough_sd
from ..core.errors import InputError
from ..core.measurement import Measurement, Recording
from ..core.scenarios.measured import MEASURED_NEAR, MEASURED_PIECE
from ..core.scenarios.standoffs import standing_off
from ..core.study import build_problem, parse_config
from ..core.study.objects import keep_points
from ..core.study.windows import cut_all
from .rope_start import may_start_measured, sags_aside, why_not_measured
from .study_file import plan_table
from .study_plan import Plan

_CHOICES = ("all", "bound", "surface", "nearest")
#: A point further than this share of the object's size from the mesh is probably in another frame.
_FAR = 0.25
#: Noise below this share of how near a model is meant to come says nothing of the model.
_FAR_BETTER = 0.1


def parse_markers(text: str) -> str | list[int] | None:
    """``--markers``: a choice, vertex numbers, or None for what fits."""
    if not text:
        return None
    if text in _CHOICES:
        return text
    try:
        return [int(part) for part in text.split(",")]
    except ValueError as error:
        raise InputError(
            f"--markers must be {', '.join(_CHOICES)} or vertex numbers with commas between them, but is {text!r}"
        ) from error


def place_markers(plan: Plan, measured: Measurement, study: Path, body: Body, sized: bool) -> tuple[Plan, list[str]]:
    """The plan with markers that the mesh and the recordings allow, and remarks for the person.

    Points that are as many as vertices sit on the vertices; else a solid carries each where it is in
    the first frame, and on cloth and ropes each sits on the nearest vertex. A rope whose markers reach from one
    gripper to the other starts through them, or through where they stand beside it.

    Args:
        plan: of the study.
        measured: the measurement.
        study: the study file.
        body: the object.
        sized: the person gave its size.
    """
    if plan.markers is not None and plan.markers != "nearest":
        return plan, []
    if plan.markers is not None or sized or not may_start_measured(plan):
        return _on_vertices(plan, measured, study, body)
    used = [measured[n] for n in (*plan.fit_on, *plan.hold_out)]
    whys = {r.name: why for r in used if (why := why_not_measured(r, plan.points)) is not None}
    if not whys:
        return _measured(plan, measured)
    plan, remarks = _on_vertices(plan, measured, study, body)
    told = [f"{name}: {why}" for name, why in whys.items() if why]
    if told:
        others = f" ({len(told) - 1} more as well)" if len(told) > 1 else ""
        remarks.append(
            f"warning: the rope hangs at the start, as long as [scenario] size says, as takes do not all show it from "
            f"one gripper to the other; {told[0]}{others}"
        )
    return plan, remarks


def _on_vertices(plan: Plan, measured: Measurement, study: Path, body: Body) -> tuple[Plan, list[str]]:
    """The plan with markers on vertices, tied to the object, or anywhere on its surface."""
    used = [measured[n] for n in (*plan.fit_on, *plan.hold_out)]
    count = len(plan.points) if plan.points is not None else used[0].series.points.shape[1]
    followed = all(r.series.correspondence for r in used) and used[0].series.unit == "m"
    if plan.markers is None and used[0].series.unit == "m" and not followed and count > len(body.vertices):
        return replace(plan, markers="surface"), [f"the {count} points are a cloud, held against the whole surface"]
    if plan.markers is None and not followed:
        return replace(plan, markers="all"), []
    if plan.markers is None and body.kind == "solid" and count != len(body.vertices):
        return replace(plan, markers="bound"), [
            f"the {count} points are tied to the object where they are in the first frame"
        ]
    check_alike(plan, measured)
    if plan.markers is None and count == len(body.vertices):
        return replace(plan, markers="all"), []
    return _on_nearest(plan, measured, study, count)


def check_alike(plan: Plan, measured: Measurement) -> None:
    """Refuse recordings that differ in how many points they have, where point by point is to have its vertex."""
    having: dict[int, list[str]] = {}
    for name in (*plan.fit_on, *plan.hold_out):
        having.setdefault(measured[name].series.points.shape[1], []).append(name)
    if plan.points is not None or len(having) == 1:
        return
    told = "; ".join(f"{', '.join(names)}: {count}" for count, names in having.items())
    alike = max(having.values(), key=len)
    raise InputError(
        f"the recordings differ in how many points they have ({told}), and a point must be the same in all; take those "
        f"that are alike (--fit-on {','.join(alike)}), or the points that all have (--points I,J, numbered from 0)"
    )


def _measured(plan: Plan, measured: Measurement) -> tuple[Plan, list[str]]:
    """Through the markers of the first frame, which stand beside the rope if their distances say so."""
    plan = replace(plan, start="measured")
    remarks = ["every take starts through its markers, from one gripper to the other; its length follows from them"]
    fitted = [keep_points(measured[name], plan.points) for name in plan.fit_on]
    remarks += sags_aside(fitted)
    noise = rough_sd(r.series.points for r in fitted)
    if 0.0 < noise < _FAR_BETTER * MEASURED_NEAR:
        plan = replace(plan, near=MEASURED_NEAR)
        remarks.append(
            f"the noise is {1e3 * noise:.2g} mm, which no model of a rope in motion comes near; the model is meant to "
            f"come within {1e3 * MEASURED_NEAR:g} mm ([noise] sd)"
        )
        plan = replace(plan, window=_window(fitted))
        if plan.window:
            remarks.append(f"each take is fitted in pieces of {plan.window:g} s, and held-out ones stay whole")
    away = standing_off(fitted)
    if away:
        plan = replace(plan, markers="beside")
        remarks.append(
            f"the markers stand {1e3 * away:.2g} mm beside the axis of the rope, by how their distances change as it "
            "bends"
        )
    return plan, remarks


def _window(fitted: list[Recording]) -> float | None:
    """Length of pieces to fit [s]; None where a take is not twice as long, or a piece would have too few frames."""
    if min(float(np.ptp(r.series.time)) for r in fitted) < 2 * MEASURED_PIECE:
        return None
    try:
        cut_all(fitted, MEASURED_PIECE)
    except InputError:
        return None
    return MEASURED_PIECE


def _on_nearest(plan: Plan, measured: Measurement, study: Path, count: int) -> tuple[Plan, list[str]]:
    """Every point on the vertex that is nearest in the first frames, over all recordings."""
    draft = parse_config(plan_table(replace(plan, markers=[0] * count)), str(study))
    problem = build_problem(draft, measured, study.parent)
    total, seen, size = 0.0, 0, 0.0
    for name, recording in problem.recordings.items():
        first = recording.series.points[0]
        if first.shape[1] != 3:
            raise InputError(f"recording {name!r} has points of 2 coordinates; give --markers with vertex numbers")
        vertices = problem.scenarios[name].start_vertices()
        size = max(size, float(np.ptp(vertices, axis=0).max()))
        apart = np.linalg.norm(first[:, None] - vertices[None], axis=2)
        total, seen = total + np.nan_to_num(apart), seen + np.isfinite(apart)
    if not np.all(seen):
        lost = int(np.argmin(np.all(np.asarray(seen) > 0, axis=1)))
        if not any(r.series.valid[:, lost].any() for r in problem.recordings.values()):
            raise InputError(
                f"point {lost} is in no frame of any recording seen with all its coordinates, so it cannot be placed "
                "on the mesh; leave it out with --points, or give --markers with vertex numbers"
            )
        raise InputError(
            f"point {lost} is not seen in the first frame of any recording, so it cannot be placed on the mesh; "
            "import from a later --start, leave it out with --points, or give --markers with vertex numbers"
        )
    distance = np.asarray(total / seen)
    ids = np.argmin(distance, axis=1)
    if count > 1 and len(set(ids.tolist())) == 1:
        spread = max(float(np.nanmax(np.ptp(r.series.points[0], axis=0))) for r in problem.recordings.values())
        raise InputError(
            f"all {count} points are nearest to one vertex of the object, which is {size:.3g} m large, while they are "
            f"within {spread:.3g} m; give the size of the object in metres with --size, or import again with --unit"
        )
    worst = distance[np.arange(count), ids]
    points = "the point is" if count == 1 else f"the {count} points are"
    remarks = [f"{points} placed on the nearest vertices, at most {worst.max():.3g} m away in the first frame"]
    if worst.max() > _FAR * size:
        remarks.append(
            f"warning: point {int(worst.argmax())} is {worst.max():.3g} m from the object at the start; check the "
            "scenario, the size, --up and the unit, or give --markers"
        )
    if len(set(ids.tolist())) < count:
        remarks.append("warning: several points share a vertex; a finer mesh (--vertices) keeps them apart")
    return replace(plan, markers=[int(i) for i in ids]), remarks
