"""What ropes have beside stretch and bending."""

from dataclasses import replace
from typing import ClassVar

import numpy as np

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


class UnevenRigidity(Effect):
    """A rope that bends more easily in some places than in others.

    Worn or kneaded where it is mostly held, wrapped, taped or marked in the middle, or made so. The coefficients are
    natural logarithms of ratios, on top of those that the material has: that of its ends over its middle, by one period
    of a cosine, and of its last end over its first, by half a period. The geometric mean along the rope stays
    (:class:`~muslin.core.material.RopeMaterial`). Those are the slowest two terms of any course along a rope.

    References:
        Antman, *Nonlinear Problems of Elasticity*, 1995: rods of which the properties vary along them.
    """

    name: ClassVar[str] = "uneven-rigidity"
    acts_on: ClassVar[str] = "material"
    object_kinds: ClassVar[frozenset[str]] = frozenset({"rope"})
    needs: ClassVar[frozenset[str]] = frozenset({"uneven-rope"})
    coefficients: ClassVar[tuple[Parameter, ...]] = (
        Parameter("log_end_ratio", "1", -2.0, 2.0, description="ln of E I at the ends over the middle"),
        Parameter("log_far_ratio", "1", -2.0, 2.0, description="ln of E I at the last end over the first"),
    )
    symptom: ClassVar[str] = "bends as easily everywhere in the model where the real one is stiffer in some places"

    def on_material(self, material: Material) -> Material:
        if not isinstance(material, RopeMaterial):
            return material
        return replace(
            material,
            end_bending_ratio=material.end_bending_ratio * float(np.exp(self.values["log_end_ratio"])),
            far_bending_ratio=material.far_bending_ratio * float(np.exp(self.values["log_far_ratio"])),
        )
