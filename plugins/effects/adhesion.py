"""Surfaces that cling to one another."""

from typing import ClassVar

import numpy as np

from ...core.arrays import FloatArray
from ...core.effect import Effect, NodalForce
from ...core.material import RopeMaterial
from ...core.parameters import Parameter
from ...core.scene import Scene
from ...core.simulator import State
from .contact import REACH, Contacts, pressing


class Adhesion(Effect):
    """What has touched an obstacle clings to it until it is pulled off.

    A vertex that is pressed against an obstacle bonds. While it is bonded it is drawn back with the traction
    sigma (1 - gap / delta) on its share of the surface, and at the gap delta = :data:`~.contact.REACH` it lets go: the
    linear softening law of cohesive cracks (Hillerborg, Modéer and Petersson 1976), of energy sigma delta / 2
    per area. Nothing is drawn in that has not touched, so pulling off costs what touching does not give. The
    surface of a rope is its length times its diameter. Damp cloth clings with a few times its own weight, 1.5 Pa
    at 0.15 kg/m2. Friction grows with it, as the obstacle pushes back as hard as it draws.
    """

    name: ClassVar[str] = "adhesion"
    acts_on: ClassVar[str] = "contact"
    needs: ClassVar[frozenset[str]] = frozenset({"contact-forces"})
    coefficients: ClassVar[tuple[Parameter, ...]] = (
        Parameter("traction", "Pa", 0.0, 20.0, description="sigma, that holds it to what it has touched"),
    )
    symptom: ClassVar[str] = "clings to what it lies on, where the model lifts off at once"

    def bind(self, scene: Scene, masses: FloatArray) -> NodalForce:
        contacts = Contacts(scene)
        strength = self.values["traction"] * _surface_shares(scene)
        bonded = np.zeros(len(masses), bool)

        def force(time: float, state: State) -> FloatArray:
            nonlocal bonded
            gap, normal, _ = contacts.nearest(state.positions)
            bonded = (bonded | (pressing(state.contact_forces(), normal) > 0)) & (gap < REACH)
            pull = np.where(bonded, strength * (1.0 - np.clip(gap / REACH, 0.0, 1.0)), 0.0)
            return np.asarray(-pull[:, None] * normal)

        return force


def _surface_shares(scene: Scene) -> FloatArray:
    """The part of the surface that each vertex stands for ``(V,)`` [m2]; of a sheet one side."""
    body = scene.body
    if isinstance(scene.material, RopeMaterial):
        return body.vertex_measures * scene.material.diameter
    corners = body.vertices[body.triangles]
    areas = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    third = np.repeat(areas / 3.0, 3)
    return np.asarray(np.bincount(body.triangles.ravel(), third, minlength=len(body.vertices)), np.float64)
