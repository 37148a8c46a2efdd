"""Simulators: what a backend owes."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

from .arrays import FloatArray
from .errors import InputError
from .scene import Scene


@dataclass(frozen=True, eq=False)
class State:
    """Vertex positions ``(V, 3)`` [m] and velocities ``(V, 3)`` [m/s], in the order of ``scene.body``.

    The arrays may be views into the engine: read them before the next step, do not write them.
    """

    positions: FloatArray
    velocities: FloatArray


class World(ABC):
    """One object in one engine, ready to be stepped. Owns whatever the engine allocates."""

    #: Duration of one :meth:`step` [s].
    time_step: float
    #: Lumped mass of every vertex ``(V,)`` [kg], loads included.
    masses: FloatArray

    @abstractmethod
    def state(self) -> State: ...

    @abstractmethod
    def step(self, held: FloatArray, forces: FloatArray | None) -> None:
        """Advance by :attr:`time_step`.

        Args:
            held: where the held vertices must be at the end of the step ``(H, 3)`` [m]; they get there exactly.
            forces: nodal forces ``(V, 3)`` [N] acting through the step besides gravity, elasticity and
                contact, or None for none. Those on held vertices have no effect.

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

    @abstractmethod
    def open(self, scene: Scene) -> World:
        """Build a world.

        Raises:
            RolloutFailed: the engine cannot build this scene with these numbers.
        """

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
