"""Damping: proportional to mass and proportional to stiffness (Rayleigh)."""

from dataclasses import replace
from typing import ClassVar

from ...core.arrays import FloatArray
from ...core.effect import Effect, NodalForce
from ...core.material import Material
from ...core.parameters import Parameter
from ...core.scene import Scene
from ...core.simulator import State


class ViscousDamping(Effect):
    """Mass-proportional damping, f = -alpha m v: every mode decays at the rate alpha / 2.

    The alpha of Rayleigh damping C = alpha M + beta K (Rayleigh 1877, The Theory of Sound, I.81).
    """

    name: ClassVar[str] = "viscous-damping"
    acts_on: ClassVar[str] = "force"
    coefficients: ClassVar[tuple[Parameter, ...]] = (
        Parameter("rate", "1/s", 0.0, 5.0, description="alpha of C = alpha M"),
    )
    dissipative: ClassVar[bool] = True
    symptom: ClassVar[str] = "keeps moving in the model where the real one comes to rest, slow motions and fast alike"

    def bind(self, scene: Scene, masses: FloatArray) -> NodalForce:
        factor = -self.values["rate"] * masses[:, None]

        def force(time: float, state: State) -> FloatArray:
            return factor * state.velocities

        return force


class InternalDamping(Effect):
    """Stiffness-proportional damping, C = beta K: a mode of angular frequency w decays at beta w^2 / 2.

    The beta of Rayleigh damping C = alpha M + beta K (Rayleigh 1877, The Theory of Sound, I.81). It acts on
    deformation only, never on rigid motion. The backends have it natively, as the damping time of the
    material; this effect adds to that time.
    """

    name: ClassVar[str] = "internal-damping"
    acts_on: ClassVar[str] = "material"
    coefficients: ClassVar[tuple[Parameter, ...]] = (
        Parameter("damping_time", "s", 0.0, 0.05, description="beta of C = beta K"),
    )
    dissipative: ClassVar[bool] = True
    symptom: ClassVar[str] = "keeps rippling in the model where the real one is calm, fast ripples most"

    def on_material(self, material: Material) -> Material:
        return replace(material, damping_time=material.damping_time + self.values["damping_time"])
