"""Sag: of a cloth or rope between two supports, and of a solid beam."""

from functools import partial

import numpy as np

from ..arrays import FloatArray
from ..body import rope_line
from ..material import ClothMaterial, RopeMaterial, SolidMaterial
from ..scenario import STANDARD_GRAVITY
from ..scene import Scene
from .case import GOALS, Asked, Case, VirtualTest
from .closed_forms import cable_sag, thick_beam_sag
from .lab import Lab
from .meshes import strip
from .swinging import asked_beam, beam

_LENGTH, _WIDTH = 0.5, 0.05
#: How long the supports take to come together [s].
_APPROACH = 0.5
#: Sag of a solid beam over its length, by choice of gravity: small, as the closed form has it.
_BEAM_SAG = 0.02


def cable(kind: str, stiffness: float) -> ClothMaterial | RopeMaterial:
    """A limp material of so much stretch stiffness [N/m, N]."""
    if kind == "cloth":
        return ClothMaterial(stretch_stiffness=stiffness, bending_rigidity=1e-7)
    return RopeMaterial(stretch_stiffness=stiffness, bending_rigidity=1e-7, twist_rigidity=1e-7)


def asked_sag(kind: str, stiffness: float, span: float) -> float:
    """Sag [m]; of cloth per width."""
    return cable_sag(span, _LENGTH, cable(kind, stiffness).density * STANDARD_GRAVITY, stiffness)


def measure_cable(lab: Lab, cells: int, kind: str, stiffness: float, span: float) -> tuple[float]:
    """Sag [m] in the middle. It starts straight, and its ends come together while it is braked."""
    half = _LENGTH / 2
    if kind == "rope":
        body = rope_line(np.array([[-half, 0, 0], [half, 0, 0]]), cells + 1)
    else:
        body = strip(-half, half, _WIDTH, (cells, max(1, cells // 10)))
    x = body.vertices[:, 0]
    ends = np.flatnonzero(np.abs(np.abs(x) - half) < 1e-9)
    gravity = np.array([0.0, 0.0, -STANDARD_GRAVITY])
    scene = Scene(body, cable(kind, stiffness), gravity, (ends,), np.zeros(len(x)))

    def lead(time: float) -> FloatArray:
        place = body.vertices[ends].copy()
        place[:, 0] *= 1.0 + (span / _LENGTH - 1.0) * min(time / _APPROACH, 1.0)
        return place

    asked = asked_sag(kind, stiffness, span)
    pace = np.pi * np.sqrt(STANDARD_GRAVITY / (8 * asked))
    rest = lab.settle(scene, pace, 5e-4 * asked, lead=lead, busy=_APPROACH)
    return (-float(rest[np.abs(x) < 1e-9, 2].mean()),)


def asked_beam_gravity(material: SolidMaterial) -> float:
    """Gravity [m/s2] in which the beam sags by its share of the length."""
    _, length, side = beam(1)
    one = thick_beam_sag(length, side, material.youngs_modulus, material.poisson_ratio, material.density * side**2)
    return _BEAM_SAG * length / one


def measure_beam(lab: Lab, cells: int, material: SolidMaterial) -> tuple[float]:
    """Sag [mm] of the tip of a solid beam with one end face held."""
    body, length, _ = beam(cells)
    x = body.vertices[:, 0]
    gravity = np.array([0.0, 0.0, -asked_beam_gravity(material)])
    scene = Scene(body, material, gravity, (np.flatnonzero(x < 1e-9),), np.zeros(len(x)))
    rest = lab.settle(scene, 2 * np.pi / asked_beam(material), 2e-4 * _BEAM_SAG * length)
    tip = x > length - 1e-9
    return (-1e3 * float((rest - body.vertices)[tip, 2].mean()),)


def cases(quick: bool) -> tuple[Case, ...]:
    """Cables slack and taut, stiff and stretchy; beams from soft to stiff."""
    out = []
    meshes = (10, 20) if quick else (10, 20, 40)
    for kind, stiff, loose, unit in (("cloth", 300.0, 20.0, "N/m"), ("rope", 100.0, 5.0, "N")):
        for stiffness, share in ((stiff, 0.8), (loose, 0.95)) if quick else ((stiff, 0.6), (stiff, 0.9), (loose, 0.95)):
            span = share * _LENGTH
            asked = (Asked("sag", "m", asked_sag(kind, stiffness, span), GOALS["sag"]),)
            run = partial(measure_cable, kind=kind, stiffness=stiffness, span=span)
            out.append(Case(kind, f"{stiffness:g} {unit}, span {share:g} L", asked, meshes, run))
    _, length, _ = beam(1)
    for modulus in (2.5e5,) if quick else (5e4, 2.5e5, 1.5e6):
        solid = SolidMaterial(youngs_modulus=modulus)
        asked = (Asked("sag", "mm", 1e3 * _BEAM_SAG * length, GOALS["sag"]),)
        out.append(
            Case("solid", f"{modulus:g} Pa", asked, (2,) if quick else (2, 4), partial(measure_beam, material=solid))
        )
    return tuple(out)


TEST = VirtualTest("sag", "sag", "along the cable (solid: across)", cases)
