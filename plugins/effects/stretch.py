"""Stretch that is not the same in every direction, or at every strain."""

from dataclasses import replace
from typing import ClassVar

import numpy as np

from ...core.arrays import FloatArray, dot
from ...core.body import Body
from ...core.effect import Effect, StiffnessFactor
from ...core.material import ClothMaterial, Material
from ...core.parameters import Parameter
from ...core.scene import Scene
from ...core.simulator import State

#: Elongation at which half of the stiffening is there [1].
MIDDLE_STRAIN = 0.05


class Anisotropy(Effect):
    """Woven cloth: stiffer along the warp or along the weft.

    The coefficients are natural logarithms of weft over warp, on top of the ratios that the material has; the
    geometric means stay. Ten fabrics of Wang, O'Brien and Ramamoorthi had stretch ratios up to
    4.7 (logarithm 1.55) and bending ratios up to 3.7 (logarithm 1.31), stiffer along warp or weft.

    References:
        Wang, O'Brien and Ramamoorthi, *Data-driven elastic models for cloth*, 2011.
    """

    name: ClassVar[str] = "anisotropy"
    acts_on: ClassVar[str] = "material"
    object_kinds: ClassVar[frozenset[str]] = frozenset({"cloth"})
    needs: ClassVar[frozenset[str]] = frozenset({"anisotropy"})
    coefficients: ClassVar[tuple[Parameter, ...]] = (
        Parameter("log_stretch_ratio", "1", -1.6, 1.6, description="ln of E t along the weft over the warp"),
        Parameter("log_bending_ratio", "1", -1.4, 1.4, description="ln of D along the weft over the warp"),
    )
    symptom: ClassVar[str] = "bends and stretches alike along warp and weft in the model, where the real one is woven"

    def on_material(self, material: Material) -> Material:
        if not isinstance(material, ClothMaterial):
            return material
        return replace(
            material,
            weft_stretch_ratio=material.weft_stretch_ratio * float(np.exp(self.values["log_stretch_ratio"])),
            weft_bending_ratio=material.weft_bending_ratio * float(np.exp(self.values["log_bending_ratio"])),
        )


class StrainStiffening(Effect):
    """Stretch stiffness that grows, or falls, with elongation e: E (1 + k e^2 / (e^2 + e_0^2)), the secant one.

    Crimped yarns straighten before they stretch. The material's stiffness is that at small strain, 1 + k times it that
    at large strain; half of it is there at e_0 = :data:`MIDDLE_STRAIN`. The elongation e is, in every triangle, the
    largest principal strain of the edges' length, and in every segment of a rope its relative change of length;
    nothing stiffens where it is negative. Large over small strain is 0.6 to 8 in measured fabrics.

    References:
        Wang, O'Brien and Ramamoorthi, *Data-driven elastic models for cloth*, 2011 (stiffness that depends on the
        principal strains); Peirce, *The geometry of cloth structure*, 1937 (crimp).
    """

    name: ClassVar[str] = "strain-stiffening"
    acts_on: ClassVar[str] = "material"
    object_kinds: ClassVar[frozenset[str]] = frozenset({"cloth", "rope"})
    needs: ClassVar[frozenset[str]] = frozenset({"varying-stiffness"})
    coefficients: ClassVar[tuple[Parameter, ...]] = (
        Parameter("stiffening", "1", -0.5, 7.0, description="k, stiffness at large strain over that at small, minus 1"),
    )
    symptom: ClassVar[str] = "stretches in proportion to the load in the model where the real one gets stiffer"

    def bind_stiffness(self, scene: Scene) -> StiffnessFactor:
        elongation = RopeStrain(scene.body) if scene.body.kind == "rope" else SheetStrain(scene.body)
        growth = self.values["stiffening"]

        def factor(time: float, state: State) -> FloatArray:
            square = np.maximum(elongation(state.positions), 0.0) ** 2
            return np.asarray(1.0 + growth * square / (square + MIDDLE_STRAIN**2))

        return factor


class RopeStrain:
    """Relative change of length ``(E,)`` of the segments of a rope."""

    def __init__(self, body: Body) -> None:
        self._rest = body.measures

    def __call__(self, positions: FloatArray) -> FloatArray:
        return np.asarray(np.linalg.norm(positions[1:] - positions[:-1], axis=1) / self._rest - 1.0)


class SheetStrain:
    """Largest relative change of length ``(E,)`` of a fibre of each triangle."""

    def __init__(self, body: Body) -> None:
        self._triangles = body.elements.T
        self._inverse = rest_shape(body.vertices[body.elements])

    def __call__(self, positions: FloatArray) -> FloatArray:
        a, b, c = positions[self._triangles]
        u, v = b - a, c - a
        uu, vv, uv = (dot(p, q) for p, q in ((u, u), (v, v), (u, v)))
        p, q, r, s = self._inverse.reshape(-1, 4).T
        xx = p * p * uu + 2 * p * r * uv + r * r * vv  # right Cauchy-Green tensor in the plane of the rest shape
        yy = q * q * uu + 2 * q * s * uv + s * s * vv
        xy = p * q * uu + (p * s + q * r) * uv + r * s * vv
        return np.asarray(np.sqrt(0.5 * (xx + yy) + np.hypot(0.5 * (xx - yy), xy)) - 1.0)


def rest_shape(corners: FloatArray, along: FloatArray | None = None) -> FloatArray:
    """Inverse ``(E, 2, 2)`` of the edges from the first corner as columns, in axes in the plane of each triangle.

    Args:
        corners: ``(E, 3, 3)`` [m].
        along: unit vectors ``(E, 3)`` in the planes that are the x axes; None: the first edges.
    """
    u, v = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    x = u / np.linalg.norm(u, axis=1, keepdims=True) if along is None else along
    normal = np.cross(u, v)
    y = np.cross(normal / np.linalg.norm(normal, axis=1, keepdims=True), x)
    rows = [[dot(e, axis) for e in (u, v)] for axis in (x, y)]
    return np.linalg.inv(np.array(rows).transpose(2, 0, 1))
