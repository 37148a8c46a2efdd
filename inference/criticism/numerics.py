"""How far the model's own numbers may be off: directions from a finer step, a finer mesh, and another engine."""

from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import dataclass, replace

import numpy as np

from ...core.arrays import FloatArray
from ...core.errors import MuslinError
from ...core.powerless import why_powerless
from ...core.refinement import refined
from ...core.registry import REGISTRY
from ...core.rollout import Trajectory
from ...core.series import PointSeries
from ...core.simulator import Simulator
from ...core.study import Problem, SimulationPool, Task
from ..noise import Noise
from ..residuals import Offsets, residual, rms_apart

#: How much larger the whole error is than what a step or spacing of half the size takes away: first-order methods
#: still have as much before them, second-order ones a third.
STEP_ERROR, _MESH = 2.0, 4.0 / 3.0


@dataclass(frozen=True, eq=False)
class Numerics:
    """What the numbers of a model may be off by.

    Args:
        directions: of the white residuals, ``(N_r, K)`` by recording.
        moved: how far the fitted recordings go from what the model predicts, root mean square a coordinate, by what
            was changed: ``"step"`` (half of it), ``"mesh"`` (finer), or the name of another engine [m or px].
        cost: rollouts elsewhere that it took.
    """

    directions: dict[str, FloatArray]
    moved: dict[str, float]
    cost: int


def numerics(pool: SimulationPool, values: dict[str, float], noise: Noise, offsets: Offsets) -> Numerics:
    """Simulate the pool's problem at ``values`` with a finer step, on a finer mesh, and on every other engine.

    Each direction comes twice, see :func:`changes`. Directions that cannot be had (no other engine is there, or it
    cannot do this) are left out. A change towards better numbers that lets the misfit grow cannot be what the misfit is
    due to: its directions are left out.
    """
    problem = pool.problem
    names = (*problem.fit_on, *problem.hold_out)
    used = [problem.effects[e] for e in {n.split(".", 1)[0] for n in values if "." in n}]
    variants: dict[str, tuple[Problem, float, int]] = {}  # how much its change counts, and on how many processes
    finer = problem.simulator.finer()
    if finer is not None:
        variants["step"] = replace(problem, simulator=finer), STEP_ERROR, 1
    meshes = {n: refined(problem.scenarios[n]) for n in names}
    if all(s is not None for s in meshes.values()):
        whole = {n: s for n, s in meshes.items() if s is not None}
        variants["mesh"] = replace(problem, scenarios={**problem.scenarios, **whole}), _MESH, pool.workers
    for simulator in _others(problem.simulator):
        scenario = problem.scenarios[names[0]]
        if not any(why_powerless(effect, simulator, scenario) for effect in used):
            variants[simulator.name] = replace(problem, simulator=simulator), 1.0, 1
    as_it_is = _predicted(pool, values, names)
    towards: dict[str, list[FloatArray]] = {n: [] for n in names}
    with ExitStack() as stack:  # an interruption ends the processes first, then the threads that wait for them
        threads = stack.enter_context(ThreadPoolExecutor(max(1, pool.workers)))
        # a few rollouts each: but on the finer mesh, starting more than one process would take longer
        pools = [stack.enter_context(SimulationPool(v, min(most, pool.workers))) for v, _, most in variants.values()]
        others = list(threads.map(lambda elsewhere: _predicted(elsewhere, values, names), pools))
        cost = sum(elsewhere.count for elsewhere in pools)
    moved = {}
    for (what, (_, size, _)), made in zip(variants.items(), others, strict=True):
        found = {
            name: _columns(problem, name, as_it_is[name], made[name], size, noise, offsets)
            for name in names
            if name in made.keys() & as_it_is.keys()
        }
        if sum(gain for name, (_, gain) in found.items() if name in problem.fit_on) >= 0.0:
            for name, (columns, _) in found.items():
                towards[name] += columns
        both = [n for n in problem.fit_on if n in made.keys() & as_it_is.keys()]
        pairs = [(as_it_is[n].points, made[n].points) for n in both]
        if alike := [(a, b) for a, b in pairs if a.shape == b.shape]:
            moved[what] = rms_apart(alike)
    return Numerics(_stacked(towards), moved, cost)


def _stacked(columns: dict[str, list[FloatArray]]) -> dict[str, FloatArray]:
    return {name: np.stack(its, axis=1) for name, its in columns.items() if its}


def changes(base: FloatArray, other: FloatArray) -> list[FloatArray]:
    """From points ``(T, P, A)`` to others, constant and growing over the recording, as errors of a rollout do."""
    later = np.linspace(-1.0, 1.0, len(base))[:, None, None]
    return [other - base, later * (other - base)]


def _others(simulator: Simulator) -> list[Simulator]:
    """Every other engine that is installed, with its own defaults."""
    out = []
    for name in REGISTRY.names("simulator"):
        if name != simulator.name:
            try:
                made: Simulator = REGISTRY.get("simulator", name)()
                made.engine_version()
            except (MuslinError, ImportError, TypeError):
                continue
            out.append(made)
    return out


def _predicted(pool: SimulationPool, values: dict[str, float], names: tuple[str, ...]) -> dict[str, PointSeries]:
    try:
        outcomes = list(pool.map([Task(values, n) for n in names]))
    except MuslinError:  # refused by the engine
        return {}
    return {n: o.series for n, o in zip(names, outcomes, strict=True) if isinstance(o, Trajectory)}


def _columns(
    problem: Problem, name: str, base: PointSeries, other: PointSeries, size: float, noise: Noise, offsets: Offsets
) -> tuple[list[FloatArray], float]:
    """Of one recording and one change: its directions, and how fast going along it lessens half the square misfit."""
    recording = problem.recordings[name]
    if base.points.shape != other.points.shape:
        return [], 0.0
    white = residual(recording, base, noise, offsets).white
    out, gain = [], 0.0
    for k, change in enumerate(changes(base.points, other.points)):
        moved = replace(base, points=base.points + change)
        column = size * (residual(recording, moved, noise, offsets).white - white)
        if np.isfinite(column).all():
            out.append(column)
            if k == 0:  # the second one is what may grow or shrink of it
                gain = -float(column @ white)
    return out, gain
