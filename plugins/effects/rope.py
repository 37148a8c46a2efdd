"""What ropes have beside stretch and bending."""

from dataclasses import replace
from typing import ClassVar

from ...core.effect import Effect
from ...core.material import Material, RopeMaterial
from ...core.parameters import Parameter


class TwistStiffness(Effect):
    """Torsion of a rope, torque = G J times twist rate; adds to the G J of the material.

    A round homogeneous rod has G J = E I / (1 + nu), two thirds to one of its bending rigidity. A laid rope or
    a cable may have far less or more, so the two are told apart.

    References:
        Love, *A Treatise on the Mathematical Theory of Elasticity*, 1927, chapter XVIII.
    """

    name: ClassVar[str] = "twist-stiffness"
    acts_on: ClassVar[str] = "material"
    object_kinds: ClassVar[frozenset[str]] = frozenset({"rope"})
    needs: ClassVar[frozenset[str]] = frozenset({"twist"})
    coefficients: ClassVar[tuple[Parameter, ...]] = (
        Parameter("twist_rigidity", "N m2", 0.0, 1e-2, description="G J beyond that of the material"),
    )
    symptom: ClassVar[str] = "lets loops and turns of the gripper run out in the model where the real one stays twisted"

    def on_material(self, material: Material) -> Material:
        if not isinstance(material, RopeMaterial):
            return material
        return replace(material, twist_rigidity=material.twist_rigidity + self.values["twist_rigidity"])
