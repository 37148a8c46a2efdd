"""The same numbers in SI units mean the same on both engines: how far apart they are at steps of 5 ms."""

from dataclasses import replace

import numpy as np
import pytest
from engine_runs import ENGINES, simulator

from muslin.core.arrays import FloatArray
from muslin.core.material import with_fields
from muslin.core.rollout import rollout
from muslin.core.scenarios import preset

#: Scenario, size, vertices, how long [s], material so soft that its stiffness shows, and the root mean square
#: distance over all vertices and frames that the engines may be apart [m].
CASES = {
    "hang-cloth": ("hang", (0.3, 0.3), (5, 5), 1.0, {"stretch_stiffness": 20.0}, 1e-3),
    "hang-rope": ("hang", (0.5,), (13,), 1.0, {"stretch_stiffness": 10.0, "damping_time": 0.01}, 1e-3),
    "lift-cloth": ("lift", (0.3, 0.3), (5, 5), 1.0, {"stretch_stiffness": 20.0}, 1e-3),
    "lift-rope": ("lift", (0.5,), (13,), 1.0, {"stretch_stiffness": 10.0, "damping_time": 0.01}, 1e-3),
    "cable": ("cable", (1.0,), (21,), 1.0, {}, 2e-3),
    "winding": ("winding", (1.0,), (31,), 0.5, {}, 8e-3),
}


def path(case: str, engine: str, **fields: float) -> FloatArray:
    name, size, counts, duration, soft, _ = CASES[case]
    base = preset(name)
    task = base.scenario(size, counts)
    task = replace(task, times=task.times[task.times <= duration])
    material = with_fields(base.default_material(task.body.kind), {**soft, **fields})
    return rollout(simulator(engine, time_step=0.005), task, material).vertices


def apart(one: FloatArray, other: FloatArray) -> float:
    """Root mean square distance [m]."""
    return float(np.sqrt(((one - other) ** 2).sum(axis=2).mean()))


@pytest.mark.parametrize("case", CASES)
def test_both_engines_agree(case: str) -> None:
    one, other = (path(case, engine) for engine in ENGINES)
    assert apart(one, other) < CASES[case][-1]


@pytest.mark.parametrize("case", [c for c in CASES if "-" in c])
def test_half_the_stiffness_on_one_of_them_would_show(case: str) -> None:
    """By three times as much as they may differ."""
    one, other = (
        path(case, "pybullet"),
        path(case, "mujoco", stretch_stiffness=0.5 * CASES[case][4]["stretch_stiffness"]),
    )
    assert apart(one, other) > 3 * CASES[case][-1]
