"""Air that streams past: drag and lift in still air, and wind."""

from typing import ClassVar

import numpy as np

from ...core.arrays import FloatArray
from ...core.effect import Effect, NodalForce
from ...core.parameters import Parameter
from ...core.scene import Scene
from ...core.simulator import State
from .line import Line, cylinder_force
from .surface import Surface, plate_force

#: Drag coefficient of a flat plate broadside (Hoerner 1965, Fluid-Dynamic Drag, ch. 3).
PLATE_DRAG = 1.17
#: Drag coefficient of a round cylinder across the flow at Reynolds numbers of 10^3 to 10^5, which a rope of some
#: millimetres has from about 2 m/s on; at 100 it is 1.4 (Hoerner 1965, ch. 3).
CYLINDER_DRAG = 1.1


class AirDrag(Effect):
    """Drag and lift of still air, per triangle. See :func:`~.surface.plate_force`.

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
    dissipative: ClassVar[bool] = True
    symptom: ClassVar[str] = "moves too fast through the air in the model, most where it moves broadside"

    def bind(self, scene: Scene, masses: FloatArray) -> NodalForce:
        surface = Surface(scene.body)
        drag, lift = self.values["drag_coefficient"], self.values["lift_coefficient"]

        def force(time: float, state: State) -> FloatArray:
            relative = surface.mean(state.velocities)
            areas = surface.area_vectors(state.positions)
            return surface.to_vertices(plate_force(areas, relative, drag, lift, surface.closed))

        return force


class CylinderDrag(Effect):
    """Drag of still air on a rope, per segment. See :func:`~.line.cylinder_force`.

    C_D across is 1.0 to 1.2 for a smooth cylinder (Hoerner 1965, Fluid-Dynamic Drag, ch. 3). C_f along is that
    of a laminar boundary layer on the wetted surface, 1.33 / sqrt(Re) or about 0.005 for a metre of rope at
    1 m/s (Blasius 1908), several times that where the rope is rough or as thin as the layer. The diameter is
    the rope's own. Never positive in power.
    """

    name: ClassVar[str] = "cylinder-drag"
    acts_on: ClassVar[str] = "force"
    object_kinds: ClassVar[frozenset[str]] = frozenset({"rope"})
    coefficients: ClassVar[tuple[Parameter, ...]] = (
        Parameter("drag_coefficient", "1", 0.0, 2.0, description="C_D across the rope"),
        Parameter("friction_coefficient", "1", 0.0, 0.05, description="C_f along the rope"),
    )
    dissipative: ClassVar[bool] = True
    symptom: ClassVar[str] = "moves too fast through the air in the model, most where it moves across its own length"

    def bind(self, scene: Scene, masses: FloatArray) -> NodalForce:
        line = Line(scene)
        drag, friction = self.values["drag_coefficient"], self.values["friction_coefficient"]

        def force(time: float, state: State) -> FloatArray:
            segments, relative = line.segments(state.positions), line.mean(state.velocities)
            return line.to_vertices(cylinder_force(segments, relative, line.diameter, drag, friction))

        return force


class Wind(Effect):
    """Steady horizontal wind: what moving air does beyond still air.

    The drag of a plate, or of a cylinder for a rope, with velocity relative to the air, v_r = v - u, minus
    the same at u = 0, with C_D = :data:`PLATE_DRAG` or :data:`CYLINDER_DRAG`: zero wind is exactly off, and
    the effect adds to :class:`AirDrag` or :class:`CylinderDrag` without counting the drag of still air twice.
    """

    name: ClassVar[str] = "wind"
    acts_on: ClassVar[str] = "force"
    coefficients: ClassVar[tuple[Parameter, ...]] = (
        Parameter("velocity_x", "m/s", -1.5, 1.5, description="air velocity along x"),
        Parameter("velocity_y", "m/s", -1.5, 1.5, description="air velocity along y"),
    )
    symptom: ClassVar[str] = "is pushed aside by moving air that the model does not have"

    def bind(self, scene: Scene, masses: FloatArray) -> NodalForce:
        wind = np.array([self.values["velocity_x"], self.values["velocity_y"], 0.0])
        return _wind_on_rope(scene, wind) if scene.body.kind == "rope" else _wind_on_surface(scene, wind)


def _wind_on_surface(scene: Scene, wind: FloatArray) -> NodalForce:
    surface = Surface(scene.body)

    def force(time: float, state: State) -> FloatArray:
        velocity = surface.mean(state.velocities)
        areas = surface.area_vectors(state.positions)
        moving = plate_force(areas, velocity - wind, PLATE_DRAG, 0.0, surface.closed)
        still = plate_force(areas, velocity, PLATE_DRAG, 0.0, surface.closed)
        return surface.to_vertices(moving - still)

    return force


def _wind_on_rope(scene: Scene, wind: FloatArray) -> NodalForce:
    line = Line(scene)

    def force(time: float, state: State) -> FloatArray:
        velocity, segments = line.mean(state.velocities), line.segments(state.positions)
        moving = cylinder_force(segments, velocity - wind, line.diameter, CYLINDER_DRAG, 0.0)
        still = cylinder_force(segments, velocity, line.diameter, CYLINDER_DRAG, 0.0)
        return line.to_vertices(moving - still)

    return force
