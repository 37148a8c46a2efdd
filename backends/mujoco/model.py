"""From a scene to MJCF: which flex stands for which material."""

import numpy as np

from ...core.body import Body
from ...core.material import ClothMaterial, SolidMaterial
from ...core.obstacles import Table
from ...core.scene import Scene

#: Collision radius of a vertex [m]; not the shell's elastic thickness, which comes from the material.
RADIUS = 0.001
#: Most iterations of the implicit solve. Few scenes need more than MuJoCo's 100: stiff tetrahedra, and fine
#: meshes with much damping. There it would stop short with a warning.
ITERATIONS = 500


def shell_thickness(material: ClothMaterial) -> float:
    """Thickness t [m] at which a shell of modulus E = (E t) / t has bending rigidity D.

    From D = E t^3 / (12 (1 - nu^2)), the Kirchhoff plate: t = sqrt(12 (1 - nu^2) D / (E t)).
    """
    nu = material.poisson_ratio
    return float(np.sqrt(12.0 * (1.0 - nu**2) * material.bending_rigidity / material.stretch_stiffness))


def quadratic_cells(body: Body) -> tuple[int, int, int] | None:
    """Cells of a quadratic flex whose nodes are exactly the vertices of a regular box, if there are such."""
    if body.kind != "solid" or body.grid is None or len(body.grid) != 3 or any(n % 2 == 0 for n in body.grid):
        return None
    cells = tuple((n - 1) // 2 for n in body.grid)
    return (cells[0], cells[1], cells[2])


def elasticity(scene: Scene, time_step: float) -> str:
    """The ``<elasticity>`` element of the flex.

    The ``discrete`` integrator is a linearly implicit Euler scheme: for a step h it damps a mode of
    angular frequency w at the rate h w^2 / 2 [1/s], as a stiffness-proportional damping of time h
    would. Solids get damping_time - h / 2 instead of damping_time, which halves that. More cannot be
    taken off: the linear scheme with damping -c h is stable for every frequency only if c <= 1/2
    (its trace and determinant, 1 + (1 - x) / (1 + (1 - c) x) and 1 / (1 + (1 - c) x) with x = (h w)^2,
    must satisfy |trace| < 1 + determinant). Shells keep the full damping: they buckle, and the
    argument is linear.
    """
    m = scene.material
    if isinstance(m, ClothMaterial):
        t = shell_thickness(m)
        bends = m.bending_rigidity > 0
        t = t if bends else 1e-4
        return (
            f'<elasticity young="{m.stretch_stiffness / t:.17g}" poisson="{m.poisson_ratio:.17g}" '
            f'thickness="{t:.17g}" damping="{m.damping_time:.17g}" elastic2d="{"both" if bends else "stretch"}"/>'
        )
    assert isinstance(m, SolidMaterial)
    return (
        f'<elasticity young="{m.youngs_modulus:.17g}" poisson="{m.poisson_ratio:.17g}" '
        f'damping="{m.damping_time - time_step / 2:.17g}"/>'
    )


def mjcf(scene: Scene, time_step: float) -> str:
    """The whole model. Vertices are given in the world frame; every one becomes a body with three slides."""
    body, m = scene.body, scene.material
    cells = quadratic_cells(body)
    parts = f' dof="quadratic" cellcount="{cells[0]} {cells[1]} {cells[2]}"' if cells else ""
    tables = [o for o in scene.obstacles if isinstance(o, Table)]
    contact = bool(tables)
    # the stiffest contact that a time step allows (solref: time constant, damping ratio)
    # vertices collide as spheres: a table lower by their radius carries the vertices themselves at its height
    touch = (
        f'friction="{m.friction * (tables[0].friction if tables else 1.0):.17g} 0 0" solref="{2 * time_step:.17g} 1"'
    )
    height = (tables[0].height if tables else 0.0) - RADIUS
    table = f'<geom type="plane" size="5 5 0.1" pos="0 0 {height:.17g}" {touch}/>' if contact else ""
    points = " ".join(f"{x:.17g}" for x in body.vertices.ravel())
    elements = " ".join(str(i) for i in body.elements.ravel())
    gravity = " ".join(f"{g:.17g}" for g in scene.gravity)
    return f"""
<mujoco>
  <option timestep="{time_step:.17g}" integrator="discrete" solver="Newton" tolerance="1e-8" iterations="{ITERATIONS}"
      gravity="{gravity}">
    <flag contact="{"enable" if contact else "disable"}"/>
  </option>
  <worldbody>
    {table}
    <flexcomp name="body" type="direct" dim="{2 if body.kind == "cloth" else 3}"{parts}
        mass="{float(body.measures.sum()) * m.density:.17g}" radius="{RADIUS}" point="{points}" element="{elements}">
      <contact selfcollide="none" condim="3" {touch}/>
      {elasticity(scene, time_step)}
    </flexcomp>
  </worldbody>
</mujoco>"""
