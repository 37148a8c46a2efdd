"""Simulators: what a backend owes."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import ClassVar

import numpy as np

from .arrays import FloatArray
from .body import Body
from .errors import InputError
from .material import ClothMaterial, RopeMaterial
from .obstacles import Cylinder, StaticMesh, Table
from .scene import Scene

#: What a simulator may be able to do beyond its kinds of body, and what that means.
CAPABILITIES: dict[str, str] = {
    "table": "carry the object on a table, with friction",
    "cylinder": "carry the object on a cylinder, with friction",
    "static-mesh": "carry the object on a closed mesh, with friction",
    "anisotropy": "make cloth of different stiffness along warp and weft",
    "curved-rest": "make an object whose rest shape is not flat or straight",
    "start-shape": "start from a shape that is not the rest shape",
    "start-velocity": "start in motion",
    "uneven-rope": "make a rope that is stiffer in some places than in others",
    "twist": "make a rope that resists torsion, and starts twisted",
    "varying-stiffness": "change the stretch stiffness of elements during a rollout",
    "contact-forces": "tell the forces of the obstacles on the vertices",
}


class State:
    """Vertex positions ``(V, 3)`` [m] and velocities ``(V, 3)`` [m/s], in the order of ``scene.body``.

    The arrays may be views into the engine: read them before the next step, do not write them.

    Args:
        positions: ``(V, 3)`` [m].
        velocities: ``(V, 3)`` [m/s].
        contacts: gives the forces of the obstacles when asked; None: there are none.
    """

    __slots__ = ("_contacts", "positions", "velocities")

    def __init__(
        self, positions: FloatArray, velocities: FloatArray, contacts: Callable[[], FloatArray] | None = None
    ) -> None:
        self.positions = positions
        self.velocities = velocities
        self._contacts = contacts

    def contact_forces(self) -> FloatArray:
        """Forces ``(V, 3)`` [N] of the obstacles on the vertices, averaged over the last step."""
        return np.zeros_like(self.positions) if self._contacts is None else self._contacts()


class World(ABC):
    """One object in one engine, ready to be stepped. Owns whatever the engine allocates."""

    #: Duration of one :meth:`step` [s].
    time_step: float
    #: Lumped mass of every vertex ``(V,)`` [kg], loads included.
    masses: FloatArray

    @abstractmethod
    def state(self) -> State:
        """Where the vertices are, at the end of the last step or at the start."""

    @abstractmethod
    def step(
        self,
        held: FloatArray,
        forces: FloatArray | None,
        stiffness: FloatArray | None = None,
        turns: FloatArray | None = None,
    ) -> None:
        """Advance by :attr:`time_step`.

        Args:
            held: where the held vertices must be at the end of the step ``(H, 3)`` [m]; they get there exactly.
            forces: nodal forces ``(V, 3)`` [N] acting through the step besides gravity, elasticity and
                contact, or None for none. Those on held vertices have no effect.
            stiffness: factor ``(E,)`` on the stretch stiffness of every element in this step, or None for one.
                Only given to simulators that can do ``"varying-stiffness"``.
            turns: by how much each segment of a rope with both ends held has turned about itself at the end of the step
                since the start ``(C,)`` [rad], against a frame that is carried along with it without twist, or None for
                not at all. Only given to simulators that can do ``"twist"``.

        Raises:
            RolloutFailed: the engine reports that it could not do the step.
        """

    def close(self) -> None:
        """Free what the engine allocated. Called once, also after a failure."""
        return None


class Simulator(ABC):
    """A factory of worlds. Small, picklable, without state of its own: it travels to worker processes.

    Subclasses take their options as keyword arguments with defaults.
    """

    name: ClassVar[str]
    #: Kinds of :class:`~muslin.core.body.Body` it can build.
    object_kinds: ClassVar[frozenset[str]]
    #: Which of :data:`CAPABILITIES` it has.
    capabilities: ClassVar[frozenset[str]] = frozenset()
    #: ``time_step`` that a new study of an object of a kind gets, where what it is by default is too long [s].
    usual_steps: ClassVar[Mapping[str, float]] = MappingProxyType({})
    #: How far parts of an object may turn in a step before the step shows, where that shortens it [rad]; None: it does
    #: not.
    most_turn: ClassVar[float | None] = None

    @abstractmethod
    def open(self, scene: Scene) -> World:
        """Build a world.

        Raises:
            RolloutFailed: the engine cannot build this scene with these numbers.
        """

    def prepare(self, scene: Scene) -> None:
        """Do what takes long once in a process, as compiling, before worlds of scenes like this one are opened.

        That is not counted in the time of a rollout. Whatever it raises is not told: :meth:`open` will say it again.
        """
        return None

    def finer(self) -> "Simulator | None":
        """The same with half its time step, to see how far its numbers are from converged; None if there is none."""
        return None

    @abstractmethod
    def engine_version(self) -> str:
        """Name and version of the engine underneath, recorded with every result."""

    def check(self, scene: Scene) -> None:
        """Raise :class:`InputError` for a scene that this simulator can never build."""
        if scene.body.kind not in self.object_kinds:
            raise InputError(
                f"simulator {self.name!r} has no {scene.body.kind}; it has {', '.join(sorted(self.object_kinds))}"
            )
        if scene.material.kind != scene.body.kind:
            raise InputError(f"a {scene.body.kind} cannot be made of a {scene.material.kind} material")
        missing = sorted(needed_capabilities(scene) - self.capabilities)
        if missing:
            raise InputError(f"simulator {self.name!r} cannot {' or '.join(CAPABILITIES[m] for m in missing)}")


def needed_capabilities(scene: Scene) -> frozenset[str]:
    """Which of :data:`CAPABILITIES` a simulator must have to build ``scene``."""
    kinds = {Table: "table", Cylinder: "cylinder", StaticMesh: "static-mesh"}
    needed = {kinds[type(o)] for o in scene.obstacles}
    if scene.start is not None and not np.array_equal(scene.start, scene.body.vertices):
        needed.add("start-shape")
    if scene.start_velocities is not None and scene.start_velocities.any():
        needed.add("start-velocity")
    material = scene.material
    if isinstance(material, ClothMaterial) and (material.weft_stretch_ratio, material.weft_bending_ratio) != (1, 1):
        needed.add("anisotropy")
    if isinstance(material, RopeMaterial) and not material.is_even:
        needed.add("uneven-rope")
    if scene.body.kind != "solid" and not _is_straight(scene.body):
        needed.add("curved-rest")
    return frozenset(needed)


def _is_straight(body: Body) -> bool:
    """Whether the rest shape lies in one plane (cloth) or on one line (rope), to a millionth of its size."""
    size = np.linalg.svd(body.vertices - body.vertices.mean(axis=0), compute_uv=False)
    return bool(size[2 if body.kind == "cloth" else 1] <= 1e-6 * size[0])
