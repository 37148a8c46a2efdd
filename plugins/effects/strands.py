"""Strands of a bent rope or cable that slide on each other."""

from dataclasses import replace
from typing import ClassVar

import numpy as np

from ...core.arrays import FloatArray
from ...core.bending import RopeBending, rope_rigidities
from ...core.effect import Effect, NodalForce
from ...core.material import Material, RopeMaterial
from ...core.parameters import Parameter
from ...core.scene import Scene
from ...core.simulator import State
from .crease import beyond


class RopeHysteresis(Effect):
    r"""Internal friction of a rope: strands stick together up to a change of curvature, and slide beyond it.

    While they stick the bending rigidity is that of the material, B. Where the curvature goes further than
    :math:`\kappa_s` from where they stick, they slide along, and a further change meets (1 - s) B only:

    .. math::
        M = (1 - s) B (\kappa - \kappa_0) + s B (\kappa - \kappa_1 - \kappa_p), \quad
        |\kappa - \kappa_1 - \kappa_p| \le \kappa_s,

    with :math:`\kappa_0` at rest and :math:`\kappa_1` where the rope was seen first, from where the slip
    :math:`\kappa_p` begins: a rope that was handled before may have slid either way, so nothing of the bend that it
    has there is taken to be held by friction. How it was bent from there to the start of a piece of a recording tells
    how it slid till then. A small swing meets a stiff rope, a large one a softer rope that takes the energy
    :math:`4 s B \kappa_s (K - \kappa_s)` per length from a cycle between :math:`\pm K`: the friction moment is
    :math:`M_f = s B \kappa_s`. To and fro it cancels, and (1 - s) B is what a rope is in balance with in the mean.

    What the sliding takes off is never more than what the engine has, so the force needs no smaller step than the rope.

    References:
        Papailiou, *On the bending stiffness of transmission line conductors*, IEEE Transactions on Power Delivery 12,
        1997 (rigidity between that of strands that stick and of those that slide); Prandtl, *Ein Gedankenmodell zur
        kinetischen Theorie der festen Körper*, 1928 (spring and slider).
    """

    name: ClassVar[str] = "rope-hysteresis"
    acts_on: ClassVar[str] = "force"
    object_kinds: ClassVar[frozenset[str]] = frozenset({"rope"})
    coefficients: ClassVar[tuple[Parameter, ...]] = (
        Parameter("sliding_share", "1", 0.0, 0.9, description="s, of the bending rigidity, lost where strands slide"),
        Parameter("slip_curvature", "1/m", 0.0, 2.0, description="change of curvature up to which strands stick"),
    )
    symptom: ClassVar[str] = "is as stiff in large swings as in small ones in the model where the real one gives way"

    def relaxed(self, material: Material) -> Material:
        if not isinstance(material, RopeMaterial):
            return material
        return replace(material, bending_rigidity=(1.0 - self.values["sliding_share"]) * material.bending_rigidity)

    def bind(self, scene: Scene, masses: FloatArray) -> NodalForce:
        assert isinstance(scene.material, RopeMaterial)
        bending = RopeBending(scene.body, scene.held)
        lost = self.values["sliding_share"] * rope_rigidities(scene.body, scene.material)[:, None]
        most = self.values["slip_curvature"]
        earlier = [] if scene.earlier is None else list(scene.earlier)
        first, *later = [*earlier, scene.start_positions]
        bending.follow(first)
        before = bending.curvature
        slip = np.zeros_like(before)
        for shape in later:
            bending.follow(shape)
            slip = slip + beyond(bending.curvature - before - slip, most)

        def force(time: float, state: State) -> FloatArray:
            nonlocal slip
            bending.follow(state.positions)
            slip = slip + beyond(bending.curvature - before - slip, most)
            return bending.forces(-lost * (before + slip))

        return force
