"""Where effects are tried in rollouts: a carried object whose lowest part sags onto a table."""

from dataclasses import replace
from functools import cached_property
from typing import ClassVar

import numpy as np

from ..arrays import FloatArray, IntArray
from ..effect import Effect, NodalForce
from ..material import Material
from ..obstacles import Table
from ..parameters import Parameter
from ..rollout import rollout
from ..scene import Scene
from ..simulator import Simulator, State
from .hooks import table_under
from .motion import SideForce
from .samples import sample_grasp, sample_material, sample_scenario, sample_scene

#: Side forces that should not move anything that can be seen, over the mass [m/s2].
TRIFLES = (5e-6, -5e-6, 2e-6, -2e-6, 5e-7, -5e-7, 5e-9, -5e-9)


class Meter(Effect):
    """An effect that acts through forces and material alone, with the work that its forces do.

    Args:
        effect: that is metered.

    Attributes:
        work: done in every step [J], the force held through it; on held vertices, too, as what friction within the
            object takes there comes from the gripper.
    """

    name: ClassVar[str] = "conformance-meter"
    acts_on: ClassVar[str] = "force"
    coefficients: ClassVar[tuple[Parameter, ...]] = ()

    def __init__(self, effect: Effect) -> None:
        super().__init__()
        self._effect = effect
        self.work: list[float] = []

    @property
    def is_off(self) -> bool:
        return False

    def on_material(self, material: Material) -> Material:
        return self._effect.on_material(material)

    def bind(self, scene: Scene, masses: FloatArray) -> NodalForce | None:
        law = self._effect.bind(scene, masses)
        last: tuple[FloatArray, FloatArray] | None = None
        if law is None:
            return None

        def force(time: float, state: State) -> FloatArray:
            nonlocal last
            if last is not None:
                self.work.append(float(np.sum(last[1] * (state.positions - last[0]))))
            given = law(time, state)
            last = (state.positions.copy(), np.array(given))
            return given

        return force


class Stage:
    """One kind of object on one simulator; what is found out about it without effects is kept.

    Args:
        simulator: to try effects on.
        kind: of body.
    """

    def __init__(self, simulator: Simulator, kind: str) -> None:
        self._simulator, self._kind = simulator, kind

    def path(self, *effects: Effect, touching: bool = True) -> FloatArray:
        """What is seen of the object ``(T, M, 3)`` [m]; not ``touching``: without the table."""
        scenario = replace(sample_scenario(self._kind), grasps=(_grasp(self._kind),))
        if touching:
            lowest = float(scenario.start_vertices()[:, 2].min()) - float(scenario.body.vertices[:, 2].min())
            scenario = replace(scenario, obstacles=(Table(table_under(self._kind).height + lowest),))
        return rollout(self._simulator, scenario, sample_material(self._kind), effects).series.points

    @cached_property
    def plain(self) -> FloatArray:
        """The path without effects."""
        return self.path()

    @cached_property
    def in_the_air(self) -> FloatArray:
        """The path without effects and table."""
        return self.path(touching=False)

    @cached_property
    def amplified(self) -> float:
        """How far the engine's contact moves a vertex for one of :data:`TRIFLES` [m], at most."""
        return max(float(np.abs(self.path(SideForce(acceleration=a)) - self.plain).max()) for a in TRIFLES)


def _grasp(kind: str) -> IntArray:
    """A solid is held by its upper side, or nothing that is free would touch the table."""
    body = sample_scene(kind).body
    return np.argsort(body.vertices[:, 2])[-9:] if kind == "solid" else sample_grasp(body)
