"""Effects that no library has, and known ones under another law. Never registered: only realities have them."""

from collections.abc import Callable
from typing import ClassVar

import numpy as np

from muslin.core.arrays import FloatArray
from muslin.core.effect import Effect, NodalForce
from muslin.core.motion import Motion
from muslin.core.parameters import Parameter
from muslin.core.registry import REGISTRY
from muslin.core.scene import Scene
from muslin.core.simulator import State


def _one(name: str, unit: str, high: float) -> tuple[Parameter, ...]:
    return (Parameter(name, unit, 0.0, high),)


class RoomSpring(Effect):
    """A thread from the last vertex to the room, a spring of natural length zero: f = -k (x - x_0)."""

    name: ClassVar[str] = "room-spring"
    acts_on: ClassVar[str] = "force"
    coefficients: ClassVar[tuple[Parameter, ...]] = _one("stiffness", "N/m", 4.0)

    def bind(self, scene: Scene, masses: FloatArray) -> NodalForce:
        end = scene.start_positions[-1] + np.array([0.05, -0.03, 0.02])

        def force(time: float, state: State) -> FloatArray:
            out = np.zeros_like(state.positions)
            out[-1] = -self.values["stiffness"] * (state.positions[-1] - end)
            return out

        return force


class Magnet(Effect):
    """One patch is drawn aside and up with a constant force, as a magnetic label by a far magnet."""

    name: ClassVar[str] = "magnet"
    acts_on: ClassVar[str] = "force"
    coefficients: ClassVar[tuple[Parameter, ...]] = _one("share", "1", 1.0)

    def bind(self, scene: Scene, masses: FloatArray) -> NodalForce:
        free = np.setdiff1d(np.arange(len(masses)), scene.held)
        patch = free[len(free) // 3 : len(free) // 2]
        pull = np.zeros((len(masses), 3))
        weight = 9.81 * masses.sum() * self.values["share"]
        pull[patch] = weight / len(patch) * np.array([0.6, 0.48, 0.64])
        return lambda time, state: pull


class TimedPush(Effect):
    """A sideways acceleration that comes and goes, as of a vehicle or a fan that turns: a sin(2 pi f t)."""

    name: ClassVar[str] = "timed-push"
    acts_on: ClassVar[str] = "force"
    coefficients: ClassVar[tuple[Parameter, ...]] = _one("acceleration", "m/s2", 6.0)

    def bind(self, scene: Scene, masses: FloatArray) -> NodalForce:
        push = self.values["acceleration"] * masses[:, None] * np.array([0.8, 0.6, 0.0])
        return lambda time, state: push * np.sin(2 * np.pi * 1.3 * time)


class GripDrag(Effect):
    """Cubic drag on what is near the first gripper: f = -c m |v|^2 v, as in a tube of fluid around it."""

    name: ClassVar[str] = "grip-drag"
    acts_on: ClassVar[str] = "force"
    coefficients: ClassVar[tuple[Parameter, ...]] = _one("strength", "s/m2", 20.0)

    def bind(self, scene: Scene, masses: FloatArray) -> NodalForce:
        grip = scene.body.vertices[scene.grasps[0]].mean(axis=0)
        away = np.linalg.norm(scene.body.vertices - grip, axis=1)
        near = np.where(away < np.quantile(away, 0.35), self.values["strength"] * masses, 0.0)[:, None]

        def force(time: float, state: State) -> FloatArray:
            v = state.velocities
            square = np.minimum(np.sum(v * v, axis=1, keepdims=True), 4.0)  # so that explicit steps stay stable
            return np.asarray(-near * square * v)

        return force


class MovingBead(Effect):
    """A weight that runs to and fro along the object, as a bead on a string: down by b m g, its place swings."""

    name: ClassVar[str] = "moving-bead"
    acts_on: ClassVar[str] = "force"
    coefficients: ClassVar[tuple[Parameter, ...]] = _one("share", "1", 2.0)

    def bind(self, scene: Scene, masses: FloatArray) -> NodalForce:
        weight = 9.81 * masses.sum() * self.values["share"]
        place = np.arange(len(masses)) / (len(masses) - 1)

        def force(time: float, state: State) -> FloatArray:
            window = np.exp(-0.5 * ((place - 0.55 - 0.35 * np.sin(2 * np.pi * 0.8 * time)) / 0.06) ** 2)
            out = np.zeros_like(state.positions)
            out[:, 2] = -weight * window / window.sum()
            return out

        return force


class Backlash(Effect):
    """A joint with dry friction and play: the gripper rests until the command has gone ``play`` ahead of it."""

    name: ClassVar[str] = "backlash"
    acts_on: ClassVar[str] = "command"
    coefficients: ClassVar[tuple[Parameter, ...]] = _one("play", "m", 0.03)

    def on_command(self, motion: Motion, time_step: float) -> Motion:
        play, poses = self.values["play"], motion.poses.copy()
        for k in range(1, len(poses)):
            ahead = motion.poses[k, :, :3] - poses[k - 1, :, :3]
            poses[k, :, :3] = poses[k - 1, :, :3] + np.sign(ahead) * np.maximum(np.abs(ahead) - play, 0.0)
        return Motion(motion.times, poses)


class LensDistortion(Effect):
    """A lens that magnifies more further out: p' = c + (p - c)(1 + k |p - c|^2) about the first frame's centroid."""

    name: ClassVar[str] = "lens-distortion"
    acts_on: ClassVar[str] = "observation"
    coefficients: ClassVar[tuple[Parameter, ...]] = _one("strength", "1/m2", 3.0)

    def on_points(self, points: FloatArray) -> FloatArray:
        centre = points[0].mean(axis=0)
        away = points - centre
        return np.asarray(centre + away * (1 + self.values["strength"] * np.sum(away**2, axis=-1, keepdims=True)))


class LinearAirDrag(Effect):
    """Drag linear in the velocity, across what it meets only: Stokes' law in place of the quadratic one."""

    name: ClassVar[str] = "linear-air-drag"
    acts_on: ClassVar[str] = "force"
    coefficients: ClassVar[tuple[Parameter, ...]] = _one("rate", "1/s", 8.0)

    def bind(self, scene: Scene, masses: FloatArray) -> NodalForce:
        rate, edges = self.values["rate"], scene.body.edges
        share = masses[:, None] * rate

        def force(time: float, state: State) -> FloatArray:
            along = np.zeros_like(state.positions)
            ends = state.positions[edges]
            tangent = (ends[:, 1] - ends[:, 0]) / np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1, keepdims=True)
            if scene.body.kind == "rope":
                np.add.at(along, edges.ravel(), np.repeat(tangent, 2, axis=0))
                along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-12)
                v = state.velocities
                return np.asarray(-share * (v - np.sum(v * along, axis=1, keepdims=True) * along))
            a, b, c = (state.positions[scene.body.elements[:, k]] for k in range(3))
            np.add.at(along, scene.body.elements.ravel(), np.repeat(np.cross(b - a, c - a), 3, axis=0))
            along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-12)
            return np.asarray(-share * np.sum(state.velocities * along, axis=1, keepdims=True) * along)

        return force


class QuadraticDamping(Effect):
    """Damping of every mass by the square of its speed: f = -c m |v| v."""

    name: ClassVar[str] = "quadratic-damping"
    acts_on: ClassVar[str] = "force"
    coefficients: ClassVar[tuple[Parameter, ...]] = _one("strength", "1/m", 10.0)

    def bind(self, scene: Scene, masses: FloatArray) -> NodalForce:
        share = -self.values["strength"] * masses[:, None]

        def force(time: float, state: State) -> FloatArray:
            speed = np.minimum(np.linalg.norm(state.velocities, axis=1, keepdims=True), 5.0)
            return np.asarray(share * speed * state.velocities)

        return force


class MaxwellDamping(Effect):
    """Dashpots between neighbours behind springs (Maxwell) in place of dashpots alone (Kelvin and Voigt)."""

    name: ClassVar[str] = "maxwell-damping"
    acts_on: ClassVar[str] = "force"
    coefficients: ClassVar[tuple[Parameter, ...]] = _one("rate", "1/s", 30.0)
    #: Relaxation time of the springs [s].
    relaxation: ClassVar[float] = 0.03

    def bind(self, scene: Scene, masses: FloatArray) -> NodalForce:
        edges, count = scene.body.edges, len(masses)
        degree = np.bincount(edges.ravel(), minlength=count)[:, None]
        rate = self.values["rate"] * float(np.median(masses))
        relative, last = np.zeros((count, 3)), None

        def bend(values: FloatArray) -> FloatArray:
            around = np.zeros_like(values)
            np.add.at(around, edges[:, 0], values[edges[:, 1]])
            np.add.at(around, edges[:, 1], values[edges[:, 0]])
            return np.asarray(values - around / degree)

        def force(time: float, state: State) -> FloatArray:
            nonlocal relative, last
            step = 0.0 if last is None else time - last
            last = time
            share = 1.0 - np.exp(-step / self.relaxation)
            relative = relative + share * (bend(state.velocities) - relative)
            spread = relative / degree
            back = np.zeros_like(relative)
            np.add.at(back, edges[:, 1], spread[edges[:, 0]])
            np.add.at(back, edges[:, 0], spread[edges[:, 1]])
            return np.asarray(-rate * (relative - back))

        return force


class SecondOrderLag(Effect):
    """A gripper that follows as a critically damped second-order system: two first-order lags of half the time."""

    name: ClassVar[str] = "second-order-lag"
    acts_on: ClassVar[str] = "command"
    coefficients: ClassVar[tuple[Parameter, ...]] = _one("time_constant", "s", 0.1)

    def on_command(self, motion: Motion, time_step: float) -> Motion:
        lag: type[Effect] = REGISTRY.get("effect", "actuator-lag")
        half = lag(time_constant=self.values["time_constant"] / 2)
        return half.on_command(half.on_command(motion, time_step), time_step)


class Gust(Effect):
    """Wind that comes in gusts: the force of a steady one, times 1 + sin(2 pi f t) / 2."""

    name: ClassVar[str] = "gust"
    acts_on: ClassVar[str] = "force"
    coefficients: ClassVar[tuple[Parameter, ...]] = _one("velocity", "m/s", 1.5)

    def bind(self, scene: Scene, masses: FloatArray) -> NodalForce:
        wind: type[Effect] = REGISTRY.get("effect", "wind")
        steady = wind(velocity_x=0.6 * self.values["velocity"], velocity_y=0.8 * self.values["velocity"])
        bound = steady.bind(scene, masses)
        assert bound is not None
        return lambda time, state: bound(time, state) * (1.0 + 0.5 * np.sin(2 * np.pi * 0.7 * time))


UNKNOWN: dict[str, type[Effect]] = {
    e.name: e for e in (RoomSpring, Magnet, TimedPush, GripDrag, MovingBead, Backlash, LensDistortion)
}
_STILL_AIR = ("air-drag", "cylinder-drag", "viscous-damping")
#: Known effects under another law, and the effects of the library that are of that kind.
LAWS: dict[str, tuple[type[Effect], tuple[str, ...]]] = {
    "linear-air-drag": (LinearAirDrag, _STILL_AIR),
    "quadratic-damping": (QuadraticDamping, _STILL_AIR),
    "maxwell-damping": (MaxwellDamping, ("internal-damping", "rope-hysteresis", "bending-hysteresis")),
    "second-order-lag": (SecondOrderLag, ("actuator-lag", "camera-latency")),
    "gust": (Gust, ("wind",)),
}


def effect_class(name: str) -> type[Effect]:
    """The class of any hidden effect, of the library or not."""
    others: dict[str, Callable[..., Effect]] = {**UNKNOWN, **{k: v[0] for k, v in LAWS.items()}}
    found = others.get(name) or REGISTRY.get("effect", name)
    assert isinstance(found, type)
    return found
