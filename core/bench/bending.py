"""Bending under weight: the cantilever after Peirce.

Where exactly a mesh is clamped by two held rows is known to half a cell only, which shifts the measured rigidity by
two cells over the length. So the strip lies across a single held row in its middle, and both arms hang: the slope
is zero there by symmetry, exactly, on any mesh. One case holds two rows all the same, as a gripper does, with the
overhang counted from the second: the difference is the error of the clamp, and goes away with the mesh.
"""

from functools import partial

import numpy as np

from ..body import Body, rope_line
from ..material import ClothMaterial, RopeMaterial
from ..scenario import STANDARD_GRAVITY
from ..scene import Scene
from .case import GOALS, Asked, Case, VirtualTest
from .closed_forms import BEAM_ROOT
from .elastica import rigidity, tip_drop
from .lab import Lab
from .meshes import Style, strip

_DOWN = np.array([0.0, 0.0, -STANDARD_GRAVITY])
#: A strip is as many times as long as wide.
SLENDERNESS = 3
#: Stretch stiffness of strips and ropes [N/m, N]: their own weight stretches them by 0.3 % at most, and explicit
#: engines need not creep.
STRETCH = 100.0


def overhang(bending_rigidity: float, density: float, lengths: float) -> float:
    """Overhang [m] of so many bending lengths c = (B / w)^(1/3) (Peirce, J. Textile Inst. 21 (1930) T377).

    At two, Peirce's own choice, the chord to the tip hangs by about 41.5 degrees.
    """
    return float(lengths * np.cbrt(bending_rigidity / (density * STANDARD_GRAVITY)))


def delivered(lab: Lab, body: Body, material: ClothMaterial | RopeMaterial, length: float, asked: float) -> float:
    """Bending rigidity [N m, N m2] from how far the ends at x = +-``length`` come to hang below x = 0.

    Vertices at x <= 0 are held, or at x = 0 alone if the body has two arms; ``asked`` tells how fast to damp.
    """
    x = body.vertices[:, 0]
    held = np.abs(x) < 1e-9 if x.min() < -0.9 * length else x < 1e-9
    weight = material.density * STANDARD_GRAVITY
    pace = max(BEAM_ROOT**2 * np.sqrt(asked / material.density) / length**2, np.sqrt(STANDARD_GRAVITY / length))
    scene = Scene(body, material, _DOWN, (np.flatnonzero(held),), np.zeros(len(x)))
    rest = lab.settle(scene, pace, 2e-4 * length * tip_drop(weight * length**3 / asked))
    return rigidity(-float(rest[np.abs(np.abs(x) - length) < 1e-9, 2].mean()), length, weight)


def measure_cloth(
    lab: Lab, cells: int, material: ClothMaterial, asked: float, lengths: float, style: Style, clamp: str, turned: bool
) -> tuple[float]:
    """D [N m] of a strip, from the heavy elastica.

    Poisson's ratio of the material must be zero, so that a strip is as rigid as a plate: between them a factor of
    1 - nu^2 would depend on the width (Searle, Experimental Elasticity, 1908; Ashwell 1950).
    """
    length = overhang(asked, material.areal_density, lengths)
    arms, width = cells if clamp == "middle row" else 1, length / SLENDERNESS
    body = strip(-length * arms / cells, length, width, (arms + cells, cells // SLENDERNESS), style)
    if turned:
        edges = body.vertices[body.elements[:, 1:], :2] - body.vertices[body.elements[:, :1], :2]
        across = np.linalg.solve(edges.transpose(0, 2, 1), np.array([[[0.0], [1.0]]]))[:, :, 0]
        body = Body("cloth", body.vertices, body.elements, warp=across)
    return (delivered(lab, body, material, length, asked),)


def measure_rope(lab: Lab, cells: int, material: RopeMaterial, lengths: float) -> tuple[float]:
    """EI [N m2] of a rope held in its middle, from the heavy elastica."""
    length = overhang(material.bending_rigidity, material.linear_density, lengths)
    body = rope_line(np.array([[-length, 0, 0], [0.0, 0, 0], [length, 0, 0]]), 2 * cells + 1)
    return (delivered(lab, body, material, length, material.bending_rigidity),)


def cases(quick: bool) -> tuple[Case, ...]:
    """Sheets of 10^-6 to 10^-3 N m hanging a little and much, on three kinds of mesh, and woven; ropes."""
    goal, out = GOALS["bending"], []
    meshes = (6, 12) if quick else (6, 12, 24)
    soft, stiff = 1e-5, 1e-3
    wanted: list[tuple[float, float, Style, str]] = [
        (d, 2.0, "grid", "middle row") for d in ((soft, stiff) if quick else (1e-6, soft, 1e-4, stiff))
    ]
    wanted += [(stiff, 1.0, "grid", "middle row"), (stiff, 2.0, "irregular", "middle row")]
    if not quick:
        wanted += [(soft, 2.0, "diagonal", "middle row"), (soft, 2.0, "irregular", "middle row")]
        wanted += [(soft, 2.0, "grid", "two rows"), (stiff, 2.0, "diagonal", "middle row")]
        wanted += [(soft, 1.0, "grid", "middle row")]
    for rigid, lengths, style, clamp in wanted:
        cloth = ClothMaterial(stretch_stiffness=STRETCH, bending_rigidity=rigid, poisson_ratio=0.0)
        run = partial(
            measure_cloth, material=cloth, asked=rigid, lengths=lengths, style=style, clamp=clamp, turned=False
        )
        label = f"{rigid:g} N m, {lengths:g} c, {style} mesh" + ("" if clamp == "middle row" else f", {clamp} held")
        out.append(Case("cloth", label, (Asked("D", "N m", rigid, goal),), meshes, run))
    woven = ClothMaterial(stretch_stiffness=STRETCH, bending_rigidity=1e-4, poisson_ratio=0.0, weft_bending_ratio=4.0)
    woven_cuts = (("warp", 5e-5, False), ("weft", 2e-4, True))
    for name, rigid, turned in woven_cuts[1:] if quick else woven_cuts:
        run = partial(
            measure_cloth, material=woven, asked=rigid, lengths=2.0, style="grid", clamp="middle row", turned=turned
        )
        out.append(Case("cloth", f"woven, {name}", (Asked("D", "N m", rigid, goal),), meshes, run))
    ropes = ((1e-6, 2.0), (1e-4, 1.0), (1e-4, 2.0), (1e-2, 2.0))
    for rigid, lengths in ropes[2:3] if quick else ropes:
        rope = RopeMaterial(stretch_stiffness=STRETCH, bending_rigidity=rigid, twist_rigidity=rigid)
        run_rope = partial(measure_rope, material=rope, lengths=lengths)
        out.append(
            Case("rope", f"{rigid:g} N m2, {lengths:g} c", (Asked("EI", "N m2", rigid, goal),), meshes, run_rope)
        )
    return tuple(out)


TEST = VirtualTest("cantilever", "bending", "along the overhang", cases)
