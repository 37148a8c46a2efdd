"""Air: drag and lift in still air, and wind."""

from typing import ClassVar

import numpy as np

from ...core.arrays import FloatArray
from ...core.effect import Effect, NodalForce
from ...core.parameters import Parameter
from ...core.scene import Scene
from ...core.simulator import State
from .surface import Surface, plate_force

#: Drag coefficient of a flat plate broadside (Hoerner 1965, Fluid-Dynamic Drag, ch. 3).
PLATE_DRAG = 1.17


class AirDrag(Effect):
    """Drag and lift of still air, per triangle: see :func:`~.surface.plate_force`.

    C_D of a plate is 1.1 to 1.3, less if the cloth is porous. The power is that of the drag alone, never
    positive; with C_L above C_D the air would still push a triangle forward along its own plane.
    """

    name: ClassVar[str] = "air-drag"
    acts_on: ClassVar[str] = "force"
    object_kinds: ClassVar[frozenset[str]] = frozenset({"cloth", "solid"})
    coefficients: ClassVar[tuple[Parameter, ...]] = (
        Parameter("drag_coefficient", "1", 0.0, 2.5, description="C_D broadside"),
        Parameter("lift_coefficient", "1", 0.0, 1.0, description="C_L"),
    )
    symptom: ClassVar[str] = "moves too fast through the air in the model, most where it moves broadside"

    def bind(self, scene: Scene, masses: FloatArray) -> NodalForce:
        surface = Surface(scene.body)
        drag, lift = self.values["drag_coefficient"], self.values["lift_coefficient"]

        def force(time: float, state: State) -> FloatArray:
            relative = surface.mean(state.velocities)
            areas = surface.area_vectors(state.positions)
            return surface.to_vertices(plate_force(areas, relative, drag, lift, surface.closed))

        return force


class Wind(Effect):
    """Steady horizontal wind: what moving air does beyond still air.

    The plate law with velocity relative to the air, v_r = v - u, minus the same law at u = 0, with
    C_D = :data:`PLATE_DRAG`: zero wind is exactly off, and the effect adds to :class:`AirDrag` without
    counting the drag of still air twice.
    """

    name: ClassVar[str] = "wind"
    acts_on: ClassVar[str] = "force"
    object_kinds: ClassVar[frozenset[str]] = frozenset({"cloth", "solid"})
    coefficients: ClassVar[tuple[Parameter, ...]] = (
        Parameter("velocity_x", "m/s", -1.5, 1.5, description="air velocity along x"),
        Parameter("velocity_y", "m/s", -1.5, 1.5, description="air velocity along y"),
    )
    symptom: ClassVar[str] = "is pushed aside by moving air that the model does not have"

    def bind(self, scene: Scene, masses: FloatArray) -> NodalForce:
        surface = Surface(scene.body)
        wind = np.array([self.values["velocity_x"], self.values["velocity_y"], 0.0])

        def force(time: float, state: State) -> FloatArray:
            velocity = surface.mean(state.velocities)
            areas = surface.area_vectors(state.positions)
            moving = plate_force(areas, velocity - wind, PLATE_DRAG, 0.0, surface.closed)
            still = plate_force(areas, velocity, PLATE_DRAG, 0.0, surface.closed)
            return surface.to_vertices(moving - still)

        return force
