"""Friction that a single Coulomb coefficient does not give."""

from dataclasses import replace
from typing import ClassVar

import numpy as np

from ...core.arrays import FloatArray
from ...core.effect import Effect, NodalForce
from ...core.material import Material
from ...core.parameters import Parameter
from ...core.scene import Scene
from ...core.simulator import State
from .contact import Bristles, Contacts, NormalLoad

#: Sliding speed at which extra static friction has fallen to half [m/s]: what gravity adds in a step of 5 ms. Measured
#: ones are smaller, but an engine that lets a vertex hop off for a step would then break the hold.
STRIBECK_SPEED = 0.05


class AnisotropicFriction(Effect):
    """Cloth that slides less easily along one family of threads than along the other.

    With mu the coefficient of the material and N the contact force, the force beyond mu N is
    -N C v_t / |v_t|, with the friction tensor C = mu e d d^T along the warp, or along the weft for
    negative e (linear friction tensor, Zmitrowicz 1989; positive semidefinite, so it never gives energy). So
    sliding along the warp meets (1 + e) mu N, along the weft mu N. Woven fabrics on metal and on themselves
    differ by some tens of per cent between warp and weft (Das, Kothari and Vandana 2005).
    """

    name: ClassVar[str] = "anisotropic-friction"
    acts_on: ClassVar[str] = "contact"
    object_kinds: ClassVar[frozenset[str]] = frozenset({"cloth"})
    needs: ClassVar[frozenset[str]] = frozenset({"contact-forces"})
    coefficients: ClassVar[tuple[Parameter, ...]] = (
        Parameter("excess", "1", -1.0, 1.0, description="of the friction along the warp, if negative along the weft"),
    )
    dissipative: ClassVar[bool] = True
    symptom: ClassVar[str] = "slides less readily along one family of its threads than along the other"

    def bind(self, scene: Scene, masses: FloatArray) -> NodalForce:
        contacts, bristles, load, body = Contacts(scene), Bristles(masses), NormalLoad(len(masses)), scene.body
        excess = self.values["excess"]
        corners = body.elements.ravel()

        def force(time: float, state: State) -> FloatArray:
            gap, normal, friction = contacts.nearest(state.positions)
            limit = abs(excess) * friction * load(time, state.contact_forces(), normal, gap)
            along = np.repeat(body.measures[:, None] * body.warp_directions(state.positions), 3, axis=0)
            warp = np.stack([np.bincount(corners, along[:, k], minlength=len(masses)) for k in range(3)], axis=1)
            threads = warp if excess > 0 else np.cross(normal, warp)
            threads = threads - np.sum(threads * normal, axis=1, keepdims=True) * normal
            threads /= np.maximum(np.linalg.norm(threads, axis=1, keepdims=True), 1e-300)
            pull = bristles(time, state.velocities, normal, limit)
            return np.asarray(np.sum(pull * threads, axis=1, keepdims=True) * threads)

        return force


class StickSlip(Effect):
    """Static friction above kinetic: what lies holds on more than what slides.

    With mu the coefficient of the material, N the contact force and v_t the sliding velocity, the friction
    beyond mu N is up to e mu N / (1 + (v_t / v_s)^2), with v_s = :data:`STRIBECK_SPEED` (Stribeck curve in the
    form of Hess and Soom 1990), as bristles that hold at rest (:class:`~.contact.Bristles`): mu_s = (1 + e) mu.
    """

    name: ClassVar[str] = "stick-slip"
    acts_on: ClassVar[str] = "contact"
    needs: ClassVar[frozenset[str]] = frozenset({"contact-forces"})
    coefficients: ClassVar[tuple[Parameter, ...]] = (
        Parameter("excess", "1", 0.0, 1.0, description="of static over kinetic friction, mu_s / mu_k - 1"),
    )
    dissipative: ClassVar[bool] = True
    symptom: ClassVar[str] = "sticks where it lies and then lets go, where the model slides from the start"

    def bind(self, scene: Scene, masses: FloatArray) -> NodalForce:
        contacts, bristles, load = Contacts(scene), Bristles(masses), NormalLoad(len(masses))
        excess = self.values["excess"]

        def force(time: float, state: State) -> FloatArray:
            gap, normal, friction = contacts.nearest(state.positions)
            v = state.velocities
            sliding = v - np.sum(v * normal, axis=1, keepdims=True) * normal
            fading = 1.0 / (1.0 + np.sum(sliding**2, axis=1) / STRIBECK_SPEED**2)
            limit = excess * friction * fading * load(time, state.contact_forces(), normal, gap)
            return bristles(time, v, normal, limit)

        return force


class CapstanFriction(Effect):
    """Rope that grips what it is wound around more than the model says: T2 = T1 exp(mu phi) over an angle phi.

    That ratio of tensions is what Coulomb friction adds up to along a turn (Euler 1769, Eytelwein 1808), so the
    effect adds to the friction coefficient of the material, and the engine's own contact does the rest: exact
    sticking and no second friction law. It is for ropes alone; the friction of cloth and solids is inferred as
    the ``friction`` of their material. Ropes on metal, wood and plastic have a mu of 0.15 to 0.4.
    """

    name: ClassVar[str] = "capstan-friction"
    acts_on: ClassVar[str] = "contact"
    object_kinds: ClassVar[frozenset[str]] = frozenset({"rope"})
    coefficients: ClassVar[tuple[Parameter, ...]] = (
        Parameter("friction", "1", 0.0, 0.4, description="added to the Coulomb coefficient of the rope"),
    )
    dissipative: ClassVar[bool] = True
    symptom: ClassVar[str] = "grips what it is wound around, where the model slips and loses tension less"

    def on_material(self, material: Material) -> Material:
        return replace(material, friction=material.friction + self.values["friction"])
