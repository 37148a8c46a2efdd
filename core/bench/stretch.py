"""Tension: a strip, rope or bar pulled along its axis, without gravity."""

from dataclasses import replace
from functools import partial

import numpy as np

from ..arrays import FloatArray, IntArray
from ..body import Body, rope_line, solid_box
from ..errors import RolloutFailed
from ..material import ClothMaterial, Material, RopeMaterial, SolidMaterial
from ..scene import Scene
from ..simulator import State
from .case import GOALS, Asked, Case, VirtualTest
from .lab import Lab
from .meshes import Style, strip

#: Strain at which stiffness is measured: laws of large strain differ from Hooke's by about 3/2 of it.
STRAIN = 0.002
_LENGTH, _WIDTH = 0.2, 0.05
_NO_GRAVITY = np.zeros(3)


def modulus_at(material: ClothMaterial, angle: float) -> float:
    """Stiffness E t [N/m] of a strip cut at ``angle`` [rad] from the warp.

    1/E = c^4/E1 + s^4/E2 + (1/G - 2 nu12/E1) s^2 c^2 (Lekhnitskii, Theory of Elasticity of an Anisotropic Body,
    1963, sect. 9; cloth: Kilby 1963), with nu12/E1 = nu/S and G = S/(2 (1 + nu)), S the geometric mean.
    """
    mean, ratio = material.stretch_stiffness, np.sqrt(material.weft_stretch_ratio)
    c, s = np.cos(angle) ** 2, np.sin(angle) ** 2
    return float(mean / (c * c * ratio + s * s / ratio + 2 * c * s))


def poisson_at(material: ClothMaterial, angle: float) -> float:
    """Contraction over extension of a strip cut at ``angle`` [rad] from the warp (Lekhnitskii, as above)."""
    mean, ratio = material.stretch_stiffness, np.sqrt(material.weft_stretch_ratio)
    nu, sc = material.poisson_ratio, (np.cos(angle) * np.sin(angle)) ** 2
    compliance = nu * (1 - 2 * sc) / mean - (ratio + 1 / ratio - 2 * (1 + nu)) * sc / mean
    return float(modulus_at(material, angle) * compliance)


def _pulled(lab: Lab, body: Body, material: Material, axis: int, force: FloatArray, pace: float) -> FloatArray:
    """Displacements ``(V, 3)`` at rest, the first end held and ``force (V, 3)`` acting."""
    ends = np.flatnonzero(np.abs(body.vertices[:, axis] - body.vertices[:, axis].min()) < 1e-9)
    scene = Scene(body, material, _NO_GRAVITY, (ends,), np.zeros(len(body.vertices)))
    length = float(np.ptp(body.vertices[:, axis]))

    def push(time: float, state: State, masses: FloatArray) -> FloatArray:
        return force

    # stretch is all that moves, so its own damping brings it to rest fastest
    rest = lab.settle(scene, pace, 1e-4 * STRAIN * length, push, damping_time=0.5 / pace)
    return rest - body.vertices


def _slope(place: FloatArray, shift: FloatArray, where: IntArray) -> float:
    """Strain: the slope of displacement over place, fitted to the vertices of the gauge."""
    strain = float(np.polyfit(place[where], shift[where], 1)[0])
    if strain == 0:
        raise RolloutFailed("nothing is strained")
    return strain


def measure_cloth(lab: Lab, cells: int, material: ClothMaterial, angle: float, style: Style) -> tuple[float, float]:
    """E t [N/m] and Poisson contraction of the half of the strip that is away from the clamp.

    The other end is pulled with a force spread evenly over its width, so that stress is uniform there.
    """
    body = strip(0.0, _LENGTH, _WIDTH, (4 * cells, cells), style)
    edges = body.vertices[body.elements[:, 1:]] - body.vertices[body.elements[:, :1]]
    warp = np.array([np.cos(angle), np.sin(angle)])
    body = replace(body, warp=np.linalg.solve(edges[:, :, :2].transpose(0, 2, 1), warp[None, :, None])[:, :, 0])
    x, y = body.vertices[:, 0], body.vertices[:, 1]
    end = np.flatnonzero(x > _LENGTH - 1e-9)
    end = end[np.argsort(y[end])]
    share = np.zeros(len(x))
    gaps = np.diff(y[end]) / _WIDTH
    share[end[:-1]] += gaps / 2
    share[end[1:]] += gaps / 2
    asked = modulus_at(material, angle)
    tension = STRAIN * asked
    force = tension * _WIDTH * share[:, None] * np.array([1.0, 0.0, 0.0])
    pace = np.pi / 2 / _LENGTH * np.sqrt(asked / material.areal_density)
    moved = _pulled(lab, body, material, 0, force, pace)
    gauge = np.flatnonzero(x > 0.45 * _LENGTH)
    # displacements of a uniform strain with shear and rotation
    basis = np.stack([np.ones(len(gauge)), x[gauge], y[gauge]], axis=1)
    gradient = np.linalg.lstsq(basis, moved[gauge, :2], rcond=None)[0][1:]
    if gradient[0, 0] == 0:
        raise RolloutFailed("nothing is strained")
    return tension / float(gradient[0, 0]), -float(gradient[1, 1] / gradient[0, 0])


def measure_rope(lab: Lab, cells: int, material: RopeMaterial) -> tuple[float]:
    """EA [N]: force over strain."""
    body = rope_line(np.array([[0.0, 0, 0], [_LENGTH, 0, 0]]), cells + 1)
    force = np.zeros_like(body.vertices)
    force[-1, 0] = STRAIN * material.stretch_stiffness
    pace = np.pi / 2 / _LENGTH * np.sqrt(material.stretch_stiffness / material.linear_density)
    moved = _pulled(lab, body, material, 0, force, pace)
    return (force[-1, 0] / _slope(body.vertices[:, 0], moved[:, 0], np.arange(cells + 1)),)


def measure_solid(lab: Lab, cells: int, material: SolidMaterial) -> tuple[float, float]:
    """E [Pa] and Poisson contraction of the third quarter of a square bar, away from both ends."""
    side = _WIDTH
    body = solid_box(np.zeros(3), np.array([_LENGTH, side, side]), (4 * cells + 1, cells + 1, cells + 1))
    share = np.where(np.arange(cells + 1) % cells == 0, 0.5, 1.0) / cells
    force = np.zeros((4 * cells + 1, cells + 1, cells + 1, 3))
    force[-1, :, :, 0] = STRAIN * material.youngs_modulus * side**2 * np.multiply.outer(share, share)
    pace = np.pi / 2 / _LENGTH * np.sqrt(material.youngs_modulus / material.density)
    moved = _pulled(lab, body, material, 0, force.reshape(-1, 3), pace)
    place = body.vertices
    gauge = np.flatnonzero((place[:, 0] > 0.49 * _LENGTH) & (place[:, 0] < 0.76 * _LENGTH))
    along = _slope(place[:, 0], moved[:, 0], gauge)
    across = 0.5 * (_slope(place[:, 1], moved[:, 1], gauge) + _slope(place[:, 2], moved[:, 2], gauge))
    return STRAIN * material.youngs_modulus / along, -across / along


def cases(quick: bool) -> tuple[Case, ...]:
    """Cloth of 10 to 10^4 N/m, along the grid and irregular, and woven; ropes of 50 to 5000 N; solids."""
    goal = GOALS["stretch"]
    out = []
    meshes = (1, 2) if quick else (1, 2, 4, 8)
    plain: list[tuple[float, Style]] = [(s, "grid") for s in ((10.0, 1e4) if quick else (10.0, 100.0, 1e3, 1e4))]
    plain += [(300.0, "irregular")] if quick else [(300.0, "irregular"), (300.0, "diagonal")]
    woven = ClothMaterial(stretch_stiffness=300.0, weft_stretch_ratio=2.5)
    cloths: list[tuple[str, ClothMaterial, float, Style]] = [
        (f"{s:g} N/m, {style} mesh", ClothMaterial(stretch_stiffness=s), 0.0, style) for s, style in plain
    ]
    cloths += [
        (f"woven, {name}", woven, np.deg2rad(a), "grid") for name, a in (("warp", 0), ("45 deg", 45), ("weft", 90))
    ]
    for label, cloth, angle, style in cloths:
        asked = (
            Asked("E t", "N/m", modulus_at(cloth, angle), goal),
            Asked("Poisson contraction", "1", poisson_at(cloth, angle), goal),
        )
        run = partial(measure_cloth, material=cloth, angle=angle, style=style)
        out.append(Case("cloth", label, asked, meshes, run))
    for stiffness in (500.0,) if quick else (50.0, 500.0, 5000.0):
        rope = RopeMaterial(stretch_stiffness=stiffness)
        run_rope = partial(measure_rope, material=rope)
        out.append(
            Case(
                "rope",
                f"{stiffness:g} N",
                (Asked("EA", "N", stiffness, goal),),
                (5, 10) if quick else (5, 10, 20),
                run_rope,
            )
        )
    for modulus in (2.5e5,) if quick else (5e4, 2.5e5, 1.5e6):
        solid = SolidMaterial(youngs_modulus=modulus)
        asked = (Asked("E", "Pa", modulus, goal), Asked("Poisson contraction", "1", solid.poisson_ratio, goal))
        run_solid = partial(measure_solid, material=solid)
        out.append(Case("solid", f"{modulus:g} Pa", asked, (2,) if quick else (2, 4), run_solid))
    return tuple(out)


TEST = VirtualTest("tensile-strip", "stretch", "across the width (rope: along)", cases)
