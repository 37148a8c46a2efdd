"""The text of a new study file, with comments that teach what to change."""

import inspect
import json
import tomllib
from dataclasses import dataclass, fields
from typing import Any

from ..core.material import DEFAULT_PRIORS, MATERIALS, UNITS
from ..core.registry import REGISTRY
from ..core.scenarios import preset
from ..core.study.config import DiagnoseTable, EstimatorTable


@dataclass(frozen=True)
class Plan:
    """What goes into a new study file.

    Args:
        measurement: path of the store, relative to the study file.
        fit_on, hold_out: names of recordings.
        scenario, simulator, estimator: names.
        size: of the object [m].
        vertices: counts along the same axes.
        points: measured points to compare, None for all.
        markers: where they sit: ``"all"``, ``"bound"``, vertex numbers; None while undecided.
    """

    measurement: str
    fit_on: list[str]
    hold_out: list[str]
    scenario: str
    simulator: str
    estimator: str
    size: list[float]
    vertices: list[int]
    points: list[int] | None
    markers: str | list[int] | None


def plan_table(plan: Plan) -> dict[str, Any]:
    """The plan as the table that its file will hold."""
    return tomllib.loads(study_text(plan))


def study_text(plan: Plan) -> str:
    """The whole file."""
    kind = preset(plan.scenario).kind
    parts = [
        "# A study: fit a simulator to a measurement, see where it fails, name what is missing.",
        "# All units are SI (m, kg, s, N, Pa, rad); z is up. Lines that start with # are off.",
        _study(plan),
        _scenario(plan),
        _plugins(plan),
        _material(kind),
        _parameters(kind),
        _effects(),
        _rest(),
    ]
    return "\n".join(parts)


def _study(plan: Plan) -> str:
    return f"""
[study]
measurement = {_value(plan.measurement)}  # relative to this file
fit_on = {_value(plan.fit_on)}  # recordings that the fit sees
hold_out = {_value(plan.hold_out)}  # recordings kept back, to check every claim on
seed = 0  # same seed, same machine: same result
"""


def _scenario(plan: Plan) -> str:
    base = preset(plan.scenario)
    body = base.body(plan.size, plan.vertices)
    cloth = base.kind == "cloth"
    axes = "width, height" if cloth else "x, y, z"
    order = "row by row from the top edge, x rising" if cloth else "along x, y, z, z fastest"
    grasps = [[int(v) for v in g] for g in base.grasps(body)]
    points = f"points = {_value(plan.points)}" if plan.points is not None else "# points = [0, 1, 2]"
    return f"""
[scenario]
name = {_value(plan.scenario)}
size = {_value(plan.size)}  # {axes} [m]
vertices = {_value(plan.vertices)}  # mesh vertices along the same axes; numbered {order}
# Where the measured points sit: "all" (point k on vertex k), "bound" (tied where they are in the
# first frame), or a vertex number for each.
markers = {_value(plan.markers)}
{points}  # measured points to compare, from 0; default all
# grasps = {_value(grasps)}  # for every gripper the vertices that it holds
settle = {base.settle:g}  # time to come to rest before the first frame [s]
# What stands around the object, in the world [m]; friction times the material's own is the Coulomb coefficient.
# obstacles = [{{ kind = "table", height = 0.0, friction = 1.0 }}]
"""


def _plugins(plan: Plan) -> str:
    options = "".join(f"# {line}\n" for line in _options("simulator", plan.simulator))
    default = EstimatorTable(name=plan.estimator)
    return f"""
[simulator]
name = {_value(plan.simulator)}  # installed: {", ".join(REGISTRY.names("simulator"))}
{options}
[extractor]
name = "markers"

[estimator]
name = {_value(plan.estimator)}  # installed: {", ".join(REGISTRY.names("estimator"))}
rounds = {default.rounds}  # each draws where the last one found the posterior
draws = {default.draws}  # simulations a round and recording
"""


def _options(kind: str, name: str) -> list[str]:
    """``key = default`` for the options of a plugin that TOML can hold."""
    signature = inspect.signature(REGISTRY.get(kind, name))
    defaults = [(p.name, p.default) for p in signature.parameters.values()]
    return [f"{key} = {_value(value)}" for key, value in defaults if isinstance(value, bool | int | float | str)]


def _material(kind: str) -> str:
    inferred = {p.name for p in DEFAULT_PRIORS[kind]}
    lines = ["", "# What is known of the material; put in what you have weighed or looked up.", "[material]"]
    for field in fields(MATERIALS[kind]):
        if field.name in inferred:
            lines.append(f"# {field.name} is inferred, see below")
        else:
            lines.append(f"{field.name} = {_value(field.default)}  # [{UNITS[kind][field.name]}]")
    return "\n".join([*lines, ""])


def _parameters(kind: str) -> str:
    lines = ["", "# What is inferred, with the bounds of its prior. Add any field of [material], or scale (the size)."]
    for p in DEFAULT_PRIORS[kind]:
        lines += [
            f"[parameters.{p.name}]  # {p.description}",
            f"low = {_value(p.low)}",
            f"high = {_value(p.high)}",
            f"scale = {_value(p.scale)}  # log: uniform in the logarithm",
            f"unit = {_value(p.unit)}",
            "",
        ]
    lines += ["# [parameters.scale]  # size of the object relative to the one given", "# low = 0.97", "# high = 1.03"]
    return "\n".join([*lines, ""])


def _effects() -> str:
    return """
# Physics on top of the plain model; muslin plugins lists the effects, muslin add writes these tables.
# An empty table infers every coefficient in its own range; a number fixes one.
# [effects.air-drag]
# drag_coefficient = 1.2
"""


def _rest() -> str:
    default = DiagnoseTable()
    return f"""
[noise]
# sd = 0.003  # of the measurement, a coordinate [m]; left out, it is estimated

[nuisance]  # prior standard deviation of what may be off in the measurement itself
clock_offset = 0.0  # points against gripper poses [s]
constant_offset = 0.0  # of the frame of the points [m]

[diagnose]
# Which effects to try; left out, every one that fits the object.
# candidates = {_value(REGISTRY.names("effect"))}
draws = {default.draws}  # starting points that are tried for each effect
"""


def _value(value: Any) -> str:
    """A TOML value. JSON strings are TOML strings, but for one control character."""
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
