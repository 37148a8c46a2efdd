"""How fast rollouts are, always against something else in the same run.

(a) muslin's MuJoCo rollout, with building its model, against a bare ``mj_step`` loop of the same cloth under the same
motion: once with MuJoCo's own bending, and once with none, which simulates less than the rollout (muslin computes
bending outside of MuJoCo where it is soft);
(b) muslin's PyBullet rollout against a stock pybullet loop of the same mesh (stepSimulation at the same substep,
getMeshData at every observation); (c) 2 worker processes against 1; (d) cost against vertices; (e) frames rendered
a second; (f) how far time steps are from small ones, and the engines from each other::

    make bench-sim
"""

import argparse
import statistics
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
from table import Row, report

from muslin.core.arrays import FloatArray
from muslin.core.comparison.compare_simulators import latin_hypercube
from muslin.core.effect import Effect
from muslin.core.material import DEFAULT_PRIORS, ClothMaterial, Material
from muslin.core.obstacles import Table
from muslin.core.parameters import ParameterSpace
from muslin.core.registry import REGISTRY
from muslin.core.rollout import rollout
from muslin.core.scenario import Scenario
from muslin.core.scenarios import preset
from muslin.core.study import Problem, SimulationPool, Task

MATERIAL = ClothMaterial()
GRAVITY = np.array([0.0, 0.0, -9.80665])
SEED = 1
STEPS = (0.0005, 0.00125, 0.0025, 0.005)


def timed(call: Callable[[], object]) -> float:
    began = time.perf_counter()
    call()
    return time.perf_counter() - began


def paired(one: Callable[[], float], other: Callable[[], float], times: int) -> tuple[float, float, float]:
    """Run both in turn, A B A B; median ratio one / other, and both medians [s]."""
    pairs = [(one(), other()) for _ in range(times + 1)][1:]  # the first warms up
    return (
        statistics.median(a / b for a, b in pairs),
        statistics.median(a for a, _ in pairs),
        statistics.median(b for _, b in pairs),
    )


def fling(vertices: int = 9) -> Scenario:
    return preset("fling").scenario(vertices=(vertices, vertices))


def bare_mujoco(scenario: Scenario, bends: bool) -> float:
    """Seconds of ``mj_step`` and of putting the held vertices where they must be, nothing else.

    Args:
        scenario: what happens.
        bends: with MuJoCo's own bending, or with none.
    """
    import mujoco

    simulator = REGISTRY.get("simulator", "mujoco")()
    scene = scenario.scene(MATERIAL, GRAVITY)
    thickness = np.sqrt(12 * (1 - MATERIAL.poisson_ratio**2) * MATERIAL.bending_rigidity / MATERIAL.stretch_stiffness)
    elasticity = (
        f'<elasticity young="{MATERIAL.stretch_stiffness / thickness:.17g}" poisson="{MATERIAL.poisson_ratio}" '
        f'thickness="{thickness:.17g}" damping="1" elastic2d="{"both" if bends else "stretch"}"/>'
    )
    with patch("muslin.backends.mujoco.model._elasticity", return_value=elasticity):
        world = simulator.open(scene)
    model, data = world._model, world._data
    dt, start = world.time_step, scenario.times[0]
    settle = int(np.ceil(scenario.settle / dt - 1e-9))
    steps = int(np.ceil((scenario.times[-1] - start) / dt - 1e-9))
    clock = np.maximum(start + dt * np.arange(-settle, steps + 1), start)
    path = scenario.held_positions(clock, scene.start_positions)
    dofs = (3 * scene.held[:, None] + np.arange(3)).ravel()
    target = path.reshape(len(path), -1) - scene.body.vertices[scene.held].ravel()
    velocity = np.diff(target, axis=0) / dt
    began = time.perf_counter()
    for k in range(len(velocity)):
        data.qvel[dofs] = velocity[k]
        mujoco.mj_step(model, data)
        data.qpos[dofs] = target[k + 1]
        data.qvel[dofs] = velocity[k]
    seconds = time.perf_counter() - began
    world.close()
    return seconds


def overhead(rows: list[Row], times: int) -> None:
    simulator = REGISTRY.get("simulator", "mujoco")()
    drag: Effect = REGISTRY.get("effect", "air-drag")(drag_coefficient=1.2, lift_coefficient=0.3)
    for name, goal, effects in (("without effects", 1.10, []), ("with air drag", 1.40, [drag])):
        scenario = fling()
        for bends, against in ((True, "bare mj_step"), (False, "bare mj_step that does not bend")):
            ratio, ours, bare = paired(
                lambda s=scenario, e=effects: timed(lambda: rollout(simulator, s, MATERIAL, e)),
                lambda s=scenario, b=bends: bare_mujoco(s, b),
                times,
            )
            rows.append(
                Row(f"(a) MuJoCo rollout {name} over {against}", round(ratio, 3), "x", f"<= {goal}", ratio <= goal)
            )
            rows.append(
                Row(f"(a) MuJoCo rollout {name}, and {against}", round(1e3 * ours, 1), f"ms, bare {1e3 * bare:.1f} ms")
            )


def stock_pybullet(scenario: Scenario, substep: float, substeps: int) -> float:
    """Seconds of the loop in pybullet's own deformable examples, on the same mesh, table and substep."""
    import pybullet as p

    scene = scenario.scene(MATERIAL, GRAVITY)
    client = p.connect(p.DIRECT)
    try:
        p.resetSimulation(p.RESET_USE_DEFORMABLE_WORLD, physicsClientId=client)
        p.setGravity(*GRAVITY, physicsClientId=client)
        p.setTimeStep(substep, physicsClientId=client)
        for table in scene.obstacles:
            assert isinstance(table, Table)
            box = p.createCollisionShape(p.GEOM_BOX, halfExtents=[2, 2, 0.5], physicsClientId=client)
            p.createMultiBody(0, box, basePosition=[0, 0, table.height - 0.5], physicsClientId=client)
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder, "cloth.obj")
            points = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in scene.body.vertices]
            faces = [f"f {a} {b} {c}" for a, b, c in scene.body.elements + 1]
            path.write_text("\n".join([*points, *faces]) + "\n")
            cloth = p.loadSoftBody(
                str(path),
                mass=float(scene.body.measures.sum() * MATERIAL.areal_density),
                useMassSpring=1,
                useBendingSprings=1,
                springElasticStiffness=0.75 * MATERIAL.stretch_stiffness,
                springBendingStiffness=0.01 * MATERIAL.stretch_stiffness,
                springDampingStiffness=0.0,
                frictionCoeff=MATERIAL.friction,
                collisionMargin=0.002,
                physicsClientId=client,
            )
        for vertex in scene.held.tolist():
            p.createSoftBodyAnchor(cloth, vertex, -1, -1, physicsClientId=client)
        start = scenario.times[0]
        settle = int(np.ceil(scenario.settle / (substep * substeps) - 1e-9)) * substeps
        every = max(1, round((scenario.times[1] - start) / substep))
        steps = int(np.ceil((scenario.times[-1] - start) / (substep * substeps) - 1e-9)) * substeps
        began = time.perf_counter()
        for k in range(settle + steps):
            p.stepSimulation(physicsClientId=client)
            if k >= settle and (k - settle) % every == 0:
                p.getMeshData(cloth, -1, flags=p.MESH_DATA_SIMULATION_MESH, physicsClientId=client)
        return time.perf_counter() - began
    finally:
        p.disconnect(client)


def against_stock(rows: list[Row], times: int) -> None:
    simulator = REGISTRY.get("simulator", "pybullet")()
    below = replace(fling(), obstacles=(Table(0.55),))
    for name, scenario in (("fling", fling()), ("fling over a table", below)):
        world = simulator.open(scenario.scene(MATERIAL, GRAVITY))
        substeps = world._substeps
        substep = world.time_step / substeps
        world.close()
        ratio, ours, stock = paired(
            lambda s=scenario: timed(lambda: rollout(simulator, s, MATERIAL)),
            lambda s=scenario, h=substep, n=substeps: stock_pybullet(s, h, n),
            times,
        )
        rows.append(Row(f"(b) PyBullet rollout over the stock loop, {name}", round(ratio, 3), "x", "<= 1", ratio <= 1))
        told = f"s, stock {stock:.2f} s, substep {1e3 * substep:.2f} ms"
        rows.append(Row(f"(b) PyBullet rollout, {name}", round(ours, 2), told))


def problem(engine: str, scenario: Scenario) -> Problem:
    return Problem(
        recordings={},
        fit_on=(scenario.name,),
        hold_out=(),
        scenarios={scenario.name: scenario},
        simulator=REGISTRY.get("simulator", engine)(),
        extractor=REGISTRY.get("extractor", "markers")(),
        material=MATERIAL,
        space=ParameterSpace(DEFAULT_PRIORS["cloth"]),
        fixed={},
        effects={},
    )


def scaling(rows: list[Row], times: int) -> None:
    scenario = fling()
    what = problem("mujoco", scenario)
    values = what.space.from_unit(latin_hypercube(60, len(what.space), SEED))
    tasks = [Task(dict(zip(what.space.names, v.tolist(), strict=True)), scenario.name) for v in values]
    with SimulationPool(what, 1) as one, SimulationPool(what, 2) as two:
        for pool in (one, two):  # processes start, engines load
            list(pool.map(tasks[:4]))
        ratio, alone, both = paired(
            lambda: timed(lambda: list(one.map(tasks))), lambda: timed(lambda: list(two.map(tasks))), times
        )
    told = f"x, {alone:.1f} s and {both:.1f} s for {len(tasks)} flings"
    rows.append(Row("(c) 2 worker processes against 1, MuJoCo", round(ratio, 2), told, ">= 1.8", ratio >= 1.8))


def sizes(rows: list[Row]) -> None:
    for engine in ("mujoco", "pybullet"):
        simulator = REGISTRY.get("simulator", engine)()
        for side in (9, 15, 21, 31):
            scenario = fling(side)
            short = replace(scenario, times=scenario.times[: round(0.3 * 30) + 1], settle=0.0)
            seconds = min(rollout(simulator, short, MATERIAL).seconds for _ in range(2))
            simulated = float(short.times[-1] - short.times[0])
            told = "s of computation a simulated second"
            rows.append(Row(f"(d) {engine}, {side * side} vertices", round(seconds / simulated, 2), told))


def rendering(rows: list[Row]) -> None:
    from muslin.core.renderer import frames_per_second

    for name in REGISTRY.names("renderer"):
        for side in (9, 31):
            try:
                rate: Any = round(frames_per_second(name, side), 1)
            except Exception as error:
                rate = f"not here: {error}"
            rows.append(Row(f"(e) renderer {name}, 320 x 320, {side * side} vertices", rate, "frames a second"))


def time_steps(rows: list[Row]) -> None:
    rope = preset("swing").scenario(size=(0.6,), vertices=(16,))
    cases: list[tuple[str, Scenario, Material]] = [
        (name, preset(name).scenario(), MATERIAL) for name in ("fling", "swing")
    ]
    string = preset("swing").default_material("rope")
    cases.append(("swing of a rope", rope, string))
    damped = replace(string, damping_time=0.2)
    cases.append(("swing of a rope damped for 0.2 s", rope, damped))
    sheet, felt = preset("swing").scenario(), replace(MATERIAL, damping_time=0.05)
    cases.append(("swing of a cloth damped for 0.05 s", sheet, felt))
    for name, scenario, material in cases:
        paths = from_the_smallest(rows, name, scenario, material)
        other = rollout(REGISTRY.get("simulator", "pybullet")(), scenario, material).vertices
        for step, path in paths.items():
            rows.append(Row(f"(f) {name}, PyBullet from MuJoCo at {1e3 * step:g} ms", apart(other, path), "mm RMS"))
    with patch("muslin.backends.mujoco.rod.stretch_damping", lambda body, material, *_: material.damping_time):
        from_the_smallest(rows, "that rope with its stretch damped as long", rope, damped)
    with patch("muslin.backends.mujoco.turning.Turning.force", lambda *_: None):
        from_the_smallest(rows, "the first rope slowed down where it turns", rope, string)
    with patch("muslin.backends.mujoco.lengthening.Lengthening.force", lambda _, moved, steps: np.zeros(moved.size)):
        from_the_smallest(rows, "that cloth held by its damping where its edges get longer", sheet, felt)


def from_the_smallest(rows: list[Row], name: str, scenario: Scenario, material: Material) -> dict[float, FloatArray]:
    """What MuJoCo makes of a scenario by step ``(T, V, 3)`` [m]; how far that is from the smallest step is a row."""
    smallest, *others = STEPS
    paths = {
        step: rollout(REGISTRY.get("simulator", "mujoco")(time_step=step), scenario, material).vertices
        for step in STEPS
    }
    for step in others:
        away = apart(paths[step], paths[smallest])
        rows.append(Row(f"(f) {name}, MuJoCo at {1e3 * step:g} ms from {1e3 * smallest:g} ms", away, "mm RMS"))
    return paths


def apart(one: FloatArray, other: FloatArray) -> float:
    """Root mean square distance of vertices ``(T, V, 3)`` [mm]."""
    return round(1e3 * float(np.sqrt(np.mean(np.sum((one - other) ** 2, axis=-1)))), 1)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--times", type=int, default=5, help="pairs of every comparison")
    arguments = parser.parse_args()
    rows: list[Row] = []
    began = time.monotonic()
    overhead(rows, 4 * arguments.times)
    against_stock(rows, max(2, arguments.times // 2))
    scaling(rows, arguments.times)
    sizes(rows)
    rendering(rows)
    time_steps(rows)
    report("sim", rows, [SEED], time.monotonic() - began)


if __name__ == "__main__":
    main()
