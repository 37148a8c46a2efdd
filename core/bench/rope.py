"""What only ropes do: twist, and run around a drum."""

from functools import partial

import numpy as np

from ..arrays import FloatArray
from ..body import Body, rope_line
from ..errors import RolloutFailed
from ..material import RopeMaterial
from ..obstacles import Cylinder
from ..scenario import STANDARD_GRAVITY
from ..scene import Scene
from ..simulator import State
from .case import GOALS, Asked, Case, VirtualTest
from .closed_forms import ring_opening
from .lab import Lab

_DOWN = np.array([0.0, 0.0, -STANDARD_GRAVITY])
_RADIUS = 0.1
#: How far the ring opens over its radius.
_OPENING = 0.02
_DRUM, _HANGS = 0.03, 0.12
#: How fast one end is drawn down [m/s], how far [m], and the weight on the other [kg].
_SPEED, _TRAVEL, _WEIGHT = 0.05, 0.06, 0.05
#: Segments next to the drum on either side from whose stretch tension is read.
_GAUGE = 3


def measure_twist(lab: Lab, cells: int, material: RopeMaterial) -> tuple[float]:
    """GJ [N m2] from a ring slit at one place, one coil of a spring: opposite forces across its plane open it.

    The opening is F R^3 (pi / EI + 3 pi / GJ). The forces balance, so nothing is held: to hold a rope's vertices
    does not say how its section is turned. Bending is taken as asked; of the opening it is a small part.
    """
    angles = np.linspace(0.0, 2 * np.pi, cells + 1)
    points = _RADIUS * np.stack([np.sin(angles), -np.cos(angles), 0 * angles], axis=1)
    chain = np.arange(cells)
    body = Body("rope", points, np.stack([chain, chain + 1], axis=1))
    ei, gj = material.bending_rigidity, material.twist_rigidity
    strength = _OPENING * _RADIUS / ring_opening(_RADIUS, ei, gj, 1.0)
    scene = Scene(body, material, np.zeros(3), (), np.zeros(len(points)))

    def push(time: float, state: State, masses: FloatArray) -> FloatArray:
        force = np.zeros((len(masses), 3))
        force[0, 2], force[-1, 2] = -strength, strength
        return force

    pace = 0.3 * np.sqrt(gj / material.linear_density) / _RADIUS**2
    rest = lab.settle(scene, pace, 1e-4 * _OPENING * _RADIUS, push)
    opening = float(rest[-1, 2] - rest[0, 2])
    bent = ring_opening(_RADIUS, ei, np.inf, strength)
    if opening <= bent:
        raise RolloutFailed(f"the ring opens by {1e3 * opening:.3g} mm, less than by bending alone")
    return (gj * (ring_opening(_RADIUS, ei, gj, strength) - bent) / (opening - bent),)


def measure_capstan(lab: Lab, cells: int, friction: float) -> tuple[float]:
    """T2 / T1 of a rope that is drawn over half a turn of a fixed drum: exp(mu pi) (Euler 1769, Eytelwein 1808).

    A weight hangs on one end, the other is drawn down, slowly, so that neither inertia nor the damping of an
    integrator counts. Both tensions are read from the stretch of the segments next to the drum.
    """
    material = RopeMaterial(
        linear_density=0.01,
        stretch_stiffness=200.0,
        bending_rigidity=1e-8,
        twist_rigidity=1e-8,
        friction=friction,
        damping_time=0.001,
    )
    r = _DRUM + material.diameter / 2
    length = np.pi * r + 2 * _HANGS
    count = round(length / (np.pi * r / cells)) + 1
    along = np.linspace(-length / 2, length / 2, count)
    turn = np.clip(along / r, -np.pi / 2, np.pi / 2)
    start = np.stack([r * np.sin(turn), 0 * turn, r * np.cos(turn) - np.maximum(np.abs(along) - np.pi * r / 2, 0)], 1)
    body = rope_line(np.array([[-length / 2, 0, r], [length / 2, 0, r]]), count)
    loads = np.zeros(count)
    loads[0] = _WEIGHT
    drum = Cylinder(np.zeros(3), np.array([0.0, 1.0, 0.0]), _DRUM, 0.1)
    scene = Scene(body, material, _DOWN, (np.array([count - 1]),), loads, (drum,), start)
    rest = body.measures

    def lead(time: float) -> FloatArray:
        return start[-1:] - [0.0, 0.0, _SPEED * time]

    def look(state: State) -> FloatArray:
        """Strain of the segments next to the drum, on the side of the weight and on the other."""
        x, z = state.positions[:, 0], state.positions[:, 2]
        strain = np.linalg.norm(np.diff(state.positions, axis=0), axis=1) / rest - 1.0
        free = np.maximum(z[:-1], z[1:]) < 0
        slack, taut = (np.flatnonzero(free & (side * x[1:] > 0)) for side in (-1, 1))
        if min(len(slack), len(taut)) < _GAUGE:
            raise RolloutFailed("the rope does not hang from both sides of the drum")
        return np.array([strain[slack[-_GAUGE:]].mean(), strain[taut[:_GAUGE]].mean()])

    times, strains = lab.watch(scene, _TRAVEL / _SPEED, look, lead=lead)
    light, heavy = strains[times > 0.4 * times[-1]].mean(axis=0)
    return (float(heavy / light),)


def twist_cases(quick: bool) -> tuple[Case, ...]:
    """Round sections, GJ = EI / 1.3, and softer in twist."""
    out = []
    for share in (0.25,) if quick else (0.25, 1 / 1.3):
        rope = RopeMaterial(bending_rigidity=1e-3, twist_rigidity=share * 1e-3)
        asked = (Asked("GJ", "N m2", rope.twist_rigidity, GOALS["twist"]),)
        run = partial(measure_twist, material=rope)
        needs = frozenset({"twist"})
        out.append(Case("rope", f"{share:.2g} EI", asked, (20, 40) if quick else (20, 40, 80), run, needs))
    return tuple(out)


def capstan_cases(quick: bool) -> tuple[Case, ...]:
    """Coefficients of 0.1 to 0.4."""
    out = []
    for mu in (0.3,) if quick else (0.1, 0.2, 0.4):
        asked = (Asked("T2/T1", "1", float(np.exp(mu * np.pi)), GOALS["friction"]),)
        run = partial(measure_capstan, friction=mu)
        out.append(Case("rope", f"mu {mu:g}", asked, (8, 16) if quick else (8, 16, 32), run))
    return tuple(out)


TWIST = VirtualTest("twist", "twist", "around the ring", twist_cases)
CAPSTAN = VirtualTest("capstan", "friction", "around the half turn", capstan_cases)
