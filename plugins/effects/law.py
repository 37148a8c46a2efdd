"""A law of motion put together from simple terms, learned where no named effect explains a misfit."""

from typing import ClassVar

import numpy as np

from ...core.arrays import FloatArray
from ...core.effect import Effect, NodalForce
from ...core.parameters import Parameter
from ...core.scene import Scene
from ...core.simulator import State
from .law_terms import TERMS, Moment, Setting

_WAVE = tuple(
    Parameter(f"{part}_{letter}", "m/s2", -10.0, 10.0, description=f"amplitude along {letter} of the {part} of time")
    for part in ("sine", "cosine")
    for letter in "xyz"
)
_FREQUENCY = Parameter("frequency", "Hz", 0.0, 10.0, description="of sine and cosine; by itself it does nothing")


class Law(Effect):
    """A sum of simple force terms, most of them zero: the library in which an unknown force is sought.

    The force on a vertex of mass m is m times the sum over all terms of coefficient times acceleration (see
    :data:`~.law_terms.TERMS`): drags of the powers 0 to 3 of the speed, isotropic, across and along the surface;
    viscosity between neighbours; turning; accelerations constant, growing or oscillating in time; steady streams
    on what faces them; springs to the centre of the start (with an acceleration: to another place); pressure; and
    pull and drag near an obstacle. "Across" is through the surface of cloth and solid and square to a rope,
    "along" is the rest; on a solid these two act on the surface, in proportion to its area. Time is that of the
    recording. It is sparse regression over such a library that finds laws from motion (Brunton, Proctor and Kutz
    2016, "Discovering governing equations from data by sparse identification of nonlinear dynamical systems").

    A diagnosis does not try it: with so many coefficients it would explain anything. ``muslin unknown`` finds
    which few are needed, and ``muslin add --law`` puts those into a study.
    """

    name: ClassVar[str] = "law"
    acts_on: ClassVar[str] = "force"
    candidate: ClassVar[bool] = False
    coefficients: ClassVar[tuple[Parameter, ...]] = (*(t.parameter for t in TERMS), *_WAVE, _FREQUENCY)
    symptom: ClassVar[str] = "feels a force that the model has no name for"
    #: Coefficients that belong together, by what they are: the pieces a law is built of. A diagonal of axes and a
    #: spring with the acceleration that moves its centre are one piece each.
    families: ClassVar[dict[str, tuple[str, ...]]] = {
        **{
            t.parameter.name.replace("_", " "): (t.parameter.name,)
            for t in TERMS
            if not t.parameter.name.endswith(("_x", "_y", "_z"))
        },
        **{
            what: tuple(f"{name}_{letter}" for letter in "xyz")
            for what, name in (
                ("turning", "turning"),
                ("uniform acceleration", "acceleration"),
                ("growing acceleration", "ramp"),
                ("steady stream", "stream"),
            )
        },
        "spring to a place": ("spring", "acceleration_x", "acceleration_y", "acceleration_z"),
        **{f"spring to a plane along {e}": (f"spring_{e}", f"acceleration_{e}") for e in "xyz"},
        "oscillating acceleration": tuple(p.name for p in _WAVE),
    }

    def bind(self, scene: Scene, masses: FloatArray) -> NodalForce:
        setting = Setting(scene, masses)
        terms = [(self.values[t.parameter.name], t.acceleration) for t in TERMS if self.values[t.parameter.name] != 0]
        sine, cosine = (np.array([self.values[f"{part}_{e}"] for e in "xyz"]) for part in ("sine", "cosine"))
        turn = 2 * np.pi * self.values["frequency"]
        weights = masses[:, None]

        def force(time: float, state: State) -> FloatArray:
            moment = Moment(setting, time, state)
            total = np.zeros_like(state.positions) + sine * np.sin(turn * time) + cosine * np.cos(turn * time)
            for coefficient, acceleration in terms:
                total = total + coefficient * acceleration(moment)
            return np.asarray(weights * total)

        return force
