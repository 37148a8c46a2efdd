"""Checks of what only ropes do: they twist, and may be stiffer in some places than in others."""

from dataclasses import replace

import numpy as np

from ..arrays import FloatArray
from ..body import rope_line
from ..material import RopeMaterial, with_fields
from ..motion import rotate
from ..scene import Scene
from ..simulator import World
from .checks import must
from .worlds import MakeSimulator, relax, with_world


def _hoop(twist_rigidity: float) -> Scene:
    """A stiff quarter of a circle, clamped at its first segment, without weight."""
    angle = np.linspace(0.0, np.pi / 2, 17)
    body = rope_line(0.1 * np.stack([np.sin(angle), 1 - np.cos(angle), 0 * angle], axis=1), 17)
    material = RopeMaterial(0.05, 2000.0, 1e-2, twist_rigidity, damping_time=0.02)
    return Scene(body, material, np.zeros(3), (np.array([0, 1]),), np.zeros(17))


def check_twist(make: MakeSimulator, kind: str) -> None:
    """A quarter of a circle pushed out of its plane at the end gives way by bending and by torsion.

    By P R^3 (pi / 4 / EI + (3 pi / 4 - 2) / GJ), as Castigliano's theorem says: 1.94 times as much when GJ is
    EI / 4 as when it is EI. To 15 %.
    """
    sunk = []

    def look(world: World, scene: Scene) -> None:
        push = np.zeros_like(scene.body.vertices)
        push[-1, 2] = 0.02
        end = relax(world, scene.body.vertices[scene.held], 0.6, push)
        sunk.append(float(end[-1, 2]))

    for rigidity in (2.5e-3, 1e-2):
        scene = _hoop(rigidity)
        with_world(make(), scene, lambda world, scene=scene: look(world, scene))  # type: ignore[misc]
    bending, torsion = np.pi / 4, 3 * np.pi / 4 - 2
    expected = (bending + 4 * torsion) / (bending + torsion)
    share = sunk[0] / sunk[1]
    must(
        abs(share / expected - 1.0) < 0.15,
        f"a quarter ring of a quarter of the twist rigidity gives way {share:.2f} times as much, not {expected:.2f}",
    )


def check_uneven_rope(make: MakeSimulator, kind: str) -> None:
    """A cantilever pushed at its end gives way by the integral of P x^2 / EI, x from the end; to 6 %.

    Soft or stiff where it is clamped, which counts most.
    """
    body = rope_line(np.array([[0.0, 0.0, 0.0], [0.15, 0.0, 0.0]]), 17)
    plain = RopeMaterial(0.05, 2000.0, 1e-2, 1e-2, damping_time=0.02)
    along = np.linspace(1 / 16, 1.0, 4001)
    given: list[dict[str, float]] = [{}, {"end_bending_ratio": 0.1}, {"far_bending_ratio": 0.25}]
    sunk = []

    def look(world: World, scene: Scene) -> None:
        push = np.zeros_like(scene.body.vertices)
        push[-1, 2] = 0.1
        sunk.append(float(relax(world, scene.body.vertices[scene.held], 1.0, push)[-1, 2]))

    for ratios in given:
        material = with_fields(plain, ratios)
        scene = Scene(body, material, np.zeros(3), (np.array([0, 1]),), np.zeros(17))
        with_world(make(), scene, lambda world, scene=scene: look(world, scene))  # type: ignore[misc]
        expected = np.mean((1.0 - along) ** 2 / material.bending_shares(along)) / np.mean((1.0 - along) ** 2)
        must(
            abs(sunk[-1] / sunk[0] / expected - 1.0) < 0.06,
            f"a cantilever with {ratios} gives way {sunk[-1] / sunk[0]:.2f} times as much as without, "
            f"not {expected:.2f} times",
        )


def check_turns(make: MakeSimulator, kind: str) -> None:
    """A quarter of a circle goes round as a whole, right-handed, with the clamp that turns about its first segment.

    By 100 degrees in 0.5 s; then it comes to rest within 2 % of where a rigid one is.
    """

    def look(world: World, scene: Scene) -> None:
        held, angle = scene.body.vertices[scene.held], np.radians(100.0)
        steps = round(0.5 / world.time_step)
        for k in range(3 * steps):
            world.step(held, None, turns=np.array([angle * min((k + 1) / steps, 1.0)]))
        start, axis = scene.body.vertices, held[1] - held[0]
        turn = np.array([np.cos(angle / 2), *(np.sin(angle / 2) * axis / np.linalg.norm(axis))])
        rigid = start[0] + rotate(turn, start[-1] - start[0])
        off = float(np.linalg.norm(world.state().positions[-1] - rigid))
        must(
            off < 0.02 * 0.1, f"its end is {1e3 * off:.2g} mm from where a clamp that turns takes a rigid quarter ring"
        )

    scene = _hoop(1e-2)
    with_world(make(), scene, lambda world: look(world, scene))


def check_start_twist(make: MakeSimulator, kind: str) -> None:
    """A quarter of a circle that starts twisted between two clamps comes to rest where turning one of them takes it.

    By 2 rad; to 5 % of how far that is.
    """
    angle, free = 2.0, _hoop(1e-2)
    clamped = replace(free, grasps=(np.array([0, 1]), np.array([15, 16])))
    held, found = clamped.body.vertices[clamped.held], []

    def look(world: World, turns: FloatArray) -> None:
        for _ in range(round(1.5 / world.time_step)):
            world.step(held, -8.0 * world.masses[:, None] * world.state().velocities, turns=turns)
        found.append(world.state().positions.copy())

    for start_twist in (0.0, angle):
        turns = np.array([0.0, angle - start_twist])
        scene = replace(clamped, start_twist=start_twist)
        with_world(make(), scene, lambda world, turns=turns: look(world, turns))  # type: ignore[misc]
    moved = float(np.abs(found[0] - clamped.body.vertices).max())
    off = float(np.abs(found[1] - found[0]).max())
    must(
        off < 0.05 * moved,
        f"started twisted by {angle:g} rad it comes to rest {1e3 * off:.2g} mm from where turning its clamp takes it, "
        f"which is {1e3 * moved:.2g} mm away",
    )
