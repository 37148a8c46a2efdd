"""Run the same draws on several simulators."""

from collections.abc import Callable, Sequence

import numpy as np

from ..arrays import FloatArray
from ..errors import InputError
from ..material import DEFAULT_PRIORS, MATERIALS, Material
from ..parameters import Parameter, ParameterSpace
from ..registry import REGISTRY
from ..rollout import Trajectory
from ..scenario import STANDARD_GRAVITY, Scenario
from ..scenarios import preset
from ..simulator import Simulator
from ..study import Problem, SimulationPool, Task
from .result import SimulatorComparison, SimulatorRun

Progress = Callable[[str, int, int], None]


def compare_simulators(
    scenario: str | Scenario,
    simulators: Sequence[str | Simulator],
    draws: int = 50,
    *,
    parameters: Sequence[Parameter] | None = None,
    material: Material | None = None,
    seed: int = 0,
    workers: int | None = None,
    progress: Progress = lambda what, done, total: None,
) -> SimulatorComparison:
    """Simulate the same draws from a prior on every simulator.

    Args:
        scenario: one of your own, or the name of a built-in one.
        simulators: names or instances, two at least.
        draws: how many; a Latin hypercube (McKay, Beckman and Conover 1979) over the prior.
        parameters: what is drawn; default the priors of the scenario or the kind of object.
        material: what is not drawn; default that of the scenario.
        seed: of the draws.
        workers: processes; None takes one a core.
        progress: called with what is done, how much of it, of how much.

    Raises:
        InputError: a name is unknown, a simulator cannot build the scenario, or there are fewer than two.
    """
    made = [REGISTRY.get("simulator", s)() if isinstance(s, str) else s for s in simulators]
    names = [s.name for s in made]
    if len(made) < 2 or len(set(names)) < len(names):
        raise InputError(f"comparing needs at least two different simulators, got {', '.join(names) or 'none'}")
    if draws < 1:
        raise InputError(f"comparing needs at least one draw, got {draws}")
    if isinstance(scenario, str):
        base = preset(scenario)
        scenario, material = base.scenario(), material or base.default_material()
        parameters = base.default_priors() if parameters is None else parameters
    material = material or MATERIALS[scenario.body.kind]()
    space = ParameterSpace(tuple(DEFAULT_PRIORS[scenario.body.kind] if parameters is None else parameters))
    for simulator in made:
        simulator.check(scenario.scene(material, np.array([0.0, 0.0, -STANDARD_GRAVITY])))
    unit = latin_hypercube(draws, len(space), seed)
    values = space.from_unit(unit)
    tasks = [Task(dict(zip(space.names, row.tolist(), strict=True)), scenario.name) for row in values]
    runs = []
    for simulator in made:
        problem = Problem(
            recordings={},
            fit_on=(scenario.name,),
            hold_out=(),
            scenarios={scenario.name: scenario},
            simulator=simulator,
            extractor=REGISTRY.get("extractor", "markers")(),
            material=material,
            space=space,
            fixed={},
            effects={},
        )
        vertices = np.full((draws, len(scenario.times), len(scenario.body.vertices), 3), np.nan)
        seconds, failures = np.full(draws, np.nan), {}
        with SimulationPool(problem, workers) as pool:
            for k, outcome in enumerate(pool.map(tasks)):
                if isinstance(outcome, Trajectory):
                    vertices[k], seconds[k] = outcome.vertices, outcome.seconds
                else:
                    failures[k] = outcome.reason
                progress(f"simulating on {simulator.name}", k + 1, draws)
        runs.append(SimulatorRun(simulator.name, simulator.engine_version(), vertices, failures, seconds))
    return SimulatorComparison(scenario.name, scenario.body.kind, space, unit, scenario.times, tuple(runs))


def latin_hypercube(count: int, dimensions: int, seed: int) -> FloatArray:
    """Points ``(count, dimensions)`` in the unit cube, one in each of ``count`` slices along every axis."""
    rng = np.random.default_rng([seed, count])
    slices = np.stack([rng.permutation(count) for _ in range(dimensions)], axis=1)
    return np.asarray((slices + rng.random((count, dimensions))) / count)
