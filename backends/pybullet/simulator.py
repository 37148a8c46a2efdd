"""The simulator that the registry finds."""

from typing import ClassVar

from ...core.errors import InputError
from ...core.material import ClothMaterial, RopeMaterial
from ...core.plate import is_flat, opposite_vertices
from ...core.scene import Scene
from ...core.simulator import Simulator, World
from . import library

_SIZES = {"rope": "length", "cloth": "area", "solid": "volume"}


class PybulletSimulator(Simulator):
    """Bullet's deformable world with the elasticity computed here.

    :class:`~muslin.backends.pybullet.world.SoftWorld` says what is Bullet's and what is not. There is no contact
    of a body with itself, and none of edges and faces: vertices touch.

    Args:
        time_step: of a world [s]. Inside it as many substeps are made as explicit elasticity needs.
        most_substeps: in one time step; a scene that needs more is a failed rollout.
    """

    name: ClassVar[str] = "pybullet"
    object_kinds: ClassVar[frozenset[str]] = frozenset({"cloth", "rope", "solid"})
    capabilities: ClassVar[frozenset[str]] = frozenset(
        {
            "table",
            "cylinder",
            "static-mesh",
            "anisotropy",
            "curved-rest",
            "start-shape",
            "start-velocity",
            "uneven-rope",
            "varying-stiffness",
            "contact-forces",
        }
    )

    def __init__(self, *, time_step: float = 0.005, most_substeps: int = 500) -> None:
        if not 0 < time_step < float("inf"):
            raise InputError(f"simulator 'pybullet': time_step must be positive and finite, but is {time_step!r}")
        if most_substeps < 1:
            raise InputError(f"simulator 'pybullet': most_substeps must be at least 1, but is {most_substeps!r}")
        self.time_step = time_step
        self.most_substeps = most_substeps

    def check(self, scene: Scene) -> None:
        super().check(scene)
        body = scene.body
        if not body.measures.min() > 0:
            raise InputError(f"element {int(body.measures.argmin())} of the mesh has no {_SIZES[body.kind]}")
        if body.kind == "cloth":
            opposite_vertices(body)

    def open(self, scene: Scene) -> World:
        # Imported here, since they and the engine are not needed to name or describe the simulator.
        from .bending import CurvedBending, FlatBending
        from .membrane import Membrane
        from .rod import Rod
        from .volume import Volume
        from .world import SoftWorld

        library.bullet()  # also where nothing can be touched and Bullet would not be asked for anything
        material, body = scene.material, scene.body
        if isinstance(material, ClothMaterial):
            made = FlatBending if is_flat(body) else CurvedBending
            bending = made(body, material.bending_rigidity, material.weft_bending_ratio, scene.held)
            return SoftWorld(scene, self.time_step, self.most_substeps, Membrane(body, material, bending))
        if isinstance(material, RopeMaterial):
            return SoftWorld(scene, self.time_step, self.most_substeps, Rod(body, material, scene.held))
        return SoftWorld(scene, self.time_step, self.most_substeps, Volume(body, material))

    def prepare(self, scene: Scene) -> None:
        """One step compiles everything for this kind of body, or loads it where it has been compiled before."""
        world = self.open(scene)
        try:
            world.step(scene.start_positions[scene.held], None)
        finally:
            world.close()

    def finer(self) -> "PybulletSimulator":
        return type(self)(time_step=self.time_step / 2, most_substeps=self.most_substeps)

    def engine_version(self) -> str:
        return library.version()
