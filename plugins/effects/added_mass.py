"""The air that a sheet carries along."""

from typing import ClassVar

import numpy as np

from ...core.arrays import FloatArray, IntArray
from ...core.body import Body
from ...core.effect import Effect, NodalForce
from ...core.material import Material
from ...core.parameters import Parameter
from ...core.scene import Scene
from ...core.simulator import State
from .surface import AIR_DENSITY


class AddedMass(Effect):
    """Inertia of the air that is carried along broadside: no weight, and none edge-on.

    A long plate of width L has the added mass pi rho L^2 / 4 per length, pi rho L / 4 per area (Lamb 1932,
    Hydrodynamics, art. 71); of a rectangle as long as it is wide about 0.58 of that, of one twice as long 0.76
    (DNV-RP-C205, table A-2). L is here the width of the rest shape, see :func:`width`.

    With m_a the added mass of a corner of a triangle, v and a its velocity and acceleration and n the unit
    normal, the force of the air on it is::

        f = -m_a n (n . a) - m_a n (n' . v)   the second only where it slows, (n' . v) (n . v) > 0

    The first is inertia. The second is that of air newly caught when a sheet that flies edge-on turns
    broadside, which must be brought up to speed; when it turns back, the air that it lets go keeps its
    momentum and nothing pushes. So the energy 1/2 m v^2 + 1/2 m_a (n . v)^2 never grows of itself. Potential
    flow, which follows the sheet without separating, would push then, and turn a gliding plate broadside.

    The acceleration makes the law implicit. So the vertices get m_a as a load, which is exact broadside and
    stable for any ratio of m_a to m. Taken off again are its weight, exactly, and its inertia within the sheet,
    with the acceleration of the sheet as a whole. Free, that is the rigid motion with its momentum and spin,
    extrapolated from the last two steps: what that misses shrinks by sqrt(m_a / (m + m_a)) a step, and no speed
    is lost for good. Held, it is the acceleration of the hand, as anything that answers back would make a stiff
    sheet bounce on its grasp.

    What is approximate: all other accelerations within the sheet (stretching, cloth that runs around a bend,
    the tension of a spin, a held sheet that swings in its own plane) meet m + m_a instead of m; m_a is spread
    evenly, where real air counts less near the rim; other effects that go by the mass of a vertex count the air.
    """

    name: ClassVar[str] = "added-mass"
    acts_on: ClassVar[str] = "force"
    object_kinds: ClassVar[frozenset[str]] = frozenset({"cloth"})
    coefficients: ClassVar[tuple[Parameter, ...]] = (
        Parameter("fraction", "1", 0.0, 1.0, description="of the added mass of a long plate, pi rho L / 4 per area"),
    )
    symptom: ClassVar[str] = "starts and stops too readily in the model where it moves broadside"

    def on_loads(self, body: Body, material: Material, loads: FloatArray) -> FloatArray:
        air = np.repeat(self._air(body), 3)
        return loads + np.bincount(body.elements.ravel(), air, minlength=len(loads))

    def bind(self, scene: Scene, masses: FloatArray) -> NodalForce:
        corners, air = np.ascontiguousarray(scene.body.elements.T), self._air(scene.body)
        flat, gravity = corners.ravel(), scene.gravity[:, None, None]
        bulk = _BulkAcceleration(masses, scene.held)

        def force(time: float, state: State) -> FloatArray:
            p, v, a = (x.T[:, corners] for x in (state.positions, state.velocities, bulk(time, state)))
            normal, gradient = _normals_and_gradients(p)
            n = normal[:, None]
            within = a - n * np.sum(n * a, axis=0)
            through = np.sum(n * v, axis=0)
            turning = -np.sum(gradient * through, axis=1)  # the rate of n
            caught = np.sum(turning[:, None] * v, axis=0)
            out = air * (within - gravity - np.where(caught * through > 0, caught, 0.0) * n)
            return np.stack([np.bincount(flat, x.ravel(), minlength=len(masses)) for x in out], axis=1)

        return force

    def _air(self, body: Body) -> FloatArray:
        """Added mass of each corner of every triangle ``(F,)`` [kg]."""
        return self.values["fraction"] * np.pi / 4 * AIR_DENSITY * width(body) * body.measures / 3.0


def width(body: Body) -> float:
    """The shorter side [m] of the rectangle whose area has the second moments of the sheet at rest."""
    corners = body.vertices[body.elements]
    centres, areas = corners.mean(axis=1), body.measures
    middle = areas @ centres / areas.sum()
    apart = corners - middle
    # the second moment of a triangle about a point: area / 12 (sum of its corners' + 9 times its centre's)
    moments = np.einsum("f,fkx,fky->xy", areas, apart, apart)
    moments += 9.0 * np.einsum("f,fx,fy->xy", areas, centres - middle, centres - middle)
    return float(np.sqrt(12.0 * np.linalg.eigvalsh(moments / (12.0 * areas.sum()))[1]))


def _normals_and_gradients(corners: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Of triangles ``(3 coordinates, 3 corners, F)``: unit normals ``(3, F)``, and the gradients of their corner shares
    ``(3, 3, F)``.

    Coordinates come first, which keeps the loops of NumPy as long as there are triangles.
    """
    normal = _cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    double = np.maximum(np.sqrt(np.sum(normal**2, axis=0)), 1e-300)
    unit = normal / double
    opposite = corners[:, [2, 0, 1]] - corners[:, [1, 2, 0]]
    return unit, _cross(unit[:, None], opposite) / double


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Products of vectors whose coordinates come first ``(3, …)``."""
    (ax, ay, az), (bx, by, bz) = a, b
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])


class _BulkAcceleration:
    """Accelerations ``(V, 3)`` [m/s2] of the motion of the sheet as a whole."""

    def __init__(self, masses: FloatArray, held: IntArray) -> None:
        self._masses, self._held = masses[:, None], held
        self._time = np.nan
        self._motion = np.zeros((2, 3))
        self._rates: list[FloatArray] = [np.zeros((2, 3)), np.zeros((2, 3))]

    def __call__(self, time: float, state: State) -> FloatArray:
        centre = np.sum(self._masses * state.positions, axis=0) / self._masses.sum()
        arm = state.positions - centre
        motion = self._motion_of_the_hand(state) if len(self._held) else self._rigid_motion(state, arm)
        if time > self._time:  # false at the first call
            self._rates = [(motion - self._motion) / (time - self._time), self._rates[0]]
        self._time, self._motion = time, motion
        if len(self._held):  # a command goes in straight pieces, so its rate jumps; and it does not answer back
            return np.broadcast_to(0.5 * (self._rates[0] + self._rates[1])[0], arm.shape)
        linear, angular = 2.0 * self._rates[0] - self._rates[1]
        # without the centripetal part: it only tightens the sheet, and an explicit step would let it gain speed
        return np.asarray(linear + np.cross(angular, arm))

    def _motion_of_the_hand(self, state: State) -> FloatArray:
        return np.stack([state.velocities[self._held].mean(axis=0), np.zeros(3)])

    def _rigid_motion(self, state: State, arm: FloatArray) -> FloatArray:
        """Velocity and spin ``(2, 3)`` of the rigid motion with the momentum and angular momentum of the sheet."""
        velocity = np.sum(self._masses * state.velocities, axis=0) / self._masses.sum()
        moments = (self._masses * arm).T @ arm
        inertia = (1.0 + 1e-9) * np.trace(moments) * np.eye(3) - moments
        momentum = np.sum(self._masses * np.cross(arm, state.velocities), axis=0)
        return np.stack([velocity, np.linalg.solve(inertia, momentum)])
