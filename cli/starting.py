"""``muslin new``: a study file that a person can read and change."""

import os
import tomllib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, TypeVar

import typer

from ..core.errors import InputError
from ..core.importing.video import is_video
from ..core.measurement import Measurement
from ..core.measurement_store import load_measurement, read_found_by
from ..core.registry import REGISTRY
from ..core.scenarios import PRESETS, Preset, preset
from ..core.store import write_text
from ..core.study import Problem, build_problem, parse_config
from ..core.study.choice import chosen
from ..core.study.objects import grasps_of, keep_points, object_of
from .clamping import clamped
from .console import ProgressView, command, next_step, say
from .doubtful import doubtful_starts
from .holding import held_as_seen
from .output import check_output
from .pacing import paced
from .placing import check_alike, parse_markers, place_markers
from .rope_start import rope_sizes
from .shown import Shown, shown_by_markers
from .study_file import study_text
from .study_plan import Plan
from .table_height import seen_table

Number = TypeVar("Number", int, float)


def add_to(app: typer.Typer) -> None:
    """Add the commands of this file."""
    app.command("new")(new)


def new(
    study: Annotated[Path, typer.Argument(metavar="STUDY.toml", help="The study file to write.")],
    measurement: Annotated[
        Path, typer.Option(metavar="RECORDING.zarr", help="The measurement, made with muslin import.")
    ],
    scenario: Annotated[
        str, typer.Option(metavar="NAME", help=f"The object and how it is held: {', '.join(PRESETS)}. Needed.")
    ] = "",
    simulator: Annotated[str, typer.Option(metavar="NAME", help="The engine; muslin plugins lists them.")] = "mujoco",
    estimator: Annotated[
        str, typer.Option(metavar="NAME", help="The posterior estimator; muslin plugins lists them.")
    ] = "npe-rkhs",
    fit_on: Annotated[
        list[str] | None,
        typer.Option(
            metavar="A,B",
            help="Recordings that the fit sees; default all that are not held out, or of more than nine motions five.",
        ),
    ] = None,
    hold_out: Annotated[
        list[str] | None,
        typer.Option(
            metavar="C,D",
            help="Recordings kept back, on which every claim is checked; default one of every three motions, or four "
            "where the fit sees five of many.",
        ),
    ] = None,
    size: Annotated[
        str,
        typer.Option(
            metavar="W,H",
            help="Size of the object in m: width, height of a cloth; length of a rope; x, y, z of a solid.",
        ),
    ] = "",
    vertices: Annotated[
        str, typer.Option(metavar="N,M", help="Vertices of its mesh along the same axes: more are finer and slower.")
    ] = "",
    mesh: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="An object of your own: .obj, .ply or .stl; .vtk or .msh; .csv of a rope."),
    ] = None,
    mesh_scale: Annotated[float, typer.Option(metavar="S", help="Of its coordinates: 0.001 for millimetres.")] = 1.0,
    grasp_points: Annotated[
        str,
        typer.Option(
            metavar="X,Y,Z;X,Y,Z", help="Where each gripper holds the object, in its own frame; default what fits."
        ),
    ] = "",
    points: Annotated[str, typer.Option(metavar="I,J", help="Measured points to compare, from 0; default all.")] = "",
    markers: Annotated[
        str,
        typer.Option(
            metavar="all|bound|surface|nearest|I,J",
            help="Where the points sit on the mesh: on every vertex in order, tied rigidly to where they are in the "
            "first frame, anywhere on the surface (clouds), on the vertex nearest to the first frame, or on these "
            "vertices; default what fits.",
        ),
    ] = "",
    force: Annotated[bool, typer.Option("--force", help="Replace a study file that is there already.")] = False,
) -> None:
    """Write a study file: what is fitted, on what, with which priors. Read it and change what you know better."""
    base = _preset(scenario)
    for kind, name in (("simulator", simulator), ("estimator", estimator)):
        if name not in REGISTRY.names(kind):
            REGISTRY.get(kind, name)  # says what is installed, and which is nearest
    check_output(study, force)
    if (measurement.suffix in (".npz", ".csv", ".c3d") or is_video(measurement)) and measurement.is_file():
        raise InputError(
            f"{measurement} is not a measurement; first: muslin import {measurement} -o {measurement.stem}.zarr"
        )
    measured = load_measurement(measurement)
    compared = _numbers(points, int, "--points") or None
    fitted, held = _names(fit_on, measured, "--fit-on"), _names(hold_out, measured, "--hold-out")
    fitted, held, remarks = _takes(fitted, held, measured, compared)
    sizes = _numbers(size, float, "--size")
    if mesh and sizes:
        raise InputError("--size does not go with --mesh, which has a size of its own; use --mesh-scale")
    if not mesh and mesh_scale != 1.0:
        raise InputError("--mesh-scale goes with --mesh; for a built-in object give --size")
    placed = any(text.strip() for text in (vertices, grasp_points, points, markers))
    if not (sizes or mesh or placed) and base.kind == "cloth" and "rope" in base.kinds:
        sizes, more = rope_sizes([measured[name] for name in fitted])
        remarks += more
    table: dict[str, Any] = {"name": scenario}
    if mesh:
        table |= {"mesh": _from(study, mesh), "mesh_scale": mesh_scale}
    else:
        table |= {"size": sizes or list(base.size), "vertices": list(base.counts(sizes or base.size))}
    if vertices.strip():
        table["vertices"] = _numbers(vertices, int, "--vertices")
    if grasp_points.strip():
        table["grasp_points"] = _points(grasp_points)
    lies = seen_table(base, [keep_points(measured[name], compared) for name in fitted])
    if lies is not None:
        table["obstacles"] = [{"kind": "table", "height": lies.height, "friction": lies.friction}]
        remarks.append(f"it starts flat at {lies.height:g} m: the table is there ([scenario] obstacles)")
    whole = {"study": {"measurement": "", "fit_on": fitted}, "scenario": table, "simulator": {"name": simulator}}
    extractor = _found_by(measurement, study)
    shown = Shown() if placed or mesh or extractor else shown_by_markers(whole, measured, study, sizes)
    grid, sheet = shown.grid, shown.sheet
    table |= shown.table
    remarks += shown.remarks
    own = parse_config(whole, str(study)).scenario
    body = object_of(own, study.parent)
    plan = Plan(
        measurement=_from(study, measurement),
        fit_on=fitted,
        hold_out=held,
        scenario=scenario,
        simulator=simulator,
        estimator=estimator,
        kind=body.kind,
        held=[[int(v) for v in g] for g in grasps_of(own, body)],
        size=own.size or [],
        vertices=own.vertices or [],
        mesh=own.mesh,
        mesh_scale=mesh_scale,
        grasp_points=table.get("grasp_points"),
        points=compared,
        markers=parse_markers(markers) if grid is None else grid.markers,
        extractor=extractor,
        spacing="measured" if grid is not None and grid.uneven else None,
        obstacles=() if lies is None else (lies,),
    )
    if sheet is not None:
        plan = replace(plan, frame="markers", grasps=sheet.grasps, marker_points=sheet.markers)
        check_alike(plan, measured)
    elif grid is None and plan.extractor is None:
        plan, more = place_markers(plan, measured, study, body, sized=bool(sizes))
        remarks += more
        plan, more = clamped(plan, [keep_points(measured[name], compared) for name in fitted], body)
        remarks += more
    elif grid is None and markers.strip():
        raise InputError("--markers says where markers sit, but these points were found in pictures; leave it out")
    elif grid is None:
        plan = replace(plan, markers="all")
    else:
        check_alike(plan, measured)
    plan, more = paced(plan, [keep_points(measured[name], compared) for name in fitted])
    remarks += more

    def draft(plan: Plan) -> tuple[str, Problem]:
        text = study_text(plan)
        return text, build_problem(parse_config(tomllib.loads(text), str(study)), measured, study.parent)

    if plan.start is not None:  # takes many seconds
        ProgressView()("looking at how the rope lies in the recordings", 0, 0)
    text, problem = draft(plan)
    plan, more = held_as_seen(plan, problem)
    if more:
        text, problem = draft(plan)
    remarks += more
    remarks += doubtful_starts(problem)
    write_text(study, text)
    say(f"wrote {study}: fits {body.kind} {scenario!r} on {', '.join(fitted)}")
    if held:
        say(f"  held out: {', '.join(held)}")
    elif len(fitted) > 1:
        say(f"  nothing is held out, so no claim is checked on a motion that was not fitted: --hold-out {fitted[-1]}")
    for remark in remarks:
        say(f"  {remark}")
    next_step(command("fit", study), note="look through the study file first")


def _preset(name: str) -> Preset:
    if name:
        return preset(name)
    width = max(map(len, PRESETS))
    lines = "".join(f"\n  {known:{width}}  {its.about}" for known, its in PRESETS.items())
    raise InputError(
        "--scenario NAME is missing: what the object is and how it is held. How it moves is in the recording; sizes, "
        f"grasps and what stands around it can be changed in the study file.{lines}"
    )


def _takes(
    fitted: list[str], held: list[str], measured: Measurement, compared: list[int] | None
) -> tuple[list[str], list[str], list[str]]:
    """What is fitted and what is held out, as the person says or else as suits so many takes; remarks."""
    if fitted or held:
        fitted = fitted or [n for n in measured.names if n not in held]
        if not fitted:
            raise InputError("--hold-out names every recording, so nothing is left to fit on; leave one out")
        return fitted, held, []
    fitted, held = chosen([keep_points(r, compared) for r in measured.recordings])
    if not held:
        return fitted, held, []
    total = len(measured.names)
    rest = total - len(fitted) - len(held)
    others = f"; the other {rest} stay in the measurement, untouched" if rest else ""
    told = f"chosen of {total} takes, so that what is held out starts neither fastest nor slowest{others}"
    return fitted, held, [f"{told}; --fit-on and --hold-out choose otherwise"]


def _from(study: Path, file: Path) -> str:
    """A path as it is written in the study file, relative to it."""
    return Path(os.path.relpath(file.absolute(), study.absolute().parent)).as_posix()


def _found_by(measurement: Path, study: Path) -> dict[str, Any] | None:
    """The extractor of the points, with the path of what it has learned as it is written in the study file."""
    found = read_found_by(measurement)
    if found and "weights" in found:
        found["weights"] = _from(study, Path(found["weights"]))
    return found


def _points(text: str) -> list[list[float]]:
    """``--grasp-points``: x, y, z with commas, semicolons between grippers."""
    points = [_numbers(part, float, "--grasp-points") for part in text.split(";")]
    if any(len(p) != 3 for p in points):
        raise InputError(f"--grasp-points must be x,y,z for every gripper, with ; between them, but is {text!r}")
    return points


def _names(given: list[str] | None, measured: Measurement, option: str) -> list[str]:
    """Names with commas between them, of an option that may be given more than once."""
    names = [n.strip() for text in given or () for n in text.split(",") if n.strip()]
    for name in names:
        try:
            measured[name]
        except InputError as error:
            raise InputError(f"{option}: {error}") from error
        if names.count(name) > 1:
            raise InputError(f"{option} names {name!r} twice")
    return names


def _numbers(text: str, kind: Callable[[str], Number], option: str) -> list[Number]:
    try:
        return [kind(part) for part in text.split(",")] if text.strip() else []
    except ValueError as error:
        raise InputError(f"{option} must be numbers with commas between them, but is {text!r}") from error
