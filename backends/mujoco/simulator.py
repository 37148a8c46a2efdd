"""The MuJoCo simulator: a factory of worlds."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

from ...core.errors import InputError
from ...core.plate import opposite_vertices
from ...core.scene import Scene
from ...core.simulator import Simulator, World
from .engine import engine
from .world import MujocoWorld


class MujocoSimulator(Simulator):
    """MuJoCo 4 flex.

    Cloth is a Saint Venant-Kirchhoff membrane with the bending of :func:`muslin.core.plate.bending_matrix`. Rope
    is a discrete elastic rod that also stretches. A solid that is a regular box with odd vertex counts
    uses quadratic cells whose nodes are the vertices (no shear locking); other solids use linear
    tetrahedra, which are too stiff in bending unless the mesh is fine.

    Args:
        time_step: [s].
    """

    name: ClassVar[str] = "mujoco"
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
            "twist",
            "varying-stiffness",
            "contact-forces",
        }
    )
    #: A rope that swings is 16.1 mm from itself at 0.5 ms if steps take 5 ms, 0.8 mm if this (`make bench-sim`).
    usual_steps: ClassVar[Mapping[str, float]] = MappingProxyType({"rope": 0.00125})
    #: A step is linear in where vertices go, so that what turns in it gets longer, which is then damped. ``make
    #: bench-sim`` prints how far a swing and a fling at several steps are from one at the smallest.
    most_turn: ClassVar[float | None] = 0.075

    def __init__(self, time_step: float = 0.005) -> None:
        if not 0 < time_step <= 0.05:
            raise InputError(f"simulator 'mujoco': time_step must be in (0, 0.05] s, but is {time_step:g}")
        self.time_step = time_step

    def finer(self) -> "MujocoSimulator":
        return type(self)(time_step=self.time_step / 2)

    def engine_version(self) -> str:
        return f"mujoco {engine().__version__}"

    def check(self, scene: Scene) -> None:
        super().check(scene)
        if scene.body.kind == "cloth":
            opposite_vertices(scene.body)

    def open(self, scene: Scene) -> World:
        return MujocoWorld(scene, self.time_step)
