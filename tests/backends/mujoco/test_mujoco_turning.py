"""What turning costs a rope: nothing that its steps resolve."""

import numpy as np
import pytest

pytest.importorskip("mujoco")

from mujoco_scenes import DOWN, NONE_HELD, NOWHERE, opened, scene

from muslin.backends.mujoco.turning import Turning
from muslin.core.body import rope_line
from muslin.core.material import RopeMaterial

NO_GRAVITY = np.zeros(3)
STIFF = RopeMaterial(0.05, 5000.0, 1e-6, 1e-6)


def line(segments: int, length: float = 0.4):
    return rope_line(np.array([[0.0, 0.0, 0.0], [length, 0.0, 0.0]]), segments + 1)


def spun(segments: int, time_step: float, rate: float = 20.0) -> tuple[float, float]:
    """A stick of 0.4 m that spins freely for a second: shares that are left of its energy, and of its length."""
    body = line(segments)
    start = np.zeros((segments + 1, 3))
    start[:, 1] = rate * (body.vertices[:, 0] - 0.2)
    there = scene(body, STIFF, gravity=NO_GRAVITY, held=NONE_HELD, start_velocities=start)
    with opened(there, time_step=time_step) as world:
        energy = (world.masses[:, None] * world.state().velocities ** 2).sum()
        for _ in range(round(1.0 / time_step)):
            world.step(NOWHERE, None)
        ends = np.diff(world.state().positions, axis=0)
        left = (world.masses[:, None] * world.state().velocities ** 2).sum()
    return float(left / energy), float(np.linalg.norm(ends, axis=1).max()) * segments / 0.4


@pytest.mark.parametrize("segments", [1, 10])
def test_what_spins_freely_keeps_its_energy(segments: int) -> None:
    """20 rad/s at 1.25 ms, to 1 %, and half the step leaves a fifth of the loss; as long as its masses pull it."""
    (left, length), (finer, _) = (spun(segments, h) for h in (0.00125, 0.000625))
    assert 0.99 < left <= 1.0 and 1.0 - finer < 0.2 * (1.0 - left)
    pull = 0.05 * 20.0**2 * 0.2**2 / 2  # in the middle, and at most twice as much where masses are few
    assert 1.0 < length < 1.0 + 2.1 * pull / STIFF.stretch_stiffness


@pytest.mark.parametrize("stiffness", [200.0, 5000.0])
def test_a_shaken_rope_is_near_where_small_steps_lead(stiffness: float) -> None:
    """0.8 m, its end shaken by 0.1 m at 1 Hz for 1.5 s: steps of 2.5 and 1.25 ms to 6 and 1 mm."""
    body = line(40, 0.8)
    material = RopeMaterial(0.05, stiffness, 7e-4, 7e-4, damping_time=0.01)
    hanging = np.stack([0.0 * body.vertices[:, 0], 0.0 * body.vertices[:, 0], -body.vertices[:, 0]], axis=1)
    ends = []
    for time_step in (0.0025, 0.00125, 0.0003125):
        path, every = [], round(0.05 / time_step)
        there = scene(body, material, gravity=DOWN, held=np.array([0, 1]), start=hanging)
        with opened(there, time_step=time_step) as world:
            for k in range(1, round(1.5 / time_step) + 1):
                aside = np.array([0.0, 0.1 * np.sin(2.0 * np.pi * k * time_step), 0.0])
                world.step(hanging[:2] + aside, None)
                if k % every == 0:
                    path.append(world.state().positions.copy())
        ends.append(np.array(path))
    coarse, fine = (1e3 * float(np.sqrt(np.mean((p - ends[-1]) ** 2))) for p in ends[:2])
    assert coarse < 6.0 and fine < 1.0


def test_what_does_not_turn_is_let_be() -> None:
    """Moved, stretched, or turning to and fro."""
    rest, forms = line(4).vertices, np.ones((4, 21))
    lengths = np.array([9.0, 0.1, 0.1, 0.1, 0.1])
    turned = rest @ np.array([[0.9, 0.1, 0.0], [-0.1, 0.9, 0.0], [0.0, 0.0, 1.0]])
    for places in ([rest + k for k in range(4)], [rest * (1 + 1e-3 * k) for k in range(4)], [rest, turned] * 2):
        turning = Turning(rest, forms, lengths, np.arange(1, 5))
        forces = [turning.force((p - rest).ravel(), 1 / 3, 0.5) for p in places]
        assert forces[0] is None
        for force in forces[1:] if places[1] is not turned else forces[2:]:
            np.testing.assert_allclose(force, 0.0, atol=1e-12)
        turning.forget()
        np.testing.assert_array_equal(lengths, [9.0, 0.1, 0.1, 0.1, 0.1])


def test_pulls_balance_and_what_is_not_resolved_is_left_alone() -> None:
    rest, forms, lengths = line(4).vertices, np.full((4, 21), 100.0), np.full(4, 0.1)
    pulls = []
    for angle in (0.01, 0.05, 1.2):
        turning = Turning(rest, forms, lengths, np.arange(4))
        for k in range(3):
            c, s = np.cos(k * angle), np.sin(k * angle)
            force = turning.force((rest @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) - rest).ravel(), 1 / 3, 0.0)
        assert force is not None
        np.testing.assert_allclose(force.reshape(-1, 3).sum(axis=0), 0.0, atol=1e-12)
        pulls.append(float(np.linalg.norm(force.reshape(-1, 3)[-1])))
        assert (lengths > 0.1).all()
        turning.forget()
    assert pulls[0] == pytest.approx(100.0 * 0.1**3 * 8 / 9 * 0.01**2, rel=0.01)
    assert pulls[1] == pytest.approx(25 * pulls[0], rel=0.01)
    assert pulls[2] < 0.05 * 100.0 * 0.1**3 * 8 / 9 * np.sin(1.2) ** 2


@pytest.mark.parametrize("seed", range(8))
def test_ropes_shaken_hard_hold_together(seed: int) -> None:
    """At 5 ms, 0.2 m to and fro at 1 to 3 Hz for a second, by one end or both: stretched by less than a tenth."""
    rng = np.random.default_rng(seed)
    length, segments = rng.uniform(0.4, 1.2), int(rng.integers(10, 40))
    body, held = line(segments, length), np.array([[0], [0, 1], [0, segments]][seed % 3][: 1 + (seed % 3 > 0)])
    rigidity = 10 ** rng.uniform(-4.0, -2.5)
    material = RopeMaterial(0.05, 10 ** rng.uniform(3.0, 4.5), rigidity, rigidity, damping_time=rng.choice([0.0, 0.02]))
    frequency, longest = rng.uniform(1.0, 3.0), 0.0
    with opened(scene(body, material, gravity=DOWN, held=held), time_step=0.005) as world:
        for k in range(200):
            there = body.vertices[held].copy()
            there[:, 1] += 0.1 * (1.0 - np.cos(2.0 * np.pi * frequency * 0.005 * k))
            world.step(there, None)
            longest = max(longest, float(np.linalg.norm(np.diff(world.state().positions, axis=0), axis=1).max()))
    assert longest < 1.1 * length / segments
