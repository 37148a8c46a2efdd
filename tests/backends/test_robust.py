"""Thousands of rollouts in one process do not grow, and no draw of a very wide prior crashes, hangs or lies."""

import os
import time
from pathlib import Path

import numpy as np
import pytest
from engine_runs import ENGINES, scenario, simulator, turned

from muslin.core.body import Body, cloth_grid, rope_line, solid_box
from muslin.core.errors import RolloutFailed
from muslin.core.material import MATERIALS, Material, with_fields
from muslin.core.motion import Motion
from muslin.core.obstacles import Cylinder, Obstacle, Table
from muslin.core.rollout import rollout
from muslin.core.sanity import LARGEST_STRETCH
from muslin.core.simulator import Simulator

BODIES = {
    "cloth": (cloth_grid(0.2, 0.2, 6, 6), np.array([0, 5])),
    "rope": (rope_line(np.array([[0.0, 0.0, 0.0], [0.3, 0.0, 0.0]]), 12), np.array([0])),
    "solid": (solid_box(np.zeros(3), np.array([0.06, 0.1, 0.06]), (3, 5, 3)), np.arange(9)),
}
#: Far wider than any study's: from cobweb to sheet metal.
WIDE: dict[str, dict[str, tuple[float, float]]] = {
    "cloth": {
        "areal_density": (0.01, 3.0),
        "stretch_stiffness": (0.3, 1e6),
        "bending_rigidity": (1e-9, 1.0),
        "damping_time": (1e-6, 0.1),
        "friction": (1e-3, 3.0),
    },
    "rope": {
        "linear_density": (1e-3, 1.0),
        "stretch_stiffness": (1.0, 1e6),
        "bending_rigidity": (1e-9, 1.0),
        "twist_rigidity": (1e-9, 1.0),
        "diameter": (1e-3, 0.03),
        "damping_time": (1e-6, 0.1),
        "friction": (1e-3, 3.0),
    },
    "solid": {
        "density": (10.0, 1e4),
        "youngs_modulus": (1e2, 1e9),
        "poisson_ratio": (0.01, 0.49),
        "damping_time": (1e-6, 0.1),
        "friction": (1e-3, 3.0),
    },
}
DRAWS = 10
TIME_LIMIT = 1.0


def resident() -> float:
    """Memory of this process [MB]."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="memory is read from /proc")
@pytest.mark.parametrize("engine", ENGINES)
def test_many_rollouts_in_one_process_take_no_more_memory_than_few(engine: str) -> None:
    """Of a small cloth that touches a table: after the first 100, less than 2.5 MB in 500 more, which is 5 kB each."""
    body = cloth_grid(0.1, 0.1, 3, 3)
    task = scenario(body, turned(0.0), [0.0, 0.02], ([0, 2],), obstacles=(Table(0.8995),))
    made = simulator(engine)
    memory = []
    for k in range(600):
        rollout(made, task, MATERIALS["cloth"]())
        if k % 100 == 99:
            memory.append(resident())
    assert memory[-1] - memory[0] < 2.5, memory


def wide_draw(kind: str, rng: np.random.Generator) -> Material:
    """Log-uniform over :data:`WIDE`."""
    ranges = WIDE[kind]
    return with_fields(
        MATERIALS[kind](), {name: float(np.exp(rng.uniform(*np.log(bounds)))) for name, bounds in ranges.items()}
    )


def jerky(rng: np.random.Generator) -> Motion:
    """Half a second of sharp turns at up to some 5 m/s, down to the table and through the cylinder."""
    knots = np.concatenate([[[0.0, 0.0, 0.3]], rng.uniform([-0.3, -0.3, 0.0], [0.3, 0.3, 0.6], (5, 3))])
    return Motion.from_positions(np.linspace(0.0, 0.5, 6), knots[:, None])


def obstacles(simulated: Simulator) -> tuple[Obstacle, ...]:
    rod = Cylinder(np.array([0.0, 0.1, 0.15]), np.array([1.0, 0.0, 0.0]), 0.03, 0.5)
    return (Table(0.0), rod) if "cylinder" in simulated.capabilities else (Table(0.0),)


@pytest.mark.slow
@pytest.mark.parametrize("kind", BODIES)
@pytest.mark.parametrize("engine", ENGINES)
def test_every_draw_of_a_very_wide_prior_is_a_trajectory_or_a_failure_with_its_reason(engine: str, kind: str) -> None:
    made = simulator(engine)
    if kind not in made.object_kinds:
        pytest.skip(f"{engine} has no {kind}")
    body: Body
    body, grasp = BODIES[kind]
    rng = np.random.default_rng([5, len(kind)])
    rest = body.edge_lengths(body.vertices)
    whole = 0
    for _ in range(DRAWS):
        material, motion = wide_draw(kind, rng), jerky(rng)
        task = scenario(body, motion, np.linspace(0.0, 0.5, 11), (grasp,), obstacles=obstacles(made))
        began = time.monotonic()
        try:
            vertices = rollout(made, task, material, time_limit=TIME_LIMIT).vertices
        except RolloutFailed as failure:
            assert len(str(failure)) > 10
        else:
            whole += 1
            assert np.isfinite(vertices).all()
            assert (body.edge_lengths(vertices) / rest).max() < 2 * LARGEST_STRETCH  # looked at now and then
        assert time.monotonic() - began < TIME_LIMIT + 3.0  # it ends with the step in which it passes the limit
    assert whole > 0
