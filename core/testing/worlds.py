"""What the checks of simulators share: a world that is closed in the end, and objects that hang from one end."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ..arrays import FloatArray, IntArray
from ..body import Body, solid_box
from ..material import ClothMaterial, Material, RopeMaterial, with_fields
from ..scene import Scene
from ..simulator import Simulator, World
from .samples import sample_body, sample_material, tilted

MakeSimulator = Callable[..., Simulator]

#: Positions are exact to this where nothing has to be integrated [m].
EXACT = 1e-6
#: Strain at which stiffness is measured [1]; small enough that every elastic law is Hooke's.
STRAIN = 0.005


def with_world(simulator: Simulator, scene: Scene, look: Callable[[World], None]) -> None:
    """Build the world of ``scene``, look at it, and close it."""
    simulator.check(scene)
    world = simulator.open(scene)
    try:
        look(world)
    finally:
        world.close()


def relax(
    world: World,
    held: FloatArray,
    duration: float,
    forces: FloatArray | None = None,
    stiffness: FloatArray | None = None,
) -> FloatArray:
    """Where the vertices ``(V, 3)`` [m] are in the mean of the second half of ``duration`` [s].

    Internal damping alone brings them to rest: a force -c m v that is held through a step feeds the fast
    vibrations of an engine that makes substeps.
    """
    steps = round(duration / world.time_step)
    mean = np.zeros_like(world.state().positions)
    for k in range(steps):
        if stiffness is None:
            world.step(held, forces)
        else:
            world.step(held, forces, stiffness)
        if k >= steps // 2:
            mean += world.state().positions / (steps - steps // 2)
    return mean


@dataclass(frozen=True, eq=False)
class Hanging:
    """A sample held at one end, its weight pulling along it so that it should grow by :data:`STRAIN`.

    A weight and not a force on the other end: how such a force spreads over the vertices of that end is
    different for every kind of element. By m g / (2 k) of its length, with k the force per strain.

    Args:
        scene: of it.
        ends: vertices of the other end ``(N,)``.
        along: unit vector ``(3,)``.
        length: [m].
    """

    scene: Scene
    ends: IntArray
    along: FloatArray
    length: float

    def growth(self, world: World, stiffness: FloatArray | None = None) -> float:
        """By how much it has grown at rest, relative to what it should in the plain material."""
        start = self.scene.body.vertices
        end = relax(world, start[self.scene.held], 0.4, stiffness=stiffness)
        return float(((end - start)[self.ends] @ self.along).mean()) / (STRAIN * self.length)


def hanging(kind: str, *, across: bool = False, **fields: float) -> Hanging:
    """A :class:`Hanging` sample with a Poisson ratio of zero, so that it stays as wide as it is held.

    Args:
        kind: of :data:`~muslin.core.testing.samples.KINDS`.
        across: hang a cloth along its weft and not along its warp.
        fields: of the material, which the weight does not take into account.
    """
    body = sample_body(kind)
    material = damped(kind) if kind == "rope" else with_fields(damped(kind), {"poisson_ratio": 0.0})
    if isinstance(material, ClothMaterial):
        rows = np.arange(12).reshape(3, 4)
        lines = rows.T if across else rows
        held, ends = lines[0], lines[-1]
        stiffness = material.stretch_stiffness * (0.09 if across else 0.12)
    elif isinstance(material, RopeMaterial):
        held, ends, stiffness = np.array([0]), np.array([len(body.vertices) - 1]), material.stretch_stiffness
    else:  # twice as long, so that engines with cells of 3 x 3 x 3 vertices have two of them
        body = tilted(solid_box(np.zeros(3), np.array([0.06, 0.12, 0.06]), (3, 5, 3)))
        grid = np.arange(45).reshape(3, 5, 3)
        held, ends, stiffness = grid[:, 0].ravel(), grid[:, -1].ravel(), material.youngs_modulus * 0.06**2
    apart = body.vertices[ends].mean(axis=0) - body.vertices[held].mean(axis=0)
    length = float(np.linalg.norm(apart))
    pull = 2.0 * STRAIN * stiffness / (float(body.measures.sum()) * material.density)
    gravity = pull * apart / length
    scene = Scene(body, with_fields(material, fields), gravity, (held,), np.zeros(len(body.vertices)))
    return Hanging(scene, ends, apart / length, length)


def damped(kind: str) -> Material:
    """The sample material with internal damping that stops its vibrations within a few hundredths of a second."""
    return with_fields(sample_material(kind), {"damping_time": 0.005})


def curved_body(kind: str) -> Body:
    """The sample sheet or line, bent to an arc of 10 cm radius without stretching its middle."""
    flat = sample_body(kind)
    radius = 0.1
    if kind == "rope":
        turn = np.linspace(0.0, 0.15, len(flat.vertices)) / radius
        return replace(flat, vertices=radius * np.stack([np.sin(turn), 0 * turn, 1 - np.cos(turn)], axis=1))
    column, row = np.tile(np.arange(4), 3), np.repeat(np.arange(3), 4)
    angle = 0.04 * (column - 1.5) / radius
    bent = np.stack([radius * np.sin(angle), radius * (1 - np.cos(angle)), -0.045 * row], axis=1)
    return replace(flat, vertices=bent, warp=None)


def free_scene(body: Body, material: Material, start: FloatArray | None = None) -> Scene:
    """``body`` without weight and held by nobody."""
    return Scene(body, material, np.zeros(3), (), np.zeros(len(body.vertices)), (), start)
