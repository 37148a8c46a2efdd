"""Grasps that are not rigid: they give way under load, or slip."""

import math
from abc import abstractmethod
from dataclasses import replace
from typing import ClassVar

import numpy as np

from ...core.arrays import FloatArray, cross
from ...core.effect import Effect, GraspShift
from ...core.material import Material
from ...core.parameters import Parameter
from ...core.scene import Scene
from ...core.simulator import State
from .grip_load import BendingPull, GripLoad

#: Creep at twice the load that a grasp holds [m/s].
CREEP_SPEED = 0.1
#: Time constant of the creep of soft finger pads [s].
PAD_TIME = 0.01
#: Damping time that a very soft grasp adds to that of the material [s].
QUIET_TIME = 0.002


class _SoftGrasp(Effect):
    """Every grasp is displaced as a rigid body by what the object pulls at it.

    A gripper that answers once a step cannot calm vibrations faster than that, it feeds them. So a soft grasp also
    brings internal damping, up to :data:`QUIET_TIME`, which is of the size of what implicit engines have anyway.
    """

    acts_on: ClassVar[str] = "grasp"
    object_kinds: ClassVar[frozenset[str]] = frozenset({"cloth", "rope"})

    def on_material(self, material: Material) -> Material:
        softness = self.softness()
        return replace(material, damping_time=material.damping_time + QUIET_TIME * softness / (1.0 + softness))

    def bind_grasp(self, scene: Scene, masses: FloatArray) -> GraspShift | None:
        loads, first = [], 0
        for ids in scene.grasps:
            loads.append((GripLoad(scene, masses, ids), np.arange(first, first + len(ids))))
            first += len(ids)
        if not loads:
            return None
        shifts = [np.zeros((2, 6)) for _ in loads]  # where each is, and its last move
        pull = BendingPull(scene) if scene.body.kind == "rope" else None
        last: float | None = None

        def shift(time: float, state: State, target: FloatArray) -> FloatArray:
            nonlocal last
            step = 0.0 if last is None else time - last
            last = time
            out = target.copy()
            bent = pull(state.positions) if pull is not None and step > 0 else None
            for (load, rows), moved in zip(loads, shifts, strict=True):
                if step > 0:
                    force, stiffness = load(state.positions, step, bent)
                    moved[1] = self.give(force + stiffness @ moved[1], stiffness, moved[0], step)
                    moved[0] += moved[1]
                out[rows] = _moved(target[rows], moved[0])
            return out

        return shift

    @abstractmethod
    def softness(self) -> float:
        """A pure number: far above one where the grasp gives way as easily as the object stretches."""

    @abstractmethod
    def give(self, force: FloatArray, stiffness: FloatArray, moved: FloatArray, step: float) -> FloatArray:
        """Further displacement ``(6,)`` [m, rad] of a grasp in a step.

        Args:
            force: force and torque about the centre of the grasp ``(6,)`` [N, N m] of the object on the gripper, after
                the step if the grasp does not move in it. The object goes on as the grasp did in the step before.
            stiffness: by how much they fall per displacement ``(6, 6)``.
            moved: displacement so far ``(6,)`` [m, rad].
            step: [s].
        """


class GraspCompliance(_SoftGrasp):
    """Soft fingers: u = c F, and turned by c_r T, where F and T are the load of the object on the grasp.

    Solved together with the elements next to the grasp, linearised: (I (1 + tau / h) + C K) du = C F - u, with
    tau = :data:`PAD_TIME` and K of :class:`~.grip_load.GripLoad`; F is the load if the grasp does not move in the step.
    At rest u = C F exactly. Where the grasp speeds up, the object seems heavier by up to 2 h Z, Z the wave
    impedance of what is grasped. The load is the stretch (and of a rope the bending) of the elements next to the
    grasp and the weight of the held vertices; the bending of a cloth, damping and what other effects do to the
    stiffness are left out.

    References:
        Xydas and Kao, *Modeling of contact mechanics and friction limit surfaces for soft fingers in robotics*,
        1999 (soft fingers); Baraff and Witkin, *Large steps in cloth simulation*, 1998 (the linearly implicit step).
    """

    name: ClassVar[str] = "grasp-compliance"
    coefficients: ClassVar[tuple[Parameter, ...]] = (
        Parameter("compliance", "m/N", 0.0, 0.05, description="c, displacement per force"),
        Parameter("turn_compliance", "rad/(N m)", 0.0, 50.0, description="c_r, turn per torque"),
    )
    symptom: ClassVar[str] = "stays where the grippers are in the model where the real grasp gives way under its pull"

    def softness(self) -> float:
        return self.values["compliance"] / 1e-4 + self.values["turn_compliance"] / 10.0

    def give(self, force: FloatArray, stiffness: FloatArray, moved: FloatArray, step: float) -> FloatArray:
        c = np.array(3 * [self.values["compliance"]] + 3 * [self.values["turn_compliance"]])
        matrix = c[:, None] * stiffness
        matrix.flat[::7] += 1.0 + PAD_TIME / step
        return np.asarray(np.linalg.solve(matrix, c * force - moved))


class GraspSlip(_SoftGrasp):
    """A grasp that creeps along the load beyond what it holds: du/dt = v_0 (|F| / F_max - 1) F / |F|.

    A Bingham slider: nothing moves up to F_max, the speed then grows with what is beyond, by v_0 =
    :data:`CREEP_SPEED` for every F_max. The coefficient is 1 / F_max, so a grasp that holds everything is zero.
    Solved with the elements next to the grasp as :class:`GraspCompliance` is; only forces count, and the grasp
    does not turn.

    References:
        Bingham, *An investigation of the laws of plastic flow*, 1916; Howe and Cutkosky, *Practical force-motion
        models for sliding manipulation*, 1996 (a grasp slides along the load at the limit of friction).
    """

    name: ClassVar[str] = "grasp-slip"
    coefficients: ClassVar[tuple[Parameter, ...]] = (
        Parameter("slipperiness", "1/N", 0.0, 50.0, description="1 / F_max, F_max the load that a grasp holds"),
    )
    symptom: ClassVar[str] = "stays in the grippers in the model where the real one slides out of them under load"

    def softness(self) -> float:
        return self.values["slipperiness"]

    def give(self, force: FloatArray, stiffness: FloatArray, moved: FloatArray, step: float) -> FloatArray:
        most, size = 1.0 / self.values["slipperiness"], float(np.linalg.norm(force[:3]))
        out = np.zeros(6)
        if size > most:
            along = force[:3] / size
            resists = most / (CREEP_SPEED * step) + along @ stiffness[:3, :3] @ along
            out[:3] = (size - most) / resists * along
        return out


def _moved(points: FloatArray, moved: FloatArray) -> FloatArray:
    """``points (H, 3)`` [m] of a grasp displaced by ``moved (6,)`` [m, rad] about their centre."""
    angle = math.hypot(*moved[3:].tolist())
    if angle == 0.0:
        return np.asarray(points + moved[:3])
    centre = points.sum(axis=0) / len(points)
    arm, axis = points - centre, moved[None, 3:] / angle
    turned = math.cos(angle) * arm + math.sin(angle) * cross(axis, arm) + (1 - math.cos(angle)) * (arm @ axis.T) * axis
    return np.asarray(centre + turned + moved[:3])
