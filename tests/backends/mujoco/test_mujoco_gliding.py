"""How steps that touch nothing are made, and what a rope's steps must mind."""

import numpy as np
import pytest
from mujoco_scenes import DOWN, opened, scene

from muslin.backends.mujoco.gliding import Gliding, Thrown, TwoStep
from muslin.backends.mujoco.rod import looking_back, stretch_damping
from muslin.core.body import Body, rope_line
from muslin.core.material import RopeMaterial

HELD = np.array([0, 1])


def oscillation(scheme: Gliding, frequency: float, time_step: float, steps: int) -> np.ndarray:
    """``x`` of x'' = - frequency^2 x from 1 at rest, where MuJoCo's implicit Euler knows the force."""
    x, v, path = np.ones(1), np.zeros(1), [1.0]
    for _ in range(steps):
        h = scheme.step
        scheme.begin(x, v)
        v[:] = (v - h * frequency**2 * x) / (1 + (h * frequency) ** 2)
        x += h * v
        scheme.end(x, v)
        path.append(float(x[0]))
        assert scheme.step <= time_step
    return np.array(path)


def largest(path: np.ndarray) -> float:
    return float(np.abs(path[-40:]).max())


def test_two_steps_are_of_second_order() -> None:
    """Over one period; half the step leaves a quarter of the error."""
    errors = []
    for steps in (200, 400):
        path = oscillation(TwoStep(1.0 / steps, 1 / 3, 1), 2 * np.pi, 1.0 / steps, steps)
        errors.append(abs(path - np.cos(2 * np.pi * np.linspace(0, 1, steps + 1))).max())
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.15)


@pytest.mark.parametrize(
    ("scheme", "rate"),
    [
        (Thrown(0.005, 0.0, 1), 0.5 * 0.005 * 12.0**2),
        (Thrown(0.005, 0.9, 1), (1 / 1.9 - 0.5) * 0.005 * 12.0**2),
        (TwoStep(0.005, 1 / 3, 1), 0.005**3 * 12.0**4 / 4),
    ],
    ids=["Euler", "thrown", "two-step"],
)
def test_a_scheme_damps_at_the_rate_that_it_says(scheme: Gliding, rate: float) -> None:
    """Of 12 rad/s at 5 ms over 10 s, to 15 %."""
    path = oscillation(scheme, 12.0, 0.005, 2000)
    assert -np.log(largest(path) / np.abs(path[:60]).max()) / 9.6 == pytest.approx(rate, rel=0.15)


def test_what_is_too_fast_for_two_steps_dies_down() -> None:
    assert largest(oscillation(TwoStep(0.005, 1 / 3, 1), 1e4, 0.005, 60)) < 1e-6


def test_a_force_that_grows_evenly_acts_as_where_the_step_ends() -> None:
    scheme, x = TwoStep(0.005, 1 / 3, 1), np.zeros(1)
    for k in range(4):
        scheme.begin(x, x.copy())
        given = scheme.forces(np.array([float(k)]))
        scheme.end(x, x.copy())
        assert given is not None and given[0] == pytest.approx(k if k == 0 else k + 1)


def test_a_force_of_one_step_is_taken_back_in_the_next() -> None:
    scheme, x, given = TwoStep(0.005, 1 / 3, 1), np.zeros(1), []
    for force in (None, None, np.ones(1), None, None):
        scheme.begin(x, x.copy())
        ahead = scheme.forces(force)
        given.append(None if ahead is None else float(ahead[0]))
        scheme.end(x, x.copy())
    assert given == [None, None, 2.0, -1.0, None]


def test_after_a_contact_nothing_is_carried_on() -> None:
    """A scheme that has forgotten goes on as one that begins there."""
    seasoned, fresh = TwoStep(0.005, 1 / 3, 1), TwoStep(0.005, 1 / 3, 1)
    oscillation(seasoned, 20.0, 0.005, 5)
    seasoned.forget()
    np.testing.assert_array_equal(oscillation(seasoned, 3.0, 0.005, 9), oscillation(fresh, 3.0, 0.005, 9))


def arc(turn: float, segments: int = 24, length: float = 0.5) -> Body:
    """A rope bent to a level arc, with one more segment before it to be clamped by."""
    angle = turn * np.linspace(0.0, 1.0, segments + 1)
    way = length / turn * np.stack([np.sin(angle), 1.0 - np.cos(angle), 0.0 * angle], axis=1)
    return rope_line(np.concatenate([[[-length / segments, 0.0, 0.0]], way]), segments + 2)


def test_straight_ropes_look_back_as_far_as_is_useful() -> None:
    straight = rope_line(np.array([[0.0, 0.0, 0.0], [0.5, 0.0, 0.0]]), 26)
    assert looking_back(straight, RopeMaterial(0.05, 1e4, 1e-4, 1.0, damping_time=1.0), HELD, 0.001) == 1 / 3


def test_the_more_is_bent_resists_torsion_and_is_damped_the_less_ropes_look_back() -> None:
    def back(turn: float, ratio: float, damping_time: float) -> float:
        material = RopeMaterial(0.05, 1e4, 1e-2, 1e-2 * ratio, damping_time=damping_time)
        return looking_back(arc(turn), material, HELD, 0.005)

    assert back(0.5, 0.5, 0.0) == pytest.approx(1 / 3)
    assert back(3.0, 1.0, 0.0) > back(6.0, 1.0, 0.0) > back(6.0, 3.0, 0.0) > back(6.0, 3.0, 0.1) > 0.0


@pytest.mark.parametrize("seed", range(24))
def test_a_stiff_bent_rope_comes_to_rest(seed: int) -> None:
    """It may still swing, but does not shake: 2 s after the start the third differences of its steps are below 5 um.

    Arcs of up to 9 rad, GJ / EI from 0.01 to 100, damped for up to 0.5 s.
    """
    rng = np.random.default_rng(seed)
    body, damping_time = arc(rng.uniform(0.2, 9.0)), float(rng.choice([0.01, 0.05, 0.2, 0.5]))
    material = RopeMaterial(0.002, 1e4, 1e-2, 1e-2 * 10 ** rng.uniform(-2, 2), damping_time=damping_time)
    path = []
    with opened(scene(body, material, held=HELD, gravity=DOWN), time_step=0.005) as world:
        for k in range(420):
            world.step(body.vertices[:2], None)
            if k >= 400:
                path.append(world.state().positions.copy())
    assert np.abs(np.diff(path, 3, axis=0)).max() < 5e-6


@pytest.mark.parametrize("seed", range(12))
def test_a_rope_between_two_clamps_holds_together(seed: int) -> None:
    """1 m, bent and twisted by its clamps, falls for 0.7 s: it stretches by less than 0.3 % at any time.

    EI from 1e-4 to 0.03 N m2, GJ / EI from 0.01 to 100, damped for 0.01 to 1 s, straight at rest.
    """
    rng = np.random.default_rng(seed)
    bending, damping_time = 10 ** rng.uniform(-4.0, -1.5), 10 ** rng.uniform(-2.0, 0.0)
    material = RopeMaterial(0.05, 2000.0, bending, bending * 10 ** rng.uniform(-2.0, 2.0), damping_time=damping_time)
    angle = rng.uniform(1.0, 6.0) * np.linspace(-0.5, 0.5, 40)
    steps = np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1) / 40
    start = np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])
    body, held = rope_line(np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]), 41), np.array([0, 1, 39, 40])
    time_step = float(rng.choice([0.00125, 0.0025, 0.005]))
    lengths = []
    there = scene(body, material, held=held, gravity=DOWN, start=start, start_twist=rng.uniform(-2.0, 2.0))
    with opened(there, time_step=time_step) as world:
        for _ in range(round(0.7 / time_step)):
            world.step(start[held], None)
            lengths.append(np.linalg.norm(np.diff(world.state().positions, axis=0), axis=1).sum())
    assert max(lengths) < 1.003


@pytest.mark.parametrize(("sign", "calmer"), [(-1.0, True), (1.0, False)])
def test_what_goes_to_and_fro_looks_back_less(sign: float, calmer: bool) -> None:
    """Velocities that change by 0.1 m/s a step, to and fro or on and on."""
    scheme, x, v = TwoStep(0.005, 1 / 3, 1), np.zeros(1), np.zeros(1)
    before = 0.0
    for k in range(12):
        scheme.begin(x, v)
        v[:] = before + 0.1 * sign**k
        scheme.end(x, v)
        before = float(v[0])
        if k == 1:
            plain = scheme.step
    assert (scheme.step > plain) == calmer


@pytest.mark.parametrize("damping_time", [0.0, 0.01, 0.2])
def test_a_damped_rope_that_swings_does_not_grow(damping_time: float) -> None:
    """0.5 m that fall from level, 1.5 s at 5 ms: no longer than weight and speed stretch it, and 0.05 %."""
    body = rope_line(np.array([[0.0, 0.0, 0.0], [0.5, 0.0, 0.0]]), 16)
    material, lengths = RopeMaterial(0.05, 2000.0, 1e-3, 1e-3, damping_time=damping_time), []
    with opened(scene(body, material, held=np.array([0]), gravity=DOWN), time_step=0.005) as world:
        for _ in range(300):
            world.step(body.vertices[:1], None)
            lengths.append(np.linalg.norm(np.diff(world.state().positions, axis=0), axis=1).sum())
    assert max(lengths) / 0.5 - 1 < 3 * 0.05 * 0.5 * 9.81 / 2000.0 + 5e-4


def test_stretch_is_damped_as_the_material_only_where_it_shows() -> None:
    body = rope_line(np.array([[0.0, 0.0, 0.0], [0.5, 0.0, 0.0]]), 16)
    masses = np.full(16, 0.025 / 16)
    soft, stiff = RopeMaterial(0.05, 2.0, damping_time=0.3), RopeMaterial(0.05, 2000.0, damping_time=0.3)
    one, both = np.array([0]), np.array([0, 15])
    assert stretch_damping(body, soft, masses, one) == 0.3
    tenth = 0.1 * 2 / (np.pi / 2 * np.sqrt(2000.0 / (0.5 * 0.025)))  # of what is critical
    assert stretch_damping(body, stiff, masses, one) == pytest.approx(tenth)
    assert stretch_damping(body, stiff, masses, both) == pytest.approx(tenth / 2, rel=0.1)
    assert stretch_damping(body, RopeMaterial(0.05, 2000.0, damping_time=1e-4), masses, one) == 1e-4
