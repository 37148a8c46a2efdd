"""What turning costs a rope: nothing that its steps resolve."""

import numpy as np
import pytest

pytest.importorskip("mujoco")

from mujoco_scenes import DOWN, NONE_HELD, NOWHERE, opened, scene

from muslin.backends.mujoco.turning import MOST_STRAIN, Turning
from muslin.core.body import rope_line
from muslin.core.material import RopeMaterial
from muslin.core.obstacles import Table

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


def test_nothing_else_makes_up_for_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without it less than half of the energy is left."""
    monkeypatch.setattr(Turning, "force", lambda *_: None)
    assert spun(1, 0.00125)[0] < 0.5


def test_steps_in_contact_have_the_lengths_at_rest() -> None:
    """A rope that spins falls on a table: what was changed for steps before is taken back."""
    body = line(10)
    start = np.zeros((11, 3))
    start[:, 1] = 20.0 * (body.vertices[:, 0] - 0.2)
    there = scene(body, STIFF, gravity=DOWN, held=NONE_HELD, start_velocities=start, obstacles=(Table(-0.05),))
    with opened(there, time_step=0.00125) as world:
        model, lengths = world._model, []
        plain = np.array(model.flexedge_length0)
        for _ in range(160):
            world.step(NOWHERE, None)
            lengths.append((world._touching, bool((model.flexedge_length0 == plain).all())))
    assert not any(same for touching, same in lengths[2:40]) and not any(touching for touching, _ in lengths[:40])
    assert any(touching for touching, _ in lengths) and all(same for touching, same in lengths if touching)


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


def pull(angle: float, factor: float = 1.0, damped: float = 0.0) -> float:
    """Force on the end of a rope that turns by ``angle`` a step, ``factor`` times as long as at rest [N]."""
    rest, lengths = line(4).vertices, np.full(4, 0.1)
    turning, force = Turning(rest, np.full((4, 21), 100.0), lengths, np.arange(4)), None
    for k in range(3):
        c, s = factor * np.cos(k * angle), factor * np.sin(k * angle)
        force = turning.force((rest @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) - rest).ravel(), 1 / 3, damped)
    assert force is not None and (lengths > 0.1).all()
    np.testing.assert_allclose(force.reshape(-1, 3).sum(axis=0), 0.0, atol=1e-12)
    return float(np.linalg.norm(force.reshape(-1, 3)[-1]))


def test_a_pull_goes_with_the_square_of_the_angle_and_with_damping() -> None:
    assert pull(0.01) == pytest.approx(100.0 * 0.1**3 * 8 / 9 * 0.01**2, rel=0.01)
    assert pull(0.05) == pytest.approx(25 * pull(0.01), rel=0.01)
    assert pull(0.01, damped=0.7) == pytest.approx(1.7 * pull(0.01))


def test_what_is_not_resolved_is_left_alone() -> None:
    assert pull(1.2) < 0.05 * 100.0 * 0.1**3 * 8 / 9 * np.sin(1.2) ** 2
    for factor in (1.005, 1.05):
        share = 1.0 / (1.0 + ((factor**2 - 1.0) / 2.0 / MOST_STRAIN) ** 2)
        assert pull(0.05, factor) == pytest.approx(share * factor**3 * pull(0.05), rel=0.01)


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
