"""A study resolved to something that can be simulated, small enough to send to worker processes."""

import inspect
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from ..arrays import FloatArray
from ..effect import Effect
from ..errors import InputError
from ..extractor import KeypointExtractor
from ..material import DEFAULT_PRIORS, MATERIALS, UNITS, Material, with_fields
from ..measurement import Measurement, Recording
from ..parameters import Parameter, ParameterSpace
from ..registry import REGISTRY, nearest
from ..rollout import Trajectory, rollout
from ..scenario import Scenario, bound_markers, marker_weights
from ..scenarios import preset
from ..simulator import Simulator
from .config import ParameterTable, StudyConfig


@dataclass(frozen=True, eq=False)
class Problem:
    """What to simulate and what to compare with.

    Args:
        recordings: by name, with only the points that are compared.
        fit_on, hold_out: names of recordings.
        scenarios: by recording.
        simulator, extractor: instances.
        material: what the parameters do not say.
        space: parameters to infer, coefficients of effects included.
        fixed: values of effect coefficients that are not inferred.
        effects: classes of every effect that a value may name.
    """

    recordings: dict[str, Recording]
    fit_on: tuple[str, ...]
    hold_out: tuple[str, ...]
    scenarios: dict[str, Scenario]
    simulator: Simulator
    extractor: KeypointExtractor
    material: Material
    space: ParameterSpace
    fixed: dict[str, float]
    effects: dict[str, type[Effect]]

    def simulate(self, values: Mapping[str, float], recording: str) -> Trajectory:
        """One rollout; ``values`` names material fields, ``scale``, and ``effect.coefficient``.

        Raises:
            RolloutFailed: see :func:`muslin.core.rollout.rollout`.
        """
        given: dict[str, float] = {}
        coefficients: dict[str, dict[str, float]] = {}
        scale = 1.0
        for name, value in {**self.fixed, **values}.items():
            if name == "scale":
                scale = float(value)
            elif "." in name:
                effect, coefficient = name.split(".", 1)
                coefficients.setdefault(effect, {})[coefficient] = float(value)
            else:
                given[name] = float(value)
        effects = [self.effects[name](**c) for name, c in coefficients.items()]
        trajectory = rollout(
            self.simulator, self.scenarios[recording], with_fields(self.material, given), effects, scale
        )
        seen = self.extractor.extract(trajectory.series, trajectory.series.time)
        return replace(trajectory, series=seen)

    def with_effects(self, *names: str) -> "Problem":
        """The same problem with the coefficients of these effects added to the parameters."""
        extra = tuple(p for n in names for p in self.effects[n].parameters())
        return replace(self, space=self.space + ParameterSpace(extra))


def build_problem(config: StudyConfig, measurement: Measurement) -> Problem:
    """Resolve a study; every name in it is checked here, before anything is simulated."""
    fit_on = tuple(config.study.fit_on or [n for n in measurement.names if n not in config.study.hold_out])
    hold_out = tuple(config.study.hold_out)
    if not fit_on:
        raise InputError("[study.fit_on]: nothing is left to fit on, every recording is held out")
    used = {n: measurement[n] for n in (*fit_on, *hold_out)}
    base = preset(config.scenario.name)
    recordings = {n: _keep_points(r, config.scenario.points) for n, r in used.items()}
    scenarios = {n: _scenario(config, r) for n, r in recordings.items()}
    kind = base.kind
    material = with_fields(MATERIALS[kind](), dict(config.material))
    effects = {n: REGISTRY.get("effect", n) for n in config.effects}
    for name in config.diagnose.candidates or []:
        REGISTRY.get("effect", name)
    coefficients, fixed = _effect_values(config, effects)
    space = ParameterSpace(_parameters(config, kind, material) + coefficients)
    simulator = _plugin("simulator", config.simulator.name, config.simulator.options)
    extractor = _plugin("extractor", config.extractor.name, config.extractor.options)
    if kind not in simulator.object_kinds:
        raise InputError(f"simulator {config.simulator.name!r} cannot do scenario {base.kind!r} objects")
    if extractor.needs_images:
        raise InputError(f"extractor {config.extractor.name!r} needs images, but the measurement holds points")
    return Problem(recordings, fit_on, hold_out, scenarios, simulator, extractor, material, space, fixed, effects)


def _plugin(kind: str, name: str, options: dict[str, Any]) -> Any:
    plugin = REGISTRY.get(kind, name)
    try:
        inspect.signature(plugin).bind(**options)
    except TypeError as error:
        raise InputError(f"[{kind}] {name!r} does not take these options: {error}") from error
    try:
        return plugin(**options)
    except (TypeError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        told = ", ".join(f"{k} = {v!r}" for k, v in options.items())
        raise InputError(f"[{kind}] {name!r} cannot be made with {told}: {error}") from error


def _keep_points(recording: Recording, points: list[int] | None) -> Recording:
    if points is None:
        return recording
    series, count = recording.series, recording.series.points.shape[1]
    wrong = [p for p in points if not 0 <= p < count]
    if wrong:
        raise InputError(
            f"[scenario.points]: recording {recording.name!r} has points 0 to {count - 1}, there is no {wrong[0]}"
        )
    return replace(recording, series=replace(series, points=series.points[:, points]))


def _scenario(config: StudyConfig, recording: Recording) -> Scenario:
    table, base = config.scenario, preset(config.scenario.name)
    body = base.body(table.size, table.vertices)
    grasps = base.grasps(body) if table.grasps is None else tuple(np.array(g, np.int64) for g in table.grasps)
    plain = Scenario(
        name=table.name,
        body=body,
        grasps=grasps,
        motion=recording.gripper or base.motion(),
        times=recording.series.time,
        markers=np.eye(len(body.vertices)),
        load_vertices=base.load_vertices(body),
        obstacles=base.obstacles if table.obstacles is None else tuple(o.build() for o in table.obstacles),
        settle=base.settle if table.settle is None else table.settle,
    ).for_recording(recording)
    return replace(plain, markers=_markers(table.markers, plain, recording))


def _markers(choice: list[int] | str | None, scenario: Scenario, recording: Recording) -> FloatArray:
    count, points = len(scenario.body.vertices), recording.series.points
    if recording.series.unit == "px":
        raise InputError(
            f"recording {recording.name!r} is in pixels; only points in metres can be compared without a camera"
        )
    if points.shape[2] != 3:
        raise InputError(f"recording {recording.name!r} has points (x, y) in metres; comparing needs x, y and z")
    if choice == "bound":
        if scenario.settle > 0:
            raise InputError(
                "[scenario] markers = 'bound' ties each marker to the object in its rest shape, so it cannot go with "
                f"settle = {scenario.settle:g}; set settle = 0, or name the vertices under the markers"
            )
        seen = recording.series.valid[0]
        if not seen.all():
            raise InputError(
                f"recording {recording.name!r}: marker {int(np.argmin(seen))} is not seen in the first frame, "
                "so it cannot be bound to the object; start the recording later or give [scenario.markers] vertices"
            )
        return bound_markers(scenario.world_vertices(), points[0])
    if isinstance(choice, list):
        weights = marker_weights(count, np.array(choice, np.int64))
        if recording.series.correspondence and len(weights) != points.shape[1]:
            raise InputError(
                f"[scenario.markers] names {len(weights)} vertices, "
                f"but recording {recording.name!r} has {points.shape[1]} points"
            )
        return weights
    if recording.series.correspondence and points.shape[1] != count:
        raise InputError(
            f"recording {recording.name!r} has {points.shape[1]} points, the mesh {count} vertices; say where the "
            "markers sit: [scenario] markers = [vertex, ...], or markers = 'bound' to tie each to the object where "
            "it is in the first frame, or import without --correspondence"
        )
    return np.eye(count)


def _parameters(config: StudyConfig, kind: str, material: Material) -> tuple[Parameter, ...]:
    if not config.parameters:
        return DEFAULT_PRIORS[kind]
    out = []
    for name, table in config.parameters.items():
        if name not in (*(f.name for f in fields(material)), "scale"):
            known = [*(f.name for f in fields(material)), "scale"]
            raise InputError(f"[parameters.{name}]: unknown.{nearest(name, known)} Known: {', '.join(known)}")
        out.append(_parameter(name, table, UNITS[kind][name], f"parameters.{name}"))
        for bound in (table.low, table.high):
            _check_bound(material, name, bound)
    return tuple(out)


def _check_bound(material: Material, name: str, bound: float) -> None:
    """A bound that no material can have is said now, not in the middle of a fit."""
    if name == "scale":
        if bound <= 0:
            raise InputError(f"[parameters.scale]: must be above zero, but a bound is {bound:g}")
        return
    try:
        with_fields(material, {name: bound})
    except InputError as error:
        raise InputError(f"[parameters.{name}]: {error}") from error


def _parameter(name: str, table: ParameterTable, unit: str, where: str) -> Parameter:
    if table.unit is not None and table.unit != unit:
        raise InputError(f"[{where}]: unit is {table.unit!r}, but {name} is in {unit!r}; convert low and high")
    return Parameter(name, unit, table.low, table.high, table.scale)


def _effect_values(
    config: StudyConfig, effects: dict[str, type[Effect]]
) -> tuple[tuple[Parameter, ...], dict[str, float]]:
    inferred: list[Parameter] = []
    fixed: dict[str, float] = {}
    for effect, table in config.effects.items():
        declared = {p.name: p for p in effects[effect].parameters()}
        given = {f"{effect}.{c}": v for c, v in table.items()}
        for name in given:
            if name not in declared:
                known = [n.split(".", 1)[1] for n in declared]
                raise InputError(f"[effects.{effect}] has no {name.split('.', 1)[1]!r}; it has {', '.join(known)}")
        for name, p in declared.items():
            value = given.get(name)
            if value is None:
                inferred.append(p)
            elif isinstance(value, ParameterTable):
                inferred.append(_parameter(name, value, p.unit, f"effects.{name}"))
            else:
                fixed[name] = float(value)
    return tuple(inferred), fixed
