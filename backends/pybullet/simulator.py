"""The simulator that the registry finds."""

from typing import ClassVar

from ...core.errors import InputError
from ...core.material import ClothMaterial
from ...core.scene import Scene
from ...core.simulator import Simulator, World
from . import library
from .bending import is_flat


class PybulletSimulator(Simulator):
    """Bullet's deformable bodies.

    Cloth is a sheet that is flat at rest; see :class:`~muslin.backends.pybullet.cloth.ClothWorld` for what is
    Bullet's and what is not. Solids are Bullet's Neo-Hookean tetrahedra. There is no contact of a body with itself.

    Args:
        time_step: of a world [s]. Inside it as many substeps are made as explicit elasticity needs.
        most_substeps: in one time step; a scene that needs more is a failed rollout.
    """

    name: ClassVar[str] = "pybullet"
    object_kinds: ClassVar[frozenset[str]] = frozenset({"cloth", "solid"})
    capabilities: ClassVar[frozenset[str]] = frozenset({"table"})

    def __init__(self, *, time_step: float = 0.005, most_substeps: int = 500) -> None:
        if not 0 < time_step < float("inf"):
            raise InputError(f"simulator 'pybullet': time_step must be positive and finite, but is {time_step!r}")
        if most_substeps < 1:
            raise InputError(f"simulator 'pybullet': most_substeps must be at least 1, but is {most_substeps!r}")
        self.time_step = time_step
        self.most_substeps = most_substeps

    def check(self, scene: Scene) -> None:
        super().check(scene)
        if not scene.body.measures.min() > 0:
            raise InputError(f"element {int(scene.body.measures.argmin())} of the mesh has no {_size(scene)}")
        if scene.body.kind == "cloth" and not is_flat(scene.body):
            raise InputError(
                "simulator 'pybullet' bends only cloth that starts flat, but the vertices do not lie in one plane; "
                "start from a flat sheet, or take another simulator"
            )

    def open(self, scene: Scene) -> World:
        # Imported here, since the two worlds and the engine are not needed to name or describe the simulator.
        from .cloth import ClothWorld
        from .solid import SolidWorld

        if isinstance(scene.material, ClothMaterial):
            return ClothWorld(scene, scene.material, self.time_step, self.most_substeps)
        return SolidWorld(scene, scene.material, self.time_step, self.most_substeps)

    def engine_version(self) -> str:
        return library.version()


def _size(scene: Scene) -> str:
    return "area" if scene.body.kind == "cloth" else "volume"
