"""Plastic bending: an object that was bent too sharply does not straighten again."""

from typing import ClassVar

import numpy as np

from ...core.arrays import FloatArray
from ...core.bending import bending_of, rope_rigidities
from ...core.effect import Effect, NodalForce
from ...core.material import ClothMaterial, RopeMaterial
from ...core.parameters import Parameter
from ...core.scene import Scene
from ...core.simulator import State


class Crease(Effect):
    """Perfectly plastic bending: the rest curvature yields where the elastic part exceeds 1 / R.

    With R the yield radius, the elastic moment B (kappa - kappa_rest - kappa_p) never exceeds B / R, and the plastic
    curvature kappa_p grows by what would be beyond: the radial return of the tensor (cloth) or vector (rope) of
    curvature. The nodal forces are those of the moment B kappa_p; what is without it the engine has.
    A crease spreads over the triangles beside it, and no mesh bends sharper than about 2 over its spacing: a
    radius below half the spacing changes nothing.

    References:
        Narain, Pfaff and O'Brien, *Folding and crumpling adaptive sheets*, 2013 (rest angles that yield
        beyond a threshold of curvature); Simo and Hughes, *Computational Inelasticity*, 1998 (radial return).
    """

    name: ClassVar[str] = "crease"
    acts_on: ClassVar[str] = "force"
    object_kinds: ClassVar[frozenset[str]] = frozenset({"cloth", "rope"})
    coefficients: ClassVar[tuple[Parameter, ...]] = (
        Parameter("yield_radius", "m", 0.0, 0.1, description="R, the sharpest bend that springs back whole"),
    )
    symptom: ClassVar[str] = "unfolds flat in the model where the real one keeps the crease of a sharp fold"

    def bind(self, scene: Scene, masses: FloatArray) -> NodalForce:
        bending = bending_of(scene.body, scene.held)
        bending.follow(scene.start_positions)
        rigidity = bending_rigidity(scene)
        most = 1.0 / self.values["yield_radius"]
        plastic = np.zeros_like(bending.curvature)

        def force(time: float, state: State) -> FloatArray:
            nonlocal plastic
            bending.follow(state.positions)
            plastic = plastic + beyond(bending.curvature - bending.rest - plastic, most)
            return bending.forces(-rigidity * plastic)

        return force


def beyond(curvature: FloatArray, most: float) -> FloatArray:
    """What of vectors ``curvature (N, d)`` is more than ``most``, along them: the radial return of plasticity."""
    size = np.sqrt(np.einsum("nk,nk->n", curvature, curvature))
    return np.asarray(curvature * (1.0 - most / np.maximum(size, max(most, 1e-300)))[:, None])


def bending_rigidity(scene: Scene) -> FloatArray:
    """That of each number of curvature: of a cloth ``(3,)`` [N m] with x the warp, of a rope ``(V - 2, 1)`` [N m2]."""
    material = scene.material
    if isinstance(material, RopeMaterial):
        return rope_rigidities(scene.body, material)[:, None]
    assert isinstance(material, ClothMaterial)
    root = np.sqrt(material.weft_bending_ratio)
    return material.bending_rigidity * np.array([1.0 / root, root, 1.0])
