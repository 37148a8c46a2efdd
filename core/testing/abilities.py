"""What a simulator claims to be able to do beyond its kinds of body, and how that is tried."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from ..arrays import FloatArray
from ..scene import Scene
from ..simulator import World
from . import carrying, ropes
from .checks import must
from .samples import KINDS, sample_body, sample_material, sample_scene
from .worlds import EXACT, Hanging, MakeSimulator, curved_body, damped, free_scene, hanging, relax, with_world


@dataclass(frozen=True)
class Ability:
    """One of :data:`muslin.core.simulator.CAPABILITIES`.

    Args:
        name: of the capability.
        checks: by title; called with what makes the simulator and a kind of body.
        scene: that cannot be built without it, by kind; None if it shows only in what is asked of a world.
        kinds: of body that it is about.
        also: capabilities without which it cannot be tried.
    """

    name: str
    checks: dict[str, Callable[[MakeSimulator, str], None]]
    scene: Callable[[str], Scene] | None = None
    kinds: tuple[str, ...] = KINDS
    also: frozenset[str] = field(default_factory=frozenset)


def check_anisotropy(make: MakeSimulator, kind: str) -> None:
    """Four times stiffer along the weft: the warp gives twice as much as before, the weft half, to 10 %."""
    for name, across, expected in (("warp", False, 2.0), ("weft", True, 0.5)):
        rig = hanging(kind, across=across, weft_stretch_ratio=4.0)

        def look(world: World, rig: Hanging = rig, name: str = name, expected: float = expected) -> None:
            share = rig.growth(world)
            must(
                abs(share / expected - 1.0) < 0.1,
                f"with a weft_stretch_ratio of 4 it grows {share:.2f} times as much along the {name} as without, "
                f"not {expected:g} times",
            )

        with_world(make(), rig.scene, look)


def check_curved_rest(make: MakeSimulator, kind: str) -> None:
    """Without weight a curved rest shape stays as it is."""
    scene = free_scene(curved_body(kind), sample_material(kind))

    def look(world: World) -> None:
        for _ in range(round(0.1 / world.time_step)):
            world.step(np.zeros((0, 3)), None)
        moved = np.abs(world.state().positions - scene.body.vertices).max()
        must(moved < 1e-4, f"a rest shape of 10 cm radius moves by {1e3 * moved:.2g} mm in 0.1 s without any force")

    with_world(make(), scene, look)


def _displaced(kind: str) -> Scene:
    """Turned, and stretched by 2 %."""
    body = sample_body(kind)
    centre = body.vertices.mean(axis=0)
    turn = np.array([[np.cos(0.5), -np.sin(0.5), 0.0], [np.sin(0.5), np.cos(0.5), 0.0], [0.0, 0.0, 1.0]])
    return free_scene(body, damped(kind), centre + 1.02 * (body.vertices - centre) @ turn.T)


def check_start_shape(make: MakeSimulator, kind: str) -> None:
    """It starts where the scene says, at rest, and springs back to the lengths of its rest shape."""
    scene = _displaced(kind)
    body = scene.body

    def look(world: World) -> None:
        state = world.state()
        off = np.abs(state.positions - scene.start_positions).max()
        must(off < EXACT, f"a vertex starts {off:.2g} m from where the scene's start has it")
        must(not state.velocities.any(), "the object moves at the start; it must be at rest")
        end = relax(world, np.zeros((0, 3)), 0.4)
        strain = np.abs(body.edge_lengths(end) / body.edge_lengths(body.vertices) - 1.0).max()
        must(strain < 2e-3, f"started stretched by 2 %, it comes to rest with an edge {strain:.1%} off its rest length")

    with_world(make(), scene, look)


def _thrown(kind: str) -> Scene:
    """Free and without weight, moving as a whole."""
    scene = free_scene(sample_body(kind), sample_material(kind))
    return replace(scene, start_velocities=np.tile([0.3, -0.2, 0.1], (len(scene.body.vertices), 1)))


def check_start_velocity(make: MakeSimulator, kind: str) -> None:
    """It starts with the velocities of the scene, and nothing stops it."""
    scene = _thrown(kind)
    thrown = scene.start_velocities
    assert thrown is not None

    def look(world: World) -> None:
        off = np.abs(world.state().velocities - thrown).max()
        must(off < EXACT, f"a vertex starts {off:.2g} m/s off the velocity that the scene gives it")
        steps = round(0.1 / world.time_step)
        for _ in range(steps):
            world.step(np.zeros((0, 3)), None)
        where = scene.body.vertices + steps * world.time_step * thrown
        off = np.abs(world.state().positions - where).max()
        must(off < 1e-4, f"thrown without weight it is {1e3 * off:.2g} mm from where it must be after 0.1 s")

    with_world(make(), scene, look)


def check_varying_stiffness(make: MakeSimulator, kind: str) -> None:
    """A factor on the stiffness of all elements, of some, and none again, changes the strain as it should, to 6 %."""
    rig = hanging(kind)
    body = rig.scene.body
    place = (body.vertices[body.elements].mean(axis=1) - body.vertices[rig.scene.held].mean(axis=0)) @ rig.along
    near = place < rig.length / 2
    tension = body.measures * (1.0 - place / rig.length)
    part = float(tension[near].sum() / tension.sum())
    every = np.ones(len(body.elements))
    tries: list[tuple[str, FloatArray | None, float]] = [
        ("of all elements", 0.5 * every, 2.0),
        ("of the elements near the grasp", np.where(near, 0.5, 1.0), 1.0 + part),
        ("of no element any more", None, 1.0),
    ]

    def look(world: World) -> None:
        for what, factors, expected in tries:
            share = rig.growth(world, factors)
            must(
                abs(share / expected - 1.0) < 0.06,
                f"with half the stiffness {what} it grows {share:.3f} times as much as plain, not {expected:.3f} times",
            )

    with_world(make(), rig.scene, look)


ABILITIES: tuple[Ability, ...] = (
    *(
        Ability(
            name,
            {
                f"a {name} carries it at its surface": carrying.carries(name),
                f"sticks to a {name} on a gentle slope": carrying.sticks(name),
                f"slides down a {name} on a steep one": carrying.slides(name),
            },
            carrying.landing(name),
        )
        for name in carrying.OBSTACLES
    ),
    Ability(
        "contact-forces",
        {"contact forces change its momentum": carrying.check_contact_forces},
        also=frozenset({"table"}),
    ),
    Ability(
        "anisotropy",
        {"is stiffer along the weft if told so": check_anisotropy},
        lambda kind: sample_scene(kind, weft_stretch_ratio=2.0),
        ("cloth",),
    ),
    Ability(
        "curved-rest",
        {"keeps a curved rest shape": check_curved_rest},
        lambda kind: free_scene(curved_body(kind), sample_material(kind)),
        ("cloth", "rope"),
    ),
    Ability("start-shape", {"starts away from its rest shape": check_start_shape}, _displaced),
    Ability("start-velocity", {"starts in motion": check_start_velocity}, _thrown),
    Ability(
        "uneven-rope",
        {"bends more where it is softer": ropes.check_uneven_rope},
        lambda kind: sample_scene(kind, end_bending_ratio=0.5),
        ("rope",),
    ),
    Ability(
        "twist",
        {
            "resists torsion": ropes.check_twist,
            "turns with what holds it": ropes.check_turns,
            "starts twisted": ropes.check_start_twist,
        },
        None,
        ("rope",),
        frozenset({"curved-rest"}),
    ),
    Ability("varying-stiffness", {"changes its stiffness when told": check_varying_stiffness}),
)
