"""Periods: a pendulum, a limp chain, and the vibration of strips, ropes and beams."""

from functools import partial

import numpy as np

from ..arrays import BoolArray, FloatArray
from ..body import Body, rope_line, solid_box
from ..material import ClothMaterial, Material, RopeMaterial, SolidMaterial
from ..scenario import STANDARD_GRAVITY
from ..scene import Scene
from ..simulator import State
from .bending import SLENDERNESS, STRETCH
from .case import GOALS, Asked, Case, VirtualTest
from .closed_forms import (
    beam_mode,
    beam_period,
    chain_mode,
    chain_period,
    pendulum_period,
    thick_beam_period,
)
from .lab import Lab, period
from .meshes import strip

_DOWN = np.array([0.0, 0.0, -STANDARD_GRAVITY])
_LENGTH, _WIDTH = 0.3, 0.03
#: Mass at the end of the pendulum over that of what it hangs from.
_BOB = 10.0
_CHAIN_AMPLITUDE = np.deg2rad(3)
#: Amplitude of vibrations over the length: small, as the closed forms have it.
_VIBRATION = 0.01
#: A solid beam is as many times as long as thick.
BEAM_SLENDERNESS = 8


def hanging(kind: str, cells: int, angle: float, length: float) -> Body:
    """A strip or rope from the origin, hanging at ``angle`` [rad] from straight down towards +x."""
    if kind == "rope":
        return rope_line(np.array([[0.0, 0, 0], [length * np.sin(angle), 0, -length * np.cos(angle)]]), cells + 1)
    flat = strip(0.0, length, _WIDTH, (cells, max(1, round(cells * _WIDTH / length))))
    along, y = flat.vertices[:, 0], flat.vertices[:, 1]
    return Body("cloth", np.stack([along * np.sin(angle), y, -along * np.cos(angle)], axis=1), flat.elements)


def soft(kind: str) -> Material:
    """A material that hardly stretches and hardly bends."""
    if kind == "rope":
        return RopeMaterial(bending_rigidity=1e-7, twist_rigidity=1e-7, stretch_stiffness=2000.0)
    return ClothMaterial(stretch_stiffness=3000.0, bending_rigidity=1e-7)


def bob(kind: str) -> float:
    """Mass at the end of the pendulum [kg]."""
    return _BOB * soft(kind).density * _LENGTH * (1.0 if kind == "rope" else _WIDTH)


def asked_pendulum(kind: str, amplitude: float) -> float:
    """Period [s] of a uniform rod with the bob at its end."""
    end, own = bob(kind), bob(kind) / _BOB
    inertia, moment = (end + own / 3) * _LENGTH**2, (end + own / 2) * _LENGTH
    return pendulum_period(inertia, moment, STANDARD_GRAVITY, amplitude)


def measure_pendulum(lab: Lab, cells: int, kind: str, amplitude: float) -> tuple[float]:
    """Period [s] from the zeros of the angle of the heavy end; tension keeps what it hangs from straight."""
    body = hanging(kind, cells, amplitude, _LENGTH)
    depth = -body.vertices[:, 2] / np.cos(amplitude)
    ends = np.flatnonzero(depth > _LENGTH - 1e-9)
    loads = np.zeros(len(depth))
    loads[ends] = bob(kind) * body.vertex_measures[ends] / body.vertex_measures[ends].sum()
    scene = Scene(body, soft(kind), _DOWN, (np.flatnonzero(depth < 1e-9),), loads)
    share = loads / loads.sum()

    def look(state: State) -> FloatArray:
        return np.array(np.arctan2(share @ state.positions[:, 0], -(share @ state.positions[:, 2])))

    return (period(*lab.watch(scene, 1.4 * asked_pendulum(kind, amplitude), look)),)


def measure_chain(lab: Lab, cells: int, kind: str) -> tuple[float]:
    """Period [s] of the first mode of a hanging strip or rope, let go straight at 3 degrees.

    Its displacements are projected on the mode; the others, which a straight start excites too, fall out.
    """
    body = hanging(kind, cells, _CHAIN_AMPLITUDE, _LENGTH)
    depth = -body.vertices[:, 2] / np.cos(_CHAIN_AMPLITUDE)
    scene = Scene(body, soft(kind), _DOWN, (np.flatnonzero(depth < 1e-9),), np.zeros(len(depth)))
    weights = chain_mode(_LENGTH - depth, _LENGTH) * body.vertex_measures
    seconds = 1.4 * chain_period(_LENGTH, STANDARD_GRAVITY)
    return (period(*lab.watch(scene, seconds, lambda state: np.asarray(weights @ state.positions[:, 0]))),)


def _vibrate(lab: Lab, body: Body, material: Material, length: float, held: BoolArray, expected: float) -> float:
    """Period [s] of the first mode across z, without gravity, struck softly for a twentieth of the period."""
    mode = beam_mode(np.abs(body.vertices[:, 0]) / length)
    strike = expected / 20
    speed = _VIBRATION * length * 2 * np.pi / expected

    def push(time: float, state: State, masses: FloatArray) -> FloatArray:
        force = np.zeros((len(masses), 3))
        if time < strike:
            force[:, 2] = masses * mode * speed / strike
        return force

    scene = Scene(body, material, np.zeros(3), (np.flatnonzero(held),), np.zeros(len(mode)))
    weights = mode * body.vertex_measures

    def look(state: State) -> FloatArray:
        return np.asarray(weights @ (state.positions[:, 2] - body.vertices[:, 2]))

    times, seen = lab.watch(scene, 1.8 * expected, look, push)
    later = times > 0.25 * expected
    return period(times[later], seen[later])


def measure_strip(lab: Lab, cells: int, rigidity: float) -> tuple[float]:
    """Period [s] of both arms of a strip held along its middle row, as in the cantilever test."""
    material = ClothMaterial(stretch_stiffness=STRETCH, bending_rigidity=rigidity, poisson_ratio=0.0)
    length = 0.1
    body = strip(-length, length, length / SLENDERNESS, (2 * cells, cells // SLENDERNESS))
    held = np.abs(body.vertices[:, 0]) < 1e-9
    return (_vibrate(lab, body, material, length, held, beam_period(length, rigidity, material.areal_density)),)


def measure_rope(lab: Lab, cells: int, rigidity: float) -> tuple[float]:
    """Period [s] of both arms of a rope held in its middle."""
    material = RopeMaterial(stretch_stiffness=STRETCH, bending_rigidity=rigidity, twist_rigidity=rigidity)
    length = 0.2
    body = rope_line(np.array([[-length, 0, 0], [0.0, 0, 0], [length, 0, 0]]), 2 * cells + 1)
    held = np.abs(body.vertices[:, 0]) < 1e-9
    return (_vibrate(lab, body, material, length, held, beam_period(length, rigidity, material.linear_density)),)


def measure_beam(lab: Lab, cells: int, material: SolidMaterial) -> tuple[float]:
    """Period [s] of a solid beam with one end face held."""
    body, length, _ = beam(cells)
    held = body.vertices[:, 0] < 1e-9
    return (_vibrate(lab, body, material, length, held, asked_beam(material)),)


def beam(cells: int) -> tuple[Body, float, float]:
    """A level square beam with so many cells across, its length and side [m]."""
    side, length = 0.02, 0.02 * BEAM_SLENDERNESS
    low, high = np.array([0.0, -side / 2, -side / 2]), np.array([length, side / 2, side / 2])
    return solid_box(low, high, (BEAM_SLENDERNESS * cells + 1, cells + 1, cells + 1)), length, side


def asked_beam(material: SolidMaterial) -> float:
    """Period [s] of :func:`beam`."""
    _, length, side = beam(1)
    return thick_beam_period(length, side, material.youngs_modulus, material.poisson_ratio, material.density)


def pendulum_cases(quick: bool) -> tuple[Case, ...]:
    """Small and large amplitude."""
    out = []
    for kind in ("cloth", "rope"):
        for degrees in (60,) if quick else (10, 60):
            amplitude = float(np.deg2rad(degrees))
            asked = (Asked("period", "s", asked_pendulum(kind, amplitude), GOALS["period"]),)
            run = partial(measure_pendulum, kind=kind, amplitude=amplitude)
            out.append(Case(kind, f"{degrees} deg", asked, (10,) if quick else (10, 20), run))
    return tuple(out)


def chain_cases(quick: bool) -> tuple[Case, ...]:
    """One of each kind that can hang limp."""
    asked = (Asked("period", "s", chain_period(_LENGTH, STANDARD_GRAVITY), GOALS["period"]),)
    meshes = (10, 20) if quick else (10, 20, 40)
    return tuple(Case(k, "0.3 m", asked, meshes, partial(measure_chain, kind=k)) for k in ("cloth", "rope"))


def vibration_cases(quick: bool) -> tuple[Case, ...]:
    """Strips, ropes and solid beams from soft to stiff."""
    out = []
    meshes = (6, 12) if quick else (6, 12, 24)
    for rigid in (1e-4,) if quick else (1e-5, 1e-4, 1e-3):
        asked = (Asked("period", "s", beam_period(0.1, rigid, ClothMaterial().density), GOALS["period"]),)
        out.append(Case("cloth", f"{rigid:g} N m", asked, meshes, partial(measure_strip, rigidity=rigid)))
    for rigid in (1e-4,) if quick else (1e-5, 1e-3):
        asked = (Asked("period", "s", beam_period(0.2, rigid, RopeMaterial().density), GOALS["period"]),)
        out.append(Case("rope", f"{rigid:g} N m2", asked, meshes, partial(measure_rope, rigidity=rigid)))
    for modulus in (2.5e5,) if quick else (5e4, 2.5e5, 1.5e6):
        solid = SolidMaterial(youngs_modulus=modulus)
        asked = (Asked("period", "s", asked_beam(solid), GOALS["period"]),)
        out.append(
            Case("solid", f"{modulus:g} Pa", asked, (2,) if quick else (2, 4), partial(measure_beam, material=solid))
        )
    return tuple(out)


PENDULUM = VirtualTest("pendulum", "period", "along the length", pendulum_cases)
CHAIN = VirtualTest("hanging-chain", "period", "along the length", chain_cases)
VIBRATION = VirtualTest("vibration", "period", "along an arm (solid: across)", vibration_cases)
