"""Plastic bending against the closed forms of perfect plasticity."""

from dataclasses import replace

import numpy as np
import pytest
from effect_objects import engine

from muslin.core.bending import bending_of
from muslin.core.body import Body, cloth_grid, rope_line
from muslin.core.material import ClothMaterial, RopeMaterial
from muslin.core.scene import Scene
from muslin.core.simulator import State
from muslin.plugins.effects.crease import Crease

RADIUS = 0.1
FLAP = Body(
    "cloth",
    np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.1, -0.1, 0.0]]),
    np.array([[0, 1, 2], [1, 0, 3]]),
)
LINE = rope_line(np.array([[0.0, 0.0, 0.0], [0.16, 0.0, 0.0]]), 3)
BODIES = [pytest.param(FLAP, id="cloth"), pytest.param(LINE, id="rope")]


def scene_of(body, **more):
    material = RopeMaterial() if body.kind == "rope" else ClothMaterial()
    return Scene(body, material, np.zeros(3), (), np.zeros(len(body.vertices)), **more)


def folded(body, angle):
    """The flap about its hinge, the line at its middle, by ``angle`` [rad]."""
    out = body.vertices.copy()
    arm, at = (0.08, out[1]) if body.kind == "rope" else (0.1, out[1])
    side = [np.cos(angle), np.sin(angle), 0.0] if body.kind == "rope" else [0.0, -np.cos(angle), np.sin(angle)]
    out[-1] = at + arm * np.array(side)
    return out


def curvature(body, angle):
    bending = bending_of(body)
    bending.follow(folded(body, angle))
    return bending, np.linalg.norm(bending.curvature, axis=1)


def passed(body, angles, effect):
    """Forces ``(T, V, 3)`` along a path and the work of each piece of it."""
    force = effect.bind(scene_of(body), np.ones(len(body.vertices)))
    path = np.array([folded(body, a) for a in angles])
    forces = np.array([force(0.005 * k, State(x, 0 * x)) for k, x in enumerate(path)])
    return forces, 0.5 * np.sum((forces[1:] + forces[:-1]) * np.diff(path, axis=0), axis=(1, 2))


@pytest.mark.parametrize("body", BODIES)
def test_gentle_bends_leave_nothing(body):
    steepest = max(a for a in np.linspace(0, 3, 500) if curvature(body, a)[1].max() < 1 / RADIUS)
    forces, _ = passed(body, [0.0, 0.5 * steepest, steepest, -steepest, 0.0], Crease(yield_radius=RADIUS))
    np.testing.assert_array_equal(forces, 0.0)
    forces, _ = passed(body, [0.0, 1.1 * steepest, 0.0], Crease(yield_radius=RADIUS))
    assert np.abs(forces[-1]).max() > 0


@pytest.mark.parametrize("body", BODIES)
def test_a_fold_and_back_takes_what_plasticity_takes(body):
    """B (y (K - y) + (K - y)^2 / 2) per measure, y = 1 / R: bent to K and pressed flat again, below reverse yield."""
    top = 1.5
    angles = np.concatenate([np.linspace(0, top, 1500), np.linspace(top, 0, 1500)[1:]])
    _, work = passed(body, angles, Crease(yield_radius=RADIUS))
    bending, most = curvature(body, top)
    beyond = np.maximum(most - 1 / RADIUS, 0.0)
    assert beyond.max() < 1 / RADIUS
    assert beyond.max() > 0
    rigidity = scene_of(body).material.bending_rigidity
    expected = rigidity * np.sum(bending.measures * (beyond / RADIUS + 0.5 * beyond**2))
    assert -work.sum() == pytest.approx(expected, rel=2e-3)


@pytest.mark.parametrize("body", BODIES)
def test_no_cycle_creates_energy(body):
    """The plastic dissipation of whole cycles through flat, to and fro, grows."""
    angles = 2.0 * np.sin(np.linspace(0, 8 * np.pi, 1601)) * np.linspace(0.2, 1, 1601)
    _, work = passed(body, angles, Crease(yield_radius=RADIUS))
    through_flat = np.cumsum(work)[199::200]
    assert through_flat[0] <= 1e-15
    assert (np.diff(through_flat) <= 1e-15).all()
    assert through_flat[-1] < -1e-7


@pytest.mark.parametrize("body", BODIES)
def test_a_start_that_is_bent_too_sharply_has_yielded(body):
    """Held in a fold, the elastic part of the curvature is that of the yield radius at most."""
    scene = scene_of(body, start=folded(body, 2.0))
    force = Crease(yield_radius=RADIUS).bind(scene, np.ones(len(body.vertices)))
    got = force(0.0, State(scene.start, 0 * scene.start))
    bending, size = curvature(body, 2.0)
    beyond = bending.curvature * np.maximum(1 - 1 / RADIUS / size, 0.0)[:, None]
    np.testing.assert_allclose(got, bending.forces(-scene.material.bending_rigidity * beyond), rtol=1e-12)


def test_a_woven_cloth_keeps_the_moment_of_its_own_direction():
    """A crease across the warp holds D / sqrt(r), one across the weft D sqrt(r)."""
    sheet = cloth_grid(0.2, 0.2, 6, 6)
    material = ClothMaterial(weft_bending_ratio=4.0)
    for axis, factor in ((2, 0.5), (0, 2.0)):
        rolled = sheet.vertices.copy()
        rolled[:, 1], rolled[:, axis] = (
            0.03 * (1 - np.cos(rolled[:, axis] / 0.03)),
            0.03 * np.sin(rolled[:, axis] / 0.03),
        )
        forces = []
        for made in (material, ClothMaterial()):
            scene = replace(scene_of(sheet), material=made)
            forces.append(Crease(yield_radius=RADIUS).bind(scene, np.ones(36))(0.0, State(rolled, 0 * rolled)))
        np.testing.assert_allclose(forces[0], factor * forces[1], atol=1e-12)


@pytest.mark.parametrize("name", ["mujoco", "pybullet"])
@pytest.mark.parametrize("kind", ["cloth", "rope"])
def test_an_engine_comes_to_rest_at_the_plastic_curvature(name, kind):
    """Once bent to the curvature K, then let go as a gentler arc: it ends at K - 1 / R, without the effect straight."""
    simulator = engine(name)
    if "start-shape" not in simulator.capabilities or kind not in simulator.object_kinds:
        pytest.skip(f"{name} cannot start a {kind} from a bent shape")
    curved, count = 20.0, 13
    along = np.linspace(-0.08, 0.08, count)
    if kind == "rope":
        body = rope_line(np.array([[-0.08, 0.0, 0.0], [0.08, 0.0, 0.0]]), count)
        material = RopeMaterial(bending_rigidity=2e-5, stretch_stiffness=20.0)
    else:
        flat = cloth_grid(0.16, 0.04, count, 3)
        body = replace(flat, vertices=flat.vertices[:, [0, 2, 1]] * [1.0, 1.0, -1.0])
        material = ClothMaterial(bending_rigidity=5e-5, stretch_stiffness=20.0)

    def arc(bent):
        line = np.stack([np.sin(along * bent) / bent, 0 * along, (1 - np.cos(along * bent)) / bent], axis=1)
        return line if kind == "rope" else np.tile(line, (3, 1)) + body.vertices * [0.0, 1.0, 0.0]

    sharp = replace(scene_of(body, start=arc(curved)), material=material)
    gentle = replace(sharp, start=arc(0.6 * curved))

    def final(*effects):
        world = simulator.open(gentle)
        forces = [e.bind(sharp, world.masses) for e in effects]
        for force in forces:
            force(-0.005, State(sharp.start, 0 * sharp.start))
        try:
            for k in range(160):
                brake = -20.0 * world.masses[:, None] * world.state().velocities
                world.step(np.zeros((0, 3)), brake + sum(f(0.005 * k, world.state()) for f in forces))
            bending = bending_of(body)
            bending.follow(world.state().positions)
        finally:
            world.close()
        size = np.linalg.norm(bending.curvature, axis=1)
        return float((size if kind == "rope" else size.reshape(3, count)[1])[3:-3].mean())

    assert final() < 0.05 * curved
    assert final(Crease(yield_radius=RADIUS)) == pytest.approx(curved - 1 / RADIUS, rel=0.05)
