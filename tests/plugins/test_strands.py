"""Strands that stick and slide, against the closed forms of a spring with a slider."""

from dataclasses import replace

import numpy as np
import pytest
from effect_objects import G, engine

from muslin.core.bending import RopeBending
from muslin.core.body import rope_line
from muslin.core.material import RopeMaterial
from muslin.core.motion import Motion
from muslin.core.obstacles import Table
from muslin.core.registry import REGISTRY
from muslin.core.rollout import rollout
from muslin.core.scenario import Scenario
from muslin.core.scene import Scene
from muslin.core.simulator import State
from muslin.plugins.effects.strands import RopeHysteresis

#: One hinge between two segments.
LENGTH = 0.02
LINE = rope_line(np.array([[0.0, 0.0, 0.0], [0.0, 0.0, -2 * LENGTH]]), 3)
RIGIDITY = 2e-4
SHARE, SLIP = 0.6, 10.0


def scene_of(body=LINE, **more):
    given = {"grasps": (), **more}
    material = RopeMaterial(bending_rigidity=RIGIDITY)
    return Scene(body, material, np.zeros(3), loads=np.zeros(len(body.vertices)), **given)


def bent(angle):
    """The hinge bent by ``angle`` [rad], the first segment staying where it is."""
    out = LINE.vertices.copy()
    out[2] = out[1] + LENGTH * np.array([np.sin(angle), 0.0, -np.cos(angle)])
    return out


def moment(force, angle, time=0.0):
    """By which the force turns the second segment towards larger angles [N m]."""
    across = np.array([np.cos(angle), 0.0, np.sin(angle)])
    return LENGTH * float(force(time, State(bent(angle), np.zeros((3, 3))))[2] @ across)


def strands(share=SHARE, slip=SLIP):
    return RopeHysteresis(sliding_share=share, slip_curvature=slip).bind(scene_of(), np.ones(3))


def test_strands_know_how_they_slid_before_the_start():
    """A piece of a recording is met as the whole would be."""
    whole, path = strands(), np.concatenate([np.linspace(0, 40, 9), np.linspace(40, 25, 4)[1:]])
    for k in path:
        expected = moment(whole, k * LENGTH)
    *earlier, start = [bent(k * LENGTH) for k in path]
    scene = scene_of(earlier=np.array(earlier), start=start)
    piece = RopeHysteresis(sliding_share=SHARE, slip_curvature=SLIP).bind(scene, np.ones(3))
    assert moment(piece, path[-1] * LENGTH) == pytest.approx(expected, rel=1e-9)
    for k in (10.0, -20.0, 5.0):
        assert moment(piece, k * LENGTH) == pytest.approx(moment(whole, k * LENGTH), rel=1e-9)


def test_earlier_shapes_tilt_with_the_world():
    """Engines know level tables only: what the rope was like before stands askew as the rope itself does."""
    seen = []

    class Looks(RopeHysteresis):
        def bind(self, scene, masses):
            seen.append((scene.start_positions, scene.earlier))
            return super().bind(scene, masses)

    body = rope_line(np.array([[0.0, 0.0, 0.0], [0.0, 0.0, -0.3]]), 7)
    still = Scenario(
        "held", body, (np.array([0, 1]),), Motion.still(1), np.array([0.0, 0.01]), np.eye(7), np.zeros(0, int)
    )
    piece = replace(still, earlier=still.world_vertices()[None], obstacles=(Table(-1.0),))
    tilt = REGISTRY.get("effect", "table-tilt")(about_x=0.2, about_y=-0.1)
    rollout(engine("mujoco"), piece, RopeMaterial(), [Looks(sliding_share=0.5, slip_curvature=1.0), tilt])
    ((start, earlier),) = seen
    np.testing.assert_allclose(earlier[0], start, atol=1e-12)
    assert np.abs(start - still.world_vertices()).max() > 0.01


def test_a_bend_is_met_by_all_of_the_rigidity_and_then_by_what_does_not_slide():
    """Beside the material's: nothing up to kappa_s, s B less beyond, nothing for 2 kappa_s on the way back."""
    force, curvatures = strands(), np.concatenate([np.linspace(0, 40, 81), np.linspace(40, -40, 161)[1:]])
    eased = np.array([moment(force, k * LENGTH) for k in curvatures])
    slope = np.diff(eased) / np.diff(curvatures)
    on, back = slope[:80], slope[80:]
    up, down = curvatures[1:81], curvatures[81:]
    np.testing.assert_allclose(on[up <= SLIP], 0.0, atol=1e-12)
    np.testing.assert_allclose(on[up > SLIP], SHARE * RIGIDITY, rtol=1e-6)
    np.testing.assert_allclose(back[down >= 40 - 2 * SLIP], 0.0, atol=1e-12)
    np.testing.assert_allclose(back[down < 40 - 2 * SLIP], SHARE * RIGIDITY, rtol=1e-6)


def test_a_cycle_takes_four_times_the_friction_moment_times_sliding():
    """4 s B kappa_s (K - kappa_s) per length."""
    force, top = strands(), 0.8
    angles = np.concatenate([np.linspace(0, top, 1000), *(np.linspace(top * a, -top * a, 2000)[1:] for a in (1, -1))])
    turning = np.array([moment(force, a) for a in angles])
    work = 0.5 * (turning[1:] + turning[:-1]) * np.diff(angles)
    expected = 4 * SHARE * RIGIDITY * SLIP * (top / LENGTH - SLIP) * LENGTH
    assert -work[-2 * 1999 :].sum() == pytest.approx(expected, rel=2e-3)


def test_friction_holds_nothing_of_the_shape_that_the_rope_starts_in():
    """Of a start bent by kappa_1 from rest, s B kappa_1 is taken off; strands stick there."""
    force = RopeHysteresis(sliding_share=SHARE, slip_curvature=SLIP).bind(scene_of(start=bent(1.0)), np.ones(3))
    eased = SHARE * RIGIDITY * 1.0 / LENGTH
    assert moment(force, 1.0) == pytest.approx(eased, rel=1e-9)
    assert moment(force, 1.0 - 0.9 * SLIP * LENGTH) == pytest.approx(eased, rel=1e-9)
    assert moment(force, 1.0 - 1.1 * SLIP * LENGTH) < (1 - 1e-3) * eased


def test_what_a_rope_that_slides_is_in_balance_with_is_the_softer_one():
    left = RopeHysteresis(sliding_share=SHARE).relaxed(RopeMaterial(bending_rigidity=RIGIDITY))
    assert left.bending_rigidity == pytest.approx((1 - SHARE) * RIGIDITY)


def test_strands_that_slide_at_once_make_a_softer_rope():
    """No slip curvature: (1 - s) B for every change."""
    force = strands(slip=0.0)
    for angle in (0.3, -0.5, 0.1):
        assert moment(force, angle) == pytest.approx(SHARE * RIGIDITY * angle / LENGTH, rel=1e-9)


def test_a_pendulum_loses_the_same_at_every_swing():
    """The energy at two turning points A, A' differs by M_f (A + A' - 2 theta_s): Coulomb, not viscous.

    That of the weight and of the strands' own rigidity (1 - s) B; stepped here, so that nothing else takes energy.
    """
    mass, step, own = 0.01, 0.0005, (1 - SHARE) * RIGIDITY / LENGTH
    force = strands()
    for part in np.linspace(0, 1.2, 300):  # bent to here before: the strands have slid
        moment(force, part)
    angle, speed, swing = 1.2, 0.0, [1.2]
    for _ in range(2400):
        turning = moment(force, angle) - RIGIDITY * angle / LENGTH - mass * G * LENGTH * np.sin(angle)
        speed += step * turning / (mass * LENGTH**2)
        angle += step * speed
        swing.append(angle)
    swing = np.array(swing)
    turns = np.flatnonzero(np.diff(swing[:-1]) * np.diff(swing[1:]) < 0) + 1
    first, second = np.abs(swing[np.r_[0, turns[:-1]]]), np.abs(swing[turns])
    sliding = second > 1.2 * SLIP * LENGTH
    assert sliding.sum() >= 3
    lost = mass * G * LENGTH * (np.cos(second) - np.cos(first)) + 0.5 * own * (first**2 - second**2)
    friction = SHARE * RIGIDITY * SLIP
    np.testing.assert_allclose(lost[sliding], friction * (first + second - 2 * SLIP * LENGTH)[sliding], rtol=0.03)


@pytest.mark.parametrize("name", ["mujoco", "pybullet"])
def test_a_clamped_rod_whose_strands_slide_at_once_sags_as_a_softer_one(name):
    """To the clamp, beside which all of the turn is that of half a segment."""
    simulator, count = engine(name), 11
    body = rope_line(np.array([[0.0, 0.0, 0.0], [0.5, 0.0, 0.0]]), count)

    def sag(rigidity, *effects):
        material = RopeMaterial(0.05, stretch_stiffness=500.0, bending_rigidity=rigidity, damping_time=0.01)
        scene = Scene(body, material, np.array([0.0, 0.0, -2.0]), (np.array([0, 1]),), np.zeros(count))
        world = simulator.open(scene)
        forces = [e.bind(scene, world.masses) for e in effects]
        try:
            for k in range(500):
                push = -3.0 * world.masses[:, None] * world.state().velocities
                world.step(body.vertices[:2], sum((f(0.005 * k, world.state()) for f in forces), push))
            return float(world.state().positions[-1, 2])
        finally:
            world.close()

    assert sag(0.01, RopeHysteresis(sliding_share=0.5)) == pytest.approx(sag(0.005), rel=0.005)


@pytest.mark.parametrize("name", ["mujoco", "pybullet"])
def test_a_rod_that_was_bent_swings_out_and_stays_a_little_bent(name):
    """Clamped, without weight, let go from an arc: with strands that slide it rests off straight, within their band.

    At the mesh and the step of a study, where a spring of its own would be far too stiff for the step.
    """
    simulator = engine(name)
    if "start-shape" not in simulator.capabilities:
        pytest.skip(f"{name} cannot start from a bent shape")
    count, curved = 21, 2.0
    along = np.linspace(0.0, 0.5, count)
    body = rope_line(np.array([[0.0, 0.0, 0.0], [0.5, 0.0, 0.0]]), count)
    arc = np.stack([np.sin(along * curved) / curved, 0 * along, (1 - np.cos(along * curved)) / curved], axis=1)
    material = RopeMaterial(0.05, stretch_stiffness=500.0, bending_rigidity=5e-3, damping_time=0.01)
    scene = Scene(body, material, np.zeros(3), (np.array([0, 1]),), np.zeros(count), start=arc)
    straight = Scene(body, material, np.zeros(3), (np.array([0, 1]),), np.zeros(count))

    def rest(*effects):
        world = simulator.open(scene)
        forces = [e.bind(straight, world.masses) for e in effects]
        for force in forces:  # bent from straight to the arc first
            for part in np.linspace(0, 1, 50):
                force(-0.005, State(body.vertices + part * (arc - body.vertices), 0 * arc))
        try:
            for k in range(500):
                push = -3.0 * world.masses[:, None] * world.state().velocities
                world.step(arc[:2], sum((f(0.005 * k, world.state()) for f in forces), push))
            bending = RopeBending(body)
            bending.follow(world.state().positions)
        finally:
            world.close()
        return bending.curvature[2:-2]

    plain, kept = rest(), rest(RopeHysteresis(sliding_share=0.6, slip_curvature=0.3))
    assert np.abs(plain).max() < 0.02
    size = np.linalg.norm(kept, axis=1)
    assert size.max() > 0.03
    assert size.max() <= 0.6 * 0.3 / (1 - 0.6) * 1.05  # where (1 - s) B kappa is s B kappa_s


def test_a_rope_that_is_curved_at_rest_hangs_as_a_softer_one_once_its_strands_slide():
    """Its rest shape is held by the rigidity that is left, whatever shape it starts in."""
    angle = np.linspace(0.0, 1.5, 16)
    curved = 0.2 * np.stack([np.sin(angle), 0 * angle, 1 - np.cos(angle)], axis=1)
    material = RopeMaterial(0.05, stretch_stiffness=500.0, twist_rigidity=5e-3, damping_time=0.01)
    scenario = Scenario(
        "hook",
        rope_line(curved, 16),
        (np.array([0, 1]),),
        Motion.still(),
        np.array([0.0, 0.1]),
        np.eye(16),
        np.zeros(0, np.int64),
        settle=2.0,
    )

    begun = rollout(engine("mujoco"), replace(scenario, settle=0.0), material, [RopeHysteresis(sliding_share=0.5)])
    np.testing.assert_allclose(begun.vertices[0], curved, atol=1e-9)

    def hung(rigidity, *effects):
        return rollout(engine("mujoco"), scenario, replace(material, bending_rigidity=rigidity), effects).vertices[-1]

    softer, stiffer = hung(0.005), hung(0.01)
    apart = np.abs(hung(0.01, RopeHysteresis(sliding_share=0.5)) - softer).max()
    assert apart < 0.02 * np.abs(stiffer - softer).max()
