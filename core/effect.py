"""Effects: physics that a model may lack. Written once, run on every backend."""

from abc import ABC
from collections.abc import Callable
from typing import ClassVar, TypeAlias

from .arrays import FloatArray
from .body import Body
from .errors import InputError
from .material import Material
from .motion import Motion
from .parameters import Parameter
from .scenario import Scenario
from .scene import Scene
from .simulator import State

#: ``(time [s], state) -> nodal forces (V, 3) [N]``
NodalForce: TypeAlias = Callable[[float, State], FloatArray]
#: ``(time [s], state) -> factor (E,) on the stretch stiffness of every element``
StiffnessFactor: TypeAlias = Callable[[float, State], FloatArray]
#: ``(time [s], state, where the grippers take the held vertices (H, 3) [m]) -> where they really go (H, 3) [m]``
GraspShift: TypeAlias = Callable[[float, State, FloatArray], FloatArray]


ACTS_ON = ("force", "material", "gravity", "mass", "command", "grasp", "contact", "observation")


class Effect(ABC):
    """A physical effect with named coefficients; all coefficients zero is exactly off.

    A model with the effect therefore nests the model without it. Subclasses declare
    :attr:`coefficients` and override the hooks that they act through; the default of every hook is the
    identity. A hook is never called on an effect that is off.

    Args:
        values: coefficients by name [their units]; missing ones are zero.
    """

    name: ClassVar[str]
    #: Coefficients with their unit and prior range. The range must contain zero or touch it.
    coefficients: ClassVar[tuple[Parameter, ...]]
    #: What it acts on, for people: one of :data:`ACTS_ON`.
    acts_on: ClassVar[str]
    #: Kinds of body for which it is meaningful.
    object_kinds: ClassVar[frozenset[str]] = frozenset({"cloth", "rope", "solid"})
    #: What a simulator must be able to do for it, of :data:`muslin.core.simulator.CAPABILITIES`.
    needs: ClassVar[frozenset[str]] = frozenset()
    #: Whether it follows from how a rope was seen to be bent, so that it says nothing where it was not seen whole.
    needs_kept_bend: ClassVar[bool] = False
    #: Whether it only ever takes energy away from the object.
    dissipative: ClassVar[bool] = False
    #: Whether a diagnosis tries it without being told to.
    candidate: ClassVar[bool] = True
    #: One clause that completes "the object ...": what one sees when the effect is missing from a model.
    symptom: ClassVar[str] = "moves differently"

    def __init__(self, **values: float) -> None:
        known = [c.name for c in self.coefficients]
        for given in values:
            if given not in known:
                raise InputError(f"effect {self.name!r} has no coefficient {given!r}; it has {', '.join(known)}")
        self.values: dict[str, float] = {c: float(values.get(c, 0.0)) for c in known}

    @property
    def is_off(self) -> bool:
        """Whether every coefficient is zero."""
        return all(v == 0.0 for v in self.values.values())

    @classmethod
    def parameters(cls) -> tuple[Parameter, ...]:
        """The coefficients as parameters of a study, named ``effect.coefficient``."""
        return tuple(
            Parameter(f"{cls.name}.{c.name}", c.unit, c.low, c.high, c.scale, c.description) for c in cls.coefficients
        )

    def on_material(self, material: Material) -> Material:
        """The material [SI] as this effect changes it, of the same class."""
        return material

    def relaxed(self, material: Material) -> Material:
        """Of ``material`` [SI], of the same class, what is left of it once friction within the object has let go.

        It is with this that an object that went to and fro is in balance in the mean, and that it holds its rest
        shape. An effect that takes bending rigidity off a rope here binds a force that lets go of the same share of
        the bend that the rope starts with, which friction alone holds.
        """
        return material

    def on_gravity(self, gravity: FloatArray) -> FloatArray:
        """Gravity ``(3,)`` [m/s2] as this effect turns it."""
        return gravity

    def on_body(self, scenario: Scenario, material: Material, gravity: FloatArray) -> Body:
        """The object in its rest shape as this effect bends it, of the same elements and lengths.

        Args:
            scenario: of which the body is to be replaced, moved as all effects have left the command.
            material: [SI], as all effects have left it, :meth:`relaxed`.
            gravity: ``(3,)`` [m/s2], as all effects have left it.
        """
        return scenario.body

    def on_command(self, motion: Motion, time_step: float) -> Motion:
        """The motion that the grippers really make when told ``motion``; may resample it at ``time_step`` [s]."""
        return motion

    def on_obstacles(self, turn: FloatArray) -> FloatArray:
        """The turn about the origin, a unit quaternion w x y z ``(4,)``, by which obstacles stand off level."""
        return turn

    def on_loads(self, body: Body, material: Material, loads: FloatArray) -> FloatArray:
        """Extra point mass ``(V,)`` [kg] on the vertices, which weighs too; ``loads`` is what hangs there already.

        ``body`` is in its rest shape and its own frame, the same in all recordings of the object.
        """
        return loads

    def on_clock(self, times: FloatArray) -> FloatArray:
        """When the object really was as it was seen at ``times (T,)`` [s].

        One that starts at rest was so before the first of them; one that starts as it was seen starts at what this
        makes of the first.
        """
        return times

    def on_points(self, points: FloatArray) -> FloatArray:
        """Where ``points (T, M, 3)`` [m] are seen by what measures them."""
        return points

    def off_points(self, points: FloatArray, first: FloatArray) -> FloatArray:
        """Where ``points (..., 3)`` [m] really are that are seen there: :meth:`on_points` undone.

        An object that starts as it was seen needs it.

        Args:
            points: markers or not, of any time.
            first: all markers as they are seen in the first frame ``(M, 3)`` [m].
        """
        return points

    def bind(self, scene: Scene, masses: FloatArray) -> NodalForce | None:
        """The nodal force of this effect in ``scene``, or None if it acts in another way.

        Called once a rollout: what it returns may remember what happened before in this rollout.

        Args:
            scene: material and gravity as all effects have left them.
            masses: lumped vertex masses ``(V,)`` [kg], loads included.
        """
        return None

    def bind_stiffness(self, scene: Scene) -> StiffnessFactor | None:
        """How the stretch stiffness of elements changes during the rollout, or None; needs ``"varying-stiffness"``."""
        return None

    def bind_grasp(self, scene: Scene, masses: FloatArray) -> GraspShift | None:
        """How the held vertices give way in the grippers, or None. Arguments as of :meth:`bind`."""
        return None
