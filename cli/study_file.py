"""The text of a new study file, with comments that teach what to change."""

import inspect
import json
import tomllib
from dataclasses import fields
from typing import Any

import numpy as np

from ..core.material import UNITS
from ..core.obstacles import Obstacle
from ..core.registry import REGISTRY
from ..core.scenarios import SIZES, preset
from ..core.scenarios.measured import MEASURED_PIECE, MEASURED_TAILS
from ..core.study.config import DiagnoseTable, EstimatorTable
from .study_plan import Plan


def plan_table(plan: Plan) -> dict[str, Any]:
    """The plan as the table that its file will hold."""
    return tomllib.loads(study_text(plan))


def study_text(plan: Plan) -> str:
    """The whole file."""
    parts = [
        "# A study: fit a simulator to a measurement, see where it fails, name what is missing.",
        "# All units are SI (m, kg, s, N, Pa, rad); z is up. Lines that start with # are off.",
        _study(plan),
        _scenario(plan),
        _plugins(plan),
        _material(plan),
        _parameters(plan),
        _effects(plan.kind),
        _rest(plan),
    ]
    return "\n".join(parts)


def _study(plan: Plan) -> str:
    pieces = ""
    if plan.window:
        pieces = f"window = {plan.window:g}  # in pieces of so many seconds: after more, what whips is left to chance\n"
    elif plan.start:
        pieces = (
            f"# window = {MEASURED_PIECE:g}  # in pieces of so many seconds that start as measured, if a fit finds the "
            "whole chaotic\n"
        )
    return f"""
[study]
measurement = {_value(plan.measurement)}  # relative to this file
fit_on = {_value(plan.fit_on)}  # recordings that the fit sees
hold_out = {_value(plan.hold_out)}  # recordings kept back, to check every claim on
{pieces}seed = 0  # same seed, same machine: same result
# time_limit = 120.0  # a simulation that takes longer has failed [s]
"""


_ORDER = {
    "cloth": "row by row from the top edge, x rising",
    "rope": "from the end that the first gripper holds",
    "solid": "along x, y, z, z fastest",
}


def _scenario(plan: Plan) -> str:
    base = preset(plan.scenario)
    points = f"points = {_value(plan.points)}" if plan.points is not None else "# points = [0, 1, 2]"
    around, own = plan.obstacles or base.obstacles, bool(plan.obstacles)
    told = f"{'' if own else '# '}obstacles = {_inline([_obstacle(o) for o in around])}{'' if own else '  # built in'}"
    return "\n".join(
        [
            "",
            "[scenario]",
            f"name = {_value(plan.scenario)}",
            *_object(plan),
            *([] if plan.start else _placed(plan)),
            f"{points}  # measured points to compare, from 0; default all",
            *_grasps(plan),
            *([] if plan.start else [f"settle = {base.settle:g}  # time to come to rest before the first frame [s]"]),
            "# What stands around the object, in the world [m]; friction times the material's own is the Coulomb "
            "coefficient.",
            *([told] if around else []),
            '# obstacles = [{ kind = "table", height = 0.0, friction = 1.0 }]',
            '# obstacles = [{ kind = "cylinder", center = [0, 0, 2], axis = [0, 1, 0], radius = 0.04, length = 0.3 }]',
            '# obstacles = [{ kind = "mesh", file = "stand.stl", scale = 0.001, up = "z", position = [0, 0, 0] }]',
            "",
        ]
    )


def _placed(plan: Plan) -> list[str]:
    return [
        '# The frame of the object: "gripper" (of the first gripper at its first pose), "upright" (from that',
        '# gripper along the axes of the world), "world" (as it stands at the start) or "markers" (an own one, laid',
        "# under the markers of the first frame of each take).",
        f"{'' if plan.frame else '# '}frame = {_value(plan.frame or 'gripper')}",
        '# Where the measured points sit: "all" (point k on vertex k), "bound" (tied where they are in the',
        '# first frame), "surface" (anywhere: clouds), or a vertex number for each.',
        f"{'# ' if plan.marker_points else ''}markers = {_value(plan.markers or 'all')}",
        *(_marker_points(plan) if plan.kind == "cloth" else []),
        *(_spacing(plan) if plan.kind == "cloth" else []),
    ]


def _marker_points(plan: Plan) -> list[str]:
    head = "# or, in its place, where each is on a flat cloth, in the frame of the object [m]:"
    if plan.marker_points is None:
        return [head, "# marker_points = [[0.0, 0.0, 0.0]]"]
    return [head, "marker_points = [", *(f"    {_value(p)}," for p in plan.marker_points), "]"]


def _spacing(plan: Plan) -> list[str]:
    return [
        "# Markers of a flat cloth that are not quite where markers says: as far apart as they are seen.",
        f'{"" if plan.spacing else "# "}spacing = "measured"',
    ]


def _object(plan: Plan) -> list[str]:
    if plan.start:
        return [
            f"vertices = {_value(plan.vertices)}  # mesh vertices along it; numbered {_ORDER[plan.kind]}",
            "# Every take starts through the markers of its first frame, as fast as they were, and is as long as the",
            "# curve through them. Instead: size, markers and settle, for a rope that hangs at rest at the start.",
            f"start = {_value(plan.start)}",
            "# Where the markers stand: on the axis of the rope, or beside it, told by how their distances change.",
            f'{"" if plan.markers else "# "}markers = "beside"',
        ]
    if plan.mesh is None:
        return [
            f"size = {_value(plan.size)}  # {', '.join(SIZES[plan.kind])} [m]",
            f"vertices = {_value(plan.vertices)}  # mesh vertices along the same axes; numbered {_ORDER[plan.kind]}",
            "# An object of your own in place of size: .obj, .ply, .stl (cloth), .vtk, .msh (solid), .csv (rope).",
            '# mesh = "shirt.obj"  # relative to this file',
            "# mesh_scale = 0.001  # 0.001 if it is in millimetres",
        ]
    lines = [
        f"mesh = {_value(plan.mesh)}  # relative to this file",
        f"mesh_scale = {_value(plan.mesh_scale)}  # 0.001 if it is in millimetres",
        '# mesh_up = "y"  # the axis of the file that points up; default z',
    ]
    if plan.kind == "rope":
        count = _value(plan.vertices) if plan.vertices else "[41]"
        lines += [
            f"{'' if plan.vertices else '# '}vertices = {count}  # of the rope; default the points of the file",
            "# straight_rest = true  # the file is the shape at the start, the rope is straight where nothing acts",
        ]
    return lines


def _grasps(plan: Plan) -> list[str]:
    off = "# " if plan.grasps is None else ""
    vertices = f"{off}grasps = {_value(plan.grasps or plan.held)}  # for every gripper the vertices that it holds"
    if plan.start:
        return [vertices]
    points = plan.grasp_points
    shown = _value(points) if points is not None else "[[0.0, 0.0, 0.0]]"
    return [
        vertices,
        "# or a point (or a list of points) for every gripper in the frame of the object [m], which holds the vertex",
        "# nearest to it and all within grasp_radius:",
        f"{'# ' if points is None else ''}grasp_points = {shown}",
        "# grasp_radius = 0.01",
    ]


def _obstacle(obstacle: Obstacle) -> dict[str, Any]:
    """A built-in obstacle as it is written in a study."""
    shape: dict[str, Any] = {"kind": type(obstacle).__name__.lower()}
    for field in fields(obstacle):
        value = getattr(obstacle, field.name)
        shape[field.name] = value.tolist() if isinstance(value, np.ndarray) else value
    return shape


def _inline(tables: list[dict[str, Any]]) -> str:
    return f"[{', '.join('{ ' + ', '.join(f'{k} = {_value(v)}' for k, v in t.items()) + ' }' for t in tables)}]"


def _plugins(plan: Plan) -> str:
    own = {}
    if usual := plan.time_step or REGISTRY.get("simulator", plan.simulator).usual_steps.get(plan.kind):
        own = {"time_step": usual}
    options = "".join(f"{line}\n" for line in _options("simulator", plan.simulator, own))
    default = EstimatorTable(name=plan.estimator)
    return f"""
[simulator]
name = {_value(plan.simulator)}  # installed: {", ".join(REGISTRY.names("simulator"))}
{options}
{_extractor(plan)}

[estimator]
name = {_value(plan.estimator)}  # installed: {", ".join(REGISTRY.names("estimator"))}
rounds = {default.rounds}  # at most; the second and later ones draw where the posterior is
draws = {default.draws}  # simulations a round and recording
stop = {default.stop}  # rounds end once the posterior moves by less, in its own standard deviations; 0: never
proposal = {_value(default.proposals)}  # or "posterior"; "gaussian" is BayesSim's own
"""


def _extractor(plan: Plan) -> str:
    if plan.extractor is None:
        return '[extractor]\nname = "markers"\n'
    told = [f"{key} = {_value(value)}" for key, value in plan.extractor.items() if key != "name"]
    name = (
        f"name = {_value(plan.extractor['name'])}  # found the points, and looks at drawn pictures of what is simulated"
    )
    return "\n".join(["[extractor]", name, *told, ""])


def _options(kind: str, name: str, own: dict[str, Any]) -> list[str]:
    """``# key = default`` for the options of a plugin that TOML can hold, ``key = value`` for those of ``own``."""
    signature = inspect.signature(REGISTRY.get(kind, name))
    defaults = {p.name: p.default for p in signature.parameters.values()}
    known = {key: value for key, value in defaults.items() if isinstance(value, bool | int | float | str)}
    return [f"{key} = {_value(own[key])}" if key in own else f"# {key} = {_value(v)}" for key, v in known.items()]


def _material(plan: Plan) -> str:
    inferred = {p.name for p in plan.priors}
    material = preset(plan.scenario).default_material(plan.kind)
    lines = ["", "# What is known of the material; put in what you have weighed or looked up.", "[material]"]
    for field in fields(material):
        if field.name in inferred:
            lines.append(f"# {field.name} is inferred, see below")
        else:
            lines.append(f"{field.name} = {_value(getattr(material, field.name))}  # [{UNITS[plan.kind][field.name]}]")
    return "\n".join([*lines, ""])


def _parameters(plan: Plan) -> str:
    lines = ["", "# What is inferred, with the bounds of its prior. Add any field of [material], or scale (the size)."]
    for p in plan.priors:
        lines += [
            f"[parameters.{p.name}]  # {p.description}",
            f"low = {_value(p.low)}",
            f"high = {_value(p.high)}",
            f"scale = {_value(p.scale)}  # log: uniform in the logarithm",
            f"unit = {_value(p.unit)}",
            "",
        ]
    if not plan.start:
        lines += [
            "# [parameters.scale]  # size of the object relative to the one given",
            "# low = 0.97",
            "# high = 1.03",
        ]
    return "\n".join([*lines, ""])


def _effects(kind: str) -> str:
    air = "cylinder-drag" if kind == "rope" else "air-drag"
    return f"""
# Physics on top of the plain model; muslin plugins lists the effects, muslin add writes these tables.
# An empty table infers every coefficient in its own range; a number fixes one.
# [effects.{air}]
# drag_coefficient = 1.2
"""


def _rest(plan: Plan) -> str:
    default = DiagnoseTable()
    return f"""
[noise]
{_noise(plan)}

[nuisance]  # prior standard deviation of what may be off in the measurement itself
clock_offset = 0.0  # points against gripper poses [s]
constant_offset = 0.0  # of the frame of the points [m]

[diagnose]
# Which effects to try; left out, every one that fits the object.
# candidates = {_value(REGISTRY.names("effect"))}
draws = {default.draws}  # starting points that are tried for each effect
# simulations = 2000  # in all, or a few more, as what has begun is ended; left out, what suits object and recordings
"""


def _noise(plan: Plan) -> str:
    if plan.near is None:
        return (
            "# sd = 0.003  # of a coordinate [m]; left out, it is estimated; larger, it is how near the model is meant "
            "to come\n"
            "# tails = 3.0  # where parts of a motion are left to chance: frames that are off by more than so many sd "
            "count by a logarithm only"
        )
    return f"""# The measurement is far better than any model of a rope in motion. So this is not its noise (which is
# estimated where it is left out), but how near the model is meant to come; what is beyond counts as a misfit.
sd = {_value(plan.near)}  # of a coordinate [m]
tails = {_value(MEASURED_TAILS)}  # what whips is left to chance: frames off by more sd count by a logarithm"""


def _value(value: Any) -> str:
    """A TOML value. JSON strings are TOML strings, but for one control character."""
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
