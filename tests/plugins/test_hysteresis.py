"""Friction of bending against Coulomb's closed forms."""

import numpy as np
import pytest
from effect_objects import G, engine

from muslin.core.body import Body, cloth_grid, rope_line
from muslin.core.material import ClothMaterial, RopeMaterial
from muslin.core.scene import Scene
from muslin.core.simulator import State
from muslin.core.testing.reference import ReferenceSimulator
from muslin.plugins.effects.hinges import bending_of
from muslin.plugins.effects.hysteresis import SLIP_CURVATURE, BendingHysteresis, RopeHysteresis

FRICTION = 3e-4
FLAP = Body(
    "cloth",
    np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.1, -0.1, 0.0]]),
    np.array([[0, 1, 2], [1, 0, 3]]),
)
LINE = rope_line(np.array([[0.0, 0.0, 0.0], [0.2, 0.0, 0.0]]), 3)
SHEET = cloth_grid(0.2, 0.1, 7, 5)


def scene_of(body, **more):
    material = RopeMaterial() if body.kind == "rope" else ClothMaterial()
    given = {"grasps": (), **more}
    return Scene(body, material, np.zeros(3), loads=np.zeros(len(body.vertices)), **given)


def effect_on(body, moment=FRICTION):
    return RopeHysteresis(friction_moment=moment) if body.kind == "rope" else BendingHysteresis(friction_moment=moment)


def folded(body, angle):
    """The flap about its hinge, the line at its middle, by ``angle`` [rad]."""
    out = body.vertices.copy()
    last = out[-1] - (body.vertices[1] if body.kind == "rope" else [0.1, 0.0, 0.0])
    turn = np.array([0.1 * np.cos(angle), 0.1 * np.sin(angle), 0.0]) if body.kind == "rope" else None
    if turn is None:
        turn = np.array([0.0, last[1] * np.cos(angle), last[1] * np.sin(angle)])
    out[-1] = turn + (out[1] if body.kind == "rope" else [0.1, 0.0, 0.0])
    return out


def path_work(force, path):
    """Work of a force along positions ``(T, V, 3)`` passed slowly, by the trapezoid rule; time runs by 5 ms."""
    at_rest = np.zeros_like(path[0])
    forces = np.array([force(0.005 * k, State(x, at_rest)) for k, x in enumerate(path)])
    return 0.5 * np.sum((forces[1:] + forces[:-1]) * np.diff(path, axis=0), axis=(1, 2))


@pytest.mark.parametrize("body", [pytest.param(FLAP, id="cloth"), pytest.param(LINE, id="rope")])
def test_a_cycle_takes_four_times_friction_times_sliding(body):
    """4 M_f (K - K_s) per measure: for masses so large that the spring need not be softened."""
    most, steps = 1.2, 500
    angles = np.concatenate([np.linspace(0, most, steps), np.linspace(most, -most, 2 * steps)[1:]])
    angles = np.concatenate([angles, np.linspace(-most, most, 2 * steps)[1:]])
    force = effect_on(body).bind(scene_of(body), np.full(len(body.vertices), 1e3))
    work = path_work(force, np.array([folded(body, a) for a in angles]))
    bending = bending_of(body)
    bending.follow(folded(body, most))
    sliding = np.sum(bending.measures * (np.linalg.norm(bending.curvature, axis=1) - SLIP_CURVATURE))
    assert -work[-4 * steps + 2 :].sum() == pytest.approx(4 * FRICTION * sliding, rel=2e-3)
    whole = np.sum(bending.measures * np.linalg.norm(bending.curvature, axis=1))
    assert whole == pytest.approx(most * (1.0 if body.kind == "rope" else 0.1), rel=1e-9)


def test_the_moment_across_a_rolled_sheet_is_the_friction_moment():
    """Per length of the hinge lines of a sheet that is being rolled up."""
    force = effect_on(SHEET).bind(scene_of(SHEET), np.full(35, 1e3))
    z = SHEET.vertices[:, 2]
    for k, curvature in enumerate(np.linspace(0, 12, 100)):
        rolled = SHEET.vertices.copy()
        rolled[:, 1], rolled[:, 2] = (1 - np.cos(z * curvature)) / max(curvature, 1e-9), z
        if curvature:
            rolled[:, 2] = np.sin(z * curvature) / curvature
        got = force(0.005 * k, State(rolled, np.zeros_like(rolled)))
    below = np.arange(21, 35)  # about the line of the row above them, which is clear of the free edges
    torque = np.cross(rolled[below] - rolled[14], got[below]).sum(axis=0)
    assert abs(torque[0]) == pytest.approx(FRICTION * 0.2, rel=1e-6)


@pytest.mark.parametrize("body", [SHEET, LINE], ids=["cloth", "rope"])
def test_is_proportional_to_the_friction_moment_and_adds_up(body):
    masses, rng = np.full(len(body.vertices), 1e3), np.random.default_rng(0)
    forces = [effect_on(body, m).bind(scene_of(body), masses) for m in (1e-4, 3e-4, 4e-4)]
    for k in range(20):
        state = State(body.vertices + 0.01 * rng.normal(size=body.vertices.shape), rng.normal(size=body.vertices.shape))
        one, three, four = (f(0.005 * k, state) for f in forces)
        np.testing.assert_allclose(one + three, four, atol=1e-12 * (1 + np.abs(four).max()))


def test_a_pendulum_loses_the_same_at_every_swing():
    """m g l (cos A' - cos A) = M_f (A + A' - 2 theta_s) between turning points A, A': Coulomb, not viscous.

    A rigid segment that hangs on a held one, stepped here, so that nothing but the friction takes energy.
    """
    length, friction, mass, step = 0.02, 2e-5, 0.01, 0.0005
    body = rope_line(np.array([[0.0, 0.0, 0.0], [0.0, 0.0, -2 * length]]), 3)
    force = effect_on(body, friction).bind(scene_of(body, grasps=(np.array([0, 1]),)), np.full(3, mass))
    angle, speed, swing = 1.2, 0.0, [1.2]
    x, v = body.vertices.copy(), np.zeros((3, 3))
    for k in range(2400):
        along, across = (np.array(d) for d in ((np.sin(angle), 0, -np.cos(angle)), (np.cos(angle), 0, np.sin(angle))))
        x[2], v[2] = x[1] + length * along, length * speed * across
        if k == 0:  # bent to here before: the friction has settled at its limit
            for part in np.linspace(0, 1.2, 100):
                x[2] = x[1] + length * np.array([np.sin(part), 0, -np.cos(part)])
                force(step * (k + part - 2), State(x, 0 * v))
        pull = force(step * k, State(x, v))[2] @ across - mass * G * np.sin(angle)
        speed += step * pull / (mass * length)
        angle += step * speed
        swing.append(angle)
    swing = np.array(swing)
    turns = np.flatnonzero(np.diff(swing[:-1]) * np.diff(swing[1:]) < 0) + 1
    first, second = np.abs(swing[np.r_[0, turns[:-1]]]), np.abs(swing[turns])
    moving = second > 0.25
    assert moving.sum() >= 5
    lost = mass * G * length * (np.cos(second) - np.cos(first))[moving]
    np.testing.assert_allclose(lost, friction * (first + second - 2 * SLIP_CURVATURE * length)[moving], rtol=0.02)


@pytest.mark.parametrize("name", ["reference", "mujoco", "pybullet"])
@pytest.mark.parametrize("kind", ["cloth", "rope"])
def test_never_creates_energy(name, kind):
    """All work done on a flung object since the start is negative at every step, from weak to strong friction."""
    body = cloth_grid(0.2, 0.2, 6, 6) if kind == "cloth" else rope_line(np.array([[0, 0, 0], [0.3, 0, 0.1]]), 10)
    material = ClothMaterial(stretch_stiffness=100.0) if kind == "cloth" else RopeMaterial(stretch_stiffness=100.0)
    held = np.array([0, 5]) if kind == "cloth" else np.array([0])
    scene = Scene(body, material, np.array([0.0, 0.0, -G]), (held,), np.zeros(len(body.vertices)))
    simulator = ReferenceSimulator() if name == "reference" else engine(name)
    for strength in (1e-6, 3e-5, 1e-3):
        world = simulator.open(scene)
        force = effect_on(body, strength).bind(scene, world.masses)
        done, lowest = 0.0, 0.0
        try:
            for k in range(120):
                before = world.state().positions.copy()
                pull = force(0.005 * k, world.state())
                sway = [0.0, 0.08 * np.sin(0.05 * (k + 1)) ** 2, 0.0]
                world.step(body.vertices[held] + sway, pull)
                work = pull * (world.state().positions - before)
                done += float(work.sum())
                lowest = min(lowest, done)
                assert done <= 1e-3 * -lowest + 1e-15
        finally:
            world.close()
        assert lowest < 0
