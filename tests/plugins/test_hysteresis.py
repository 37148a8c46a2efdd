"""Friction of bending against Coulomb's closed forms."""

import numpy as np
import pytest
from effect_objects import G, engine

from muslin.core.bending import SheetBending
from muslin.core.body import Body, cloth_grid
from muslin.core.material import ClothMaterial
from muslin.core.scene import Scene
from muslin.core.simulator import State
from muslin.core.testing.reference import ReferenceSimulator
from muslin.plugins.effects.hysteresis import SLIP_CURVATURE, BendingHysteresis

FRICTION = 3e-4
FLAP = Body(
    "cloth",
    np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.1, -0.1, 0.0]]),
    np.array([[0, 1, 2], [1, 0, 3]]),
)
SHEET = cloth_grid(0.2, 0.1, 7, 5)


def scene_of(body, **more):
    given = {"grasps": (), **more}
    return Scene(body, ClothMaterial(), np.zeros(3), loads=np.zeros(len(body.vertices)), **given)


def folded(angle):
    """The flap, folded about its hinge by ``angle`` [rad]."""
    out = FLAP.vertices.copy()
    across = out[-1, 1]
    out[-1] = [0.1, across * np.cos(angle), across * np.sin(angle)]
    return out


def effect(moment=FRICTION):
    return BendingHysteresis(friction_moment=moment)


def path_work(force, path):
    """Work of a force along positions ``(T, V, 3)`` passed slowly, by the trapezoid rule; time runs by 5 ms."""
    at_rest = np.zeros_like(path[0])
    forces = np.array([force(0.005 * k, State(x, at_rest)) for k, x in enumerate(path)])
    return 0.5 * np.sum((forces[1:] + forces[:-1]) * np.diff(path, axis=0), axis=(1, 2))


def test_a_cycle_takes_four_times_friction_times_sliding():
    """4 M_f (K - K_s) per measure: for masses so large that the spring need not be softened."""
    most, steps = 1.2, 500
    angles = np.concatenate([np.linspace(0, most, steps), np.linspace(most, -most, 2 * steps)[1:]])
    angles = np.concatenate([angles, np.linspace(-most, most, 2 * steps)[1:]])
    force = effect().bind(scene_of(FLAP), np.full(4, 1e3))
    work = path_work(force, np.array([folded(a) for a in angles]))
    bending = SheetBending(FLAP)
    bending.follow(folded(most))
    sliding = np.sum(bending.measures * (np.linalg.norm(bending.curvature, axis=1) - SLIP_CURVATURE))
    assert -work[-4 * steps + 2 :].sum() == pytest.approx(4 * FRICTION * sliding, rel=2e-3)
    whole = np.sum(bending.measures * np.linalg.norm(bending.curvature, axis=1))
    assert whole == pytest.approx(most * 0.1, rel=1e-9)


def test_the_moment_across_a_rolled_sheet_is_the_friction_moment():
    """Per length of the hinge lines of a sheet that is being rolled up."""
    force = effect().bind(scene_of(SHEET), np.full(35, 1e3))
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


def test_is_proportional_to_the_friction_moment_and_adds_up():
    masses, rng = np.full(35, 1e3), np.random.default_rng(0)
    forces = [effect(m).bind(scene_of(SHEET), masses) for m in (1e-4, 3e-4, 4e-4)]
    for k in range(20):
        state = State(SHEET.vertices + 0.01 * rng.normal(size=(35, 3)), rng.normal(size=(35, 3)))
        one, three, four = (f(0.005 * k, state) for f in forces)
        np.testing.assert_allclose(one + three, four, atol=1e-12 * (1 + np.abs(four).max()))


@pytest.mark.parametrize("name", ["reference", "mujoco", "pybullet"])
def test_never_creates_energy(name):
    """All work done on a flung object since the start is negative at every step, from weak to strong friction."""
    body, held = cloth_grid(0.2, 0.2, 6, 6), np.array([0, 5])
    material = ClothMaterial(stretch_stiffness=100.0)
    scene = Scene(body, material, np.array([0.0, 0.0, -G]), (held,), np.zeros(36))
    simulator = ReferenceSimulator() if name == "reference" else engine(name)
    for strength in (1e-6, 3e-5, 1e-3):
        world = simulator.open(scene)
        force = effect(strength).bind(scene, world.masses)
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
