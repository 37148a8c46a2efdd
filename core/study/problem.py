"""A study resolved to something that can be simulated, small enough to send to worker processes."""

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..effect import Effect
from ..errors import InputError, RolloutFailed
from ..extractor import KeypointExtractor
from ..gaps import bridged
from ..material import Material, with_fields
from ..measurement import Measurement, Recording
from ..parameters import ParameterSpace
from ..powerless import why_powerless
from ..registry import REGISTRY, check_options
from ..rollout import Trajectory, rollout
from ..sanity import SanityCheck
from ..scenario import STANDARD_GRAVITY, Scenario
from ..scenarios import preset
from ..scenarios.kept import told_bend
from ..scenarios.laid import laid_under
from ..scenarios.measured import with_earlier
from ..scenarios.spacing import told_places
from ..scenarios.standoffs import told_beside
from ..simulated_take import SimulatedTake
from ..simulator import Simulator
from .config import StudyConfig
from .inferred import effect_values, given_material, material_parameters
from .objects import build_scenario, check_unstretched, keep_points
from .windows import cut_all


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
        time_limit: on the computation of one rollout [s]; None for none.
        cut_from: by piece the recording that it is of, where recordings that are fitted are cut.
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
    time_limit: float | None = None
    cut_from: dict[str, str] = field(default_factory=dict)

    @property
    def pieces(self) -> float:
        """Into how many a recording that is fitted was cut, in the mean."""
        return len(self.cut_from) / len(set(self.cut_from.values())) if self.cut_from else 1.0

    def told_as(self, rollouts: int) -> int:
        """So many simulations: the pieces of a recording cost as much as the whole, so they count as one."""
        return round(rollouts / self.pieces)

    def simulate(self, values: Mapping[str, float], recording: str) -> Trajectory:
        """One rollout; ``values`` names material fields, ``scale``, and ``effect.coefficient``.

        Points that the extractor did not find in it are bridged, see :func:`~muslin.core.gaps.bridged`.

        Raises:
            RolloutFailed: see :func:`muslin.core.rollout.rollout`; or a point is found nowhere in it.
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
        material, scenario = with_fields(self.material, given), self.scenarios[recording]
        trajectory = rollout(self.simulator, scenario, material, effects, scale, self.time_limit)
        scene = scenario.scene(material, np.array([0.0, 0.0, -STANDARD_GRAVITY]), scale)
        take = SimulatedTake(trajectory.series, trajectory.vertices, scene, scenario.camera, scenario.unit)
        seen = self.extractor.observe(take)
        if seen.unit != scenario.unit:
            raise InputError(
                f"[extractor]: {self.extractor.name!r} gives points in {seen.unit}, but recording {recording!r} is in "
                f"{scenario.unit}; take another extractor, or extract the recording's points with this one"
            )
        compared = None
        if seen.correspondence and recording in self.recordings:
            compared = np.asarray(self.recordings[recording].series.valid.any(axis=0))
        return replace(trajectory, series=bridged(seen, compared))

    def points_of(self, recording: str) -> int:
        """How many points a simulated take of ``recording`` has."""
        scenario, measured = self.scenarios[recording], self.recordings[recording].series.points.shape[1]
        return self.extractor.points_of(len(scenario.body.vertices), len(scenario.markers), measured)

    @property
    def clouds(self) -> list[str]:
        """Recordings whose points are places anywhere on the object, of which any part may be hidden or cut off."""
        return [n for n, r in self.recordings.items() if self.scenarios[n].sampled and not r.series.correspondence]

    def played_as(self) -> dict[str, str]:
        """For every recording the first one with the same rollouts: itself, or an earlier take of its motion."""
        out: dict[str, str] = {}
        for name, scenario in self.scenarios.items():
            first = (n for n in dict.fromkeys(out.values()) if self.scenarios[n].same_rollout(scenario))
            out[name] = next(first, name)
        return out

    def prepare(self) -> None:
        """Let the simulator get ready in this process, so that no rollout pays for it in time; nothing is raised."""
        with suppress(Exception):
            gravity = np.array([0.0, 0.0, -STANDARD_GRAVITY])
            self.simulator.prepare(self.scenarios[self.fit_on[0]].scene(self.material, gravity))

    def with_effects(self, *names: str) -> "Problem":
        """The same problem with the coefficients of these effects added to the parameters."""
        extra = tuple(p for n in names for p in self.effects[n].parameters())
        return replace(self, space=self.space + ParameterSpace(extra))


def build_problem(config: StudyConfig, measurement: Measurement, folder: Path = Path()) -> Problem:
    """Resolve a study; every name in it is checked here, before anything is simulated.

    Args:
        config: of the study.
        measurement: what it is about.
        folder: of the study file, where paths to meshes start.
    """
    fit_on = tuple(config.study.fit_on or [n for n in measurement.names if n not in config.study.hold_out])
    hold_out = tuple(config.study.hold_out)
    if not fit_on:
        raise InputError("[study.fit_on]: nothing is left to fit on, every recording is held out")
    held, fitted = [measurement[n] for n in hold_out], [measurement[n] for n in fit_on]
    fitted, whole = cut_all(fitted, config.study.window)
    fit_on = tuple(r.name for r in fitted)
    base = preset(config.scenario.name)
    recordings = {r.name: keep_points(r, config.scenario.points) for r in (*fitted, *held)}
    options = dict(config.extractor.options)
    if isinstance(options.get("weights"), str):
        options["weights"] = str(folder / options["weights"])
    extractor = _plugin("extractor", config.extractor.name, options)
    if not extractor.ready:
        raise InputError(
            f"[extractor]: {config.extractor.name!r} has not learned yet; name the file that muslin train wrote: "
            "weights = FILE"
        )
    marked, beside, seen = extractor.uses_markers, None, recordings
    if config.scenario.markers == "beside":  # held-out recordings must not tell, here and below
        beside, seen = told_beside(recordings, fit_on)
    scenarios = {n: build_scenario(config.scenario, r, folder, marked, beside) for n, r in seen.items()}
    if config.scenario.spacing is not None:
        if not marked:
            raise InputError(
                f"[scenario] spacing = 'measured' is for markers, but extractor {config.extractor.name!r} finds points "
                "of its own; leave spacing out"
            )
        if "scale" in config.parameters:
            raise InputError(
                "[scenario] spacing = 'measured' takes the cloth to be as large as size says, so it does not go with "
                "[parameters.scale]; leave one of them out"
            )
        first = scenarios[fit_on[0]]
        places = told_places(first.body, first.markers, [recordings[n] for n in fit_on])
        scenarios = {n: replace(s, markers=places) for n, s in scenarios.items()}
    if config.scenario.frame == "markers":
        scenarios = {n: laid_under(s, recordings[n]) for n, s in scenarios.items()}
    kind = scenarios[fit_on[0]].body.kind
    if config.scenario.start == "measured":
        kept = told_bend([scenarios[n] for n in fit_on], [recordings[n] for n in fit_on])
        scenarios = {n: replace(s, kept=kept) for n, s in scenarios.items()}
        scenarios |= {n: with_earlier(scenarios[n], keep_points(r, config.scenario.points)) for n, r in whole.items()}
    material = given_material(config, base.default_material(kind))
    effects = {n: REGISTRY.get("effect", n) for n in config.effects}
    for name in config.diagnose.candidates or []:
        REGISTRY.get("effect", name)
    for n, effect in effects.items():
        if kind not in effect.object_kinds:
            raise InputError(f"[effects.{n}] is for {' and '.join(sorted(effect.object_kinds))}, but this is a {kind}")
    coefficients, fixed = effect_values(config, effects, material)
    space = ParameterSpace((material_parameters(config, material) or base.default_priors(kind)) + coefficients)
    simulator = _plugin("simulator", config.simulator.name, config.simulator.options)
    for n, effect in effects.items():
        if (reason := why_powerless(effect, simulator, scenarios[fit_on[0]])) is not None:
            raise InputError(f"[effects.{n}]: {reason}")
    if extractor.needs_images and (blind := [r.name for r in recordings.values() if r.camera is None]):
        raise InputError(
            f"[extractor]: {config.extractor.name!r} looks at rendered pictures of what is simulated, but the camera "
            f"of recording {blind[0]!r} is not known; import it again with --camera FILE, or take another extractor"
        )
    scales = {1.0, *(bound for p in space if p.name == "scale" for bound in (p.low, p.high))}
    for name, scenario in scenarios.items():
        for scale in sorted(scales):
            _check_start(simulator, scenario, material, scale, name)
    limit, cut_from = config.study.time_limit, {n: r.name for n, r in whole.items()}
    return Problem(
        recordings, fit_on, hold_out, scenarios, simulator, extractor, material, space, fixed, effects, limit, cut_from
    )


def _check_start(simulator: Simulator, scenario: Scenario, material: Material, scale: float, recording: str) -> None:
    """What would fail in every simulated draw is said now."""
    sized = "" if scale == 1.0 else f" at scale {scale:g}"
    scene = scenario.scene(material, np.array([0.0, 0.0, -STANDARD_GRAVITY]), scale)
    simulator.check(scene)
    check_unstretched(scenario, scale, f"recording {recording!r}{sized}")
    try:
        SanityCheck(scene)(scene.start_positions, float(scenario.times[0]))
    except RolloutFailed as error:
        raise InputError(
            f"recording {recording!r}{sized}: the object cannot start like this: {error}; check [scenario] obstacles "
            "and frame, the gripper poses and --up"
        ) from error


def _plugin(kind: str, name: str, options: dict[str, Any]) -> Any:
    plugin = REGISTRY.get(kind, name)
    check_options(kind, name, plugin, options)
    try:
        return plugin(**options)
    except (TypeError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        told = ", ".join(f"{k} = {v!r}" for k, v in options.items())
        raise InputError(f"[{kind}] {name!r} cannot be made with {told}: {error}") from error
