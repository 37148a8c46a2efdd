"""The library of simple force terms of which a law is made: each an acceleration, linear in its coefficient."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

import numpy as np

from ...core.arrays import FloatArray
from ...core.parameters import Parameter
from ...core.scene import Scene
from ...core.simulator import State
from .contact import Contacts
from .surface import Surface

#: Speed below which a dry drag fades, so that it does not turn a velocity round within a step [m/s].
CREEP = 0.05
#: Gap at which what an obstacle does has fallen to 1/e [m].
NEAR = 0.01


class Setting:
    """What the terms need to know of a scene, found once a rollout.

    Args:
        scene: the object and what stands around it.
        masses: lumped vertex masses ``(V,)`` [kg].
    """

    def __init__(self, scene: Scene, masses: FloatArray) -> None:
        body = scene.body
        self.kind = body.kind
        self.surface = Surface(body) if body.kind != "rope" else None
        self.contacts = Contacts(scene)
        #: Where places are counted from: the centre of mass at the start ``(3,)`` [m].
        self.center: FloatArray = masses @ scene.start_positions / masses.sum()
        self.skin = np.ones((len(masses), 1))
        if body.kind == "solid":  # what acts on the surface is counted per mass, as elsewhere
            areas = self._areas(scene.start_positions)
            self.skin = (np.linalg.norm(areas, axis=1) / np.linalg.norm(areas, axis=1).sum())[:, None]
            self.skin = self.skin * masses.sum() / masses[:, None]
        first, second = body.edges.T
        degree = np.bincount(body.edges.ravel(), minlength=len(masses))
        lengths = body.edge_lengths(body.vertices)
        dimension = body.elements.shape[1] - 1
        lightness = degree / masses  # the harmonic mean keeps a light vertex beside a heavy one steady
        share = 4.0 * dimension / (lightness[first] + lightness[second]) / lengths**2
        self.edges, self.exchange, self.masses = body.edges, share, masses

    def normals(self, positions: FloatArray) -> FloatArray:
        """Unit normals ``(V, 3)`` of a surface, or unit tangents of a rope."""
        out = np.gradient(positions, axis=0) if self.surface is None else self._areas(positions)
        return np.asarray(out / np.maximum(np.linalg.norm(out, axis=1, keepdims=True), 1e-300))

    def _areas(self, positions: FloatArray) -> FloatArray:
        assert self.surface is not None
        return self.surface.to_vertices(self.surface.area_vectors(positions))


class Moment:
    """One moment of a rollout: what terms are made of.

    Args:
        setting: of the rollout.
        time: [s].
        state: of the vertices.
    """

    def __init__(self, setting: Setting, time: float, state: State) -> None:
        self.setting, self.time = setting, time
        self.positions, self.velocity = state.positions, state.velocities
        self.place: FloatArray = state.positions - setting.center

    @cached_property
    def speed(self) -> FloatArray:
        return np.asarray(np.linalg.norm(self.velocity, axis=1, keepdims=True))

    @cached_property
    def normal(self) -> FloatArray:
        return self.setting.normals(self.positions)

    def part_across(self, vectors: FloatArray) -> FloatArray:
        """The part ``(V, 3)`` through the surface of cloth or solid, or across a rope."""
        through = np.sum(vectors * self.normal, axis=1, keepdims=True) * self.normal
        return np.asarray(vectors - through if self.setting.kind == "rope" else through)

    @cached_property
    def across(self) -> FloatArray:
        return self.part_across(self.velocity)

    @cached_property
    def along(self) -> FloatArray:
        return np.asarray(self.velocity - self.across)

    @cached_property
    def obstacle(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Nearness ``(V, 1)``, outward normal ``(V, 3)`` and sliding velocity ``(V, 3)`` at the nearest obstacle."""
        gap, normal, _ = self.setting.contacts.nearest(self.positions)
        sliding = self.velocity - np.sum(self.velocity * normal, axis=1, keepdims=True) * normal
        return np.exp(-np.maximum(gap, 0.0) / NEAR)[:, None], normal, sliding

    @cached_property
    def exchange(self) -> FloatArray:
        """Acceleration ``(V, 3)`` that evens out the velocities of neighbours, for a viscosity of 1 m2/s."""
        s = self.setting
        first, second = s.edges.T
        flow = s.exchange[:, None] * (self.velocity[second] - self.velocity[first])
        both, flows = np.concatenate([first, second]), np.concatenate([flow, -flow])
        sums = [np.bincount(both, flows[:, k], len(s.masses)) for k in range(3)]
        return np.stack(sums, axis=1) / s.masses[:, None]


Acceleration: TypeAlias = Callable[[Moment], FloatArray]


@dataclass(frozen=True)
class Term:
    """One term.

    Args:
        parameter: its coefficient: name, unit and range.
        acceleration: ``(V, 3)`` for a coefficient of one.
    """

    parameter: Parameter
    acceleration: Acceleration


def dry(vectors: FloatArray) -> FloatArray:
    """Unit vectors ``(V, 3)`` that fade out below :data:`CREEP`."""
    return np.asarray(vectors / np.sqrt(np.sum(vectors**2, axis=1, keepdims=True) + CREEP**2))


def length(vectors: FloatArray) -> FloatArray:
    """Lengths ``(V, 1)`` of vectors ``(V, 3)``."""
    return np.asarray(np.linalg.norm(vectors, axis=1, keepdims=True))


def _term(name: str, unit: str, bound: float, description: str, acceleration: Acceleration) -> Term:
    return Term(Parameter(name, unit, -bound, bound, description=description), acceleration)


def _axes(
    name: str, unit: str, bound: float, what: str, made: Callable[[Moment, FloatArray], FloatArray]
) -> list[Term]:
    """One term for every axis of the world, ``made`` from the moment and the unit vector ``(3,)``."""

    def along(axis: FloatArray) -> Acceleration:
        return lambda m: made(m, axis)

    return [
        _term(f"{name}_{letter}", unit, bound, what.format(letter), along(axis))
        for letter, axis in zip("xyz", np.eye(3), strict=True)
    ]


def everywhere(m: Moment, axis: FloatArray) -> FloatArray:
    """The same vector ``(3,)`` on all vertices ``(V, 3)``."""
    return np.broadcast_to(axis, m.velocity.shape)


#: Every term whose acceleration is linear in its coefficient; positive drags take energy, positive springs pull back.
TERMS: tuple[Term, ...] = (
    _term("dry_drag", "m/s2", 2.0, "against the motion, whatever its speed", lambda m: -dry(m.velocity)),
    _term("linear_drag", "1/s", 10.0, "times the velocity", lambda m: -m.velocity),
    _term("quadratic_drag", "1/m", 15.0, "times speed and velocity", lambda m: -m.speed * m.velocity),
    _term("cubic_drag", "s/m2", 3.0, "times squared speed and velocity", lambda m: -(m.speed**2) * m.velocity),
    _term("linear_drag_across", "1/s", 10.0, "times the velocity across", lambda m: -m.setting.skin * m.across),
    _term(
        "quadratic_drag_across", "1/m", 15.0, "times speed and velocity across",
        lambda m: -m.setting.skin * length(m.across) * m.across,
    ),
    _term("linear_drag_along", "1/s", 10.0, "times the velocity along", lambda m: -m.setting.skin * m.along),
    _term(
        "quadratic_drag_along", "1/m", 15.0, "times speed and velocity along",
        lambda m: -m.setting.skin * length(m.along) * m.along,
    ),
    _term(
        "plate_drag", "1/m", 15.0, "times the speed across and the velocity, as the air on a plate",
        lambda m: -m.setting.skin * length(m.across) * m.velocity,
    ),
    _term("internal_drag", "m2/s", 0.002, "that evens out the velocities of neighbours", lambda m: m.exchange),
    *_axes("turning", "1/s", 5.0, "velocity turned about {}, as on a carousel", lambda m, e: np.cross(e, m.velocity)),
    *_axes("acceleration", "m/s2", 10.0, "the same everywhere, along {}", everywhere),
    *_axes(
        "ramp", "m/s3", 10.0, "the same everywhere, growing with time, along {}",
        lambda m, e: m.time * everywhere(m, e),
    ),
    *_axes(
        "stream", "m/s2", 10.0, "on what faces {}, through the surface",
        lambda m, e: m.setting.skin * m.part_across(everywhere(m, e)),
    ),
    _term("spring", "1/s2", 100.0, "back to the centre of the start", lambda m: -m.place),
    *_axes(
        "spring", "1/s2", 100.0, "along {} back to the centre of the start",
        lambda m, e: -(m.place @ e)[:, None] * e,
    ),
    _term("pressure", "m/s2", 10.0, "along the normal of the surface", lambda m: m.setting.skin * _outward(m)),
    _term("obstacle_pull", "m/s2", 20.0, "towards an obstacle that is near", lambda m: -m.obstacle[0] * m.obstacle[1]),
    _term(
        "obstacle_drag", "1/s", 10.0, "times the sliding velocity near an obstacle",
        lambda m: -m.obstacle[0] * m.obstacle[2],
    ),
    _term(
        "obstacle_dry_drag", "m/s2", 3.0, "against the sliding near an obstacle",
        lambda m: -m.obstacle[0] * dry(m.obstacle[2]),
    ),
)  # fmt: skip


def _outward(m: Moment) -> FloatArray:
    return np.zeros_like(m.normal) if m.setting.kind == "rope" else m.normal
