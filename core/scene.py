"""A scene: everything an engine needs to build one world, resolved to numbers."""

from dataclasses import dataclass

from .arrays import FloatArray, IntArray
from .body import Body
from .material import Material


@dataclass(frozen=True, eq=False)
class Scene:
    """One object in its surroundings at the start of a rollout, in the world frame (z up).

    Args:
        body: the mesh at its start, which is also its rest shape; at rest at time zero.
        material: in SI.
        gravity: ``(3,)`` [m/s2].
        held: indices ``(H,)`` of the vertices that follow a command; may be empty.
        loads: extra point mass on every vertex ``(V,)`` [kg].
        table_height: height of a horizontal table [m], or None.
    """

    body: Body
    material: Material
    gravity: FloatArray
    held: IntArray
    loads: FloatArray
    table_height: float | None = None
