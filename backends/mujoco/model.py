"""From a scene to MJCF, and from MJCF to a model that holds the scene's material."""

import warnings
from copy import copy
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from ...core.arrays import FloatArray, IntArray
from ...core.body import Body
from ...core.clamps import clamped_segments
from ...core.material import ClothMaterial, RopeMaterial, SolidMaterial
from ...core.motion import quaternion_of
from ...core.obstacles import StaticMesh
from ...core.plate import bending_matrix, is_flat, rest_folds, rest_stress
from ...core.scene import Scene
from . import rod, shell
from .box import cell_of_elements, frame, quadratic_cells
from .engine import engine
from .obstacles import geoms
from .soft_bending import is_soft
from .stencils import quadruples, spread

if TYPE_CHECKING:
    import mujoco

#: Collision radius of cloth and solids [m], less near thin obstacles, which are made thinner by it: what falls less
#: deep than this is met by distance, which is exact. Deeper, MuJoCo holds a triangle on a mesh at one point only.
RADIUS = 0.003
#: Constraint impedance of contact: a spring that grows stiffer with depth. Its force for a given depth goes with the
#: mass of the vertices, so one value would either let a taut rope sink into a spool or, where it hardly
#: sinks, be lifted off by MuJoCo's cone, which pushes what slides away by about 4 h mu v.
IMPEDANCE = "0.97 0.9995 0.001 0.5 2"
#: How much stiffer friction is than the contact itself. With 1, what should stick creeps a hundred times faster.
FRICTION_STIFFNESS = 100
#: Most iterations of the implicit solve. Few scenes need more than MuJoCo's 100: stiff tetrahedra, and fine
#: meshes with much damping. There it would stop short with a warning.
ITERATIONS = 500
#: Inertia of a held vertex relative to the heaviest one. Held vertices are set to their command after
#: every step; the inertia keeps elastic forces from moving them within the step. They yield
#: by h^2 K + h beta K against it: with too little of it, where an object rests depends on its damping.
HELD_INERTIA = 1e6


@dataclass(frozen=True, eq=False)
class Model:
    """A compiled scene.

    Args:
        model: MuJoCo's, with the material in it.
        stretch: view of the stretch stiffness of every element or cell ``(C, ...)`` in the model.
        cells: which row of ``stretch`` an element has a part in ``(E,)``.
        turn: the axes of the displacements as columns ``(3, 3)``; None: the world's.
        commanded: coordinates of the held vertices ``(3 H,)``, then twists of clamped segments, which stay as they are.
        masses: of every vertex ``(V,)`` [kg], loads included.
        soft_bending: what bending MuJoCo does not know, as a matrix ``(V, V)`` [N/m], or ``(0, 0)``.
        damping_times: of the material of every flex ``(F,)`` [s].
        segments: where the lengths at rest of a rope's segments are in the model ``(E,)``; of others none.
    """

    model: "mujoco.MjModel"
    stretch: FloatArray
    cells: IntArray
    turn: FloatArray | None
    commanded: IntArray
    masses: FloatArray
    soft_bending: FloatArray
    damping_times: FloatArray
    segments: IntArray


def compiled(scene: Scene, time_step: float) -> Model:
    """The model of a scene. Generalised coordinates are vertex displacements from the rest shape, three a vertex.

    Raises:
        ValueError: MuJoCo refuses it.
    """
    body, count = scene.body, len(scene.body.vertices)
    bends = isinstance(scene.material, ClothMaterial) and scene.material.bending_rigidity > 0
    soft, bending, sets = np.zeros((0, 0)), np.zeros((0, 0)), np.zeros((0, 4), np.int64)
    if bends:
        assert isinstance(scene.material, ClothMaterial)
        bending = scene.material.bending_rigidity * bending_matrix(body, scene.held, scene.material.weft_bending_ratio)
        if not is_flat(body):
            folds = rest_folds(body, scene.held, scene.material.weft_bending_ratio)
            bending += rest_stress(body, bending, folds[0], scene.material.bending_rigidity * folds[1])
        bending[np.abs(bending) < 1e-13 * np.abs(bending).max(initial=0.0)] = 0.0
        masses = body.vertex_measures * scene.material.density + scene.loads
        if is_flat(body) and is_soft(bending, masses, scene.held, time_step, scene.material.damping_time):
            soft, bending = bending, soft
        else:
            sets = quadruples(bending, body.vertices)
    dotted = body.kind == "cloth" and any(isinstance(o, StaticMesh) for o in scene.obstacles)
    model = copy(_built(mjcf(scene, time_step, sets), count if dotted else 0, _radius(scene)))
    if model.nv < 3 * count:
        raise ValueError(f"it built {model.nv} coordinates for {count} vertices")
    vertex_bodies = model.dof_bodyid[3 * np.arange(count)]  # in order; the twists of a rope come after them
    if scene.body.kind != "solid" or quadratic_cells(body) is None:
        model.body_mass[vertex_bodies] = np.maximum(body.vertex_measures * scene.material.density, 1e-9)
    model.body_mass[vertex_bodies] += scene.loads
    masses = np.array(model.body_mass[vertex_bodies])
    held = (3 * scene.held[:, None] + np.arange(3)).ravel()
    model.dof_armature[held] = HELD_INERTIA * masses.max()
    clamped = np.zeros(0, np.int64)
    if isinstance(scene.material, RopeMaterial) and model.nv > 3 * count:
        clamped = 3 * count + np.flatnonzero(clamped_segments(body, scene.held))
        model.dof_armature[clamped] = HELD_INERTIA * scene.material.density * scene.material.diameter**2
    stretch, cells = _write_material(model, scene, bending)
    turn = frame(body) if quadratic_cells(body) else np.eye(3)
    turned = None if np.array_equal(turn, np.eye(3)) else turn
    damping_times, segments = np.full(model.nflex, scene.material.damping_time), np.zeros(0, np.int64)
    if isinstance(scene.material, RopeMaterial):
        second = engine().mj_name2id(model, engine().mjtObj.mjOBJ_FLEX, "second")
        damping_times[second] = rod.stretch_damping(body, scene.material, masses, scene.held)
        first_edges = model.flex_elemedge[model.flex_elemedgeadr[second] :][: 3 * len(body.elements) : 3]
        segments = model.flex_edgeadr[second] + first_edges
    return Model(model, stretch, cells, turned, np.concatenate([held, clamped]), masses, soft, damping_times, segments)


@lru_cache(maxsize=4)
def _built(xml: str, spheres: int, radius: float) -> Any:
    """What MuJoCo's compiler makes of ``xml``, to be copied: draws of a study mostly differ in what comes after it.

    MuJoCo holds a triangle on a mesh at one point, its deepest, which goes to and fro between the corners; so there
    ``spheres`` of ``radius`` [m] are put on the vertices, too.
    """
    if not spheres:
        return engine().MjModel.from_xml_string(xml)
    spec = engine().MjSpec.from_string(xml)
    for i in range(spheres):
        size = [radius, 0.0, 0.0]
        spec.body(f"body_{i}").add_geom(
            type=engine().mjtGeom.mjGEOM_SPHERE, size=size, mass=0.0, contype=0, conaffinity=1
        )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # what the other way of compiling tells the handler of the engine
        return spec.compile()


def mjcf(scene: Scene, time_step: float, sets: IntArray) -> str:
    """The whole model; ``sets (N, 4)`` of vertices are joined by bending."""
    body, m = scene.body, scene.material
    radius = _radius(scene)
    # the stiffest contact that a time step allows (solref: time constant, damping ratio)
    touch = f'solref="{2 * time_step:.17g} 1" solimp="{IMPEDANCE}"'
    assets, obstacles = geoms(scene.obstacles, m.friction, 0.0 if scene.contact_radius else radius, touch)
    cells = quadratic_cells(body)
    turn = frame(body) if cells else np.eye(3)
    points = _numbers(body.vertices @ turn)
    elements = " ".join(str(i) for i in body.elements.ravel())
    gravity = " ".join(f"{g:.17g}" for g in scene.gravity)
    parts = f' dof="quadratic" cellcount="{cells[0]} {cells[1]} {cells[2]}"' if cells else ""
    mass = float(body.measures.sum()) * m.density
    fixed = "" if body.kind != "rope" else f'<body name="aside" pos="{_numbers(rod.aside(body))}"/>'
    return f"""
<mujoco>
  <option timestep="{time_step:.17g}" integrator="discrete" solver="Newton" tolerance="1e-8" iterations="{ITERATIONS}"
      cone="elliptic" impratio="{FRICTION_STIFFNESS}" gravity="{gravity}">
    <flag contact="{"enable" if scene.obstacles else "disable"}"/>
  </option>
  <asset>
    {assets}
  </asset>
  <worldbody>
    {fixed}
    <body name="frame" quat="{_numbers(quaternion_of(turn))}">
    <flexcomp name="body" type="direct" dim="{body.elements.shape[1] - 1}"{parts}
        mass="{mass:.17g}" radius="{radius:.17g}" point="{points}" element="{elements}">
      <contact selfcollide="none" contype="2" conaffinity="1"/>
      {_elasticity(scene, flat=not len(sets) or is_flat(body))}
    </flexcomp>
    </body>
    {obstacles}
  </worldbody>
  <deformable>
    {_second_flex(body, m.damping_time, sets)}
  </deformable>
</mujoco>"""


def _radius(scene: Scene) -> float:
    """The collision radius of the object [m]."""
    return scene.contact_radius or min([RADIUS, *(0.5 * o.depth for o in scene.obstacles)])


def _elasticity(scene: Scene, flat: bool) -> str:
    """The ``<elasticity>`` element of the flex.

    The world sets the damping step by step; what is said here decides whether MuJoCo makes room for it.
    """
    m, damping = scene.material, _room(scene.material.damping_time)
    if isinstance(m, ClothMaterial):
        # all of this is overwritten but which arrays there are: hinges of its own only where the rest shape is curved
        kind = "stretch" if flat else "both"
        return f'<elasticity young="1" poisson="0" thickness="1" damping="{damping}" elastic2d="{kind}"/>'
    if isinstance(m, RopeMaterial):
        return f'<elasticity young="1" damping="{damping}"/>'
    return f'<elasticity young="{m.youngs_modulus:.17g}" poisson="{m.poisson_ratio:.17g}" damping="{damping}"/>'


def _room(damping_time: float) -> int:
    """The damping to compile with: the same for all that have some, so that they are compiled once."""
    return int(damping_time > 0)


def _second_flex(body: Body, damping_time: float, sets: IntArray) -> str:
    """A flex on the vertices of the first that carries what that cannot: the bending of cloth, the stretch of rope."""
    if body.kind == "rope":
        last = len(body.vertices)
        names = [*(f"body_{i}" for i in range(last)), "aside"]
        triangles = np.concatenate([np.full((len(body.elements), 1), last), body.elements], axis=1)
        kind = "stretch"
    elif len(sets):
        names = [f"body_{i}" for i in sets.ravel()]
        triangles = (4 * np.arange(len(sets))[:, None, None] + [[0, 1, 2], [1, 0, 3]]).reshape(-1, 3)
        kind = "bend"
    else:
        return ""
    return f"""<flex name="second" dim="2" radius="{RADIUS}" body="{" ".join(names)}"
        element="{" ".join(str(i) for i in triangles.ravel())}">
      <contact selfcollide="none" contype="0" conaffinity="0"/>
      <elasticity young="1" poisson="0" thickness="1" damping="{_room(damping_time)}" elastic2d="{kind}"/>
    </flex>"""


def _write_material(model: Any, scene: Scene, bending: FloatArray) -> tuple[FloatArray, IntArray]:
    """Overwrite the stiffnesses that MuJoCo's compiler made; returns those of stretch, and each element's row in it."""
    body, m = scene.body, scene.material
    flex = {n: engine().mj_name2id(model, engine().mjtObj.mjOBJ_FLEX, n) for n in ("body", "second")}
    elements = np.arange(len(body.elements))
    if isinstance(m, SolidMaterial):
        start = model.flex_stiffnessadr[flex["body"]]
        cells = quadratic_cells(body)
        if cells is None:
            return model.flex_stiffness[start:].reshape(len(elements), -1), elements
        return model.flex_stiffness[start:].reshape(int(np.prod(cells)), -1), cell_of_elements(body, cells)
    carrier = flex["second" if isinstance(m, RopeMaterial) else "body"]
    start = model.flex_stiffnessadr[carrier]
    stretch = model.flex_stiffness[start : start + 21 * len(elements)].reshape(-1, 21)
    if isinstance(m, RopeMaterial):
        stretch[:] = rod.stretch_forms(body, m)
        _write_rod(model, flex["body"], scene, m)
        return stretch, elements
    stretch[:] = shell.stretch_forms(body, m)
    if bending.size:
        values, inner, corners = _hinges(model, flex["second"])
        values[inner, :16] = spread(bending, corners).reshape(-1, 16)
        if model.flex_bendingadr[flex["body"]] >= 0:
            values, inner, corners = _hinges(model, flex["body"])
            folds = rest_folds(body, scene.held, m.weft_bending_ratio)
            values[inner, 16] = m.bending_rigidity * shell.fold_weights(corners, *folds)
    return stretch, elements


def _hinges(model: Any, flex: int) -> tuple[FloatArray, IntArray, IntArray]:
    """Zeroed bending of a flex's edges, a view ``(N, 17)``; the inner ones; their vertices ``(I, 4)``, edge first.

    MuJoCo's force of a hinge is minus its 4 x 4 matrix times the positions, and minus its last number times the
    gradient of det(x1 - x0, x2 - x0, x3 - x0).
    """
    edges = slice(model.flex_edgeadr[flex], model.flex_edgeadr[flex] + model.flex_edgenum[flex])
    start = model.flex_bendingadr[flex]
    values = model.flex_bending[start : start + 17 * model.flex_edgenum[flex]].reshape(-1, 17)
    values[:] = 0.0
    inner = np.flatnonzero(model.flex_edgeflap[edges, 1] >= 0)
    corners = np.concatenate([model.flex_edge[edges][inner], model.flex_edgeflap[edges][inner]], axis=1)
    first = model.flex_vertadr[flex]
    vertices = model.body_dofadr[model.flex_vertbodyid[first : first + model.flex_vertnum[flex]]] // 3
    return values, inner, vertices[corners]


def _write_rod(model: Any, flex: int, scene: Scene, material: RopeMaterial) -> None:
    """Bending and torsion of a rod."""
    if len(scene.body.elements) < 2:
        return
    start = model.flex_bendingadr[flex] + 1  # first comes how many records there are
    records = model.flex_bending[start : start + 10 * (len(scene.body.vertices) - 2)].reshape(-1, 10)
    bend, twist = rod.hinge_stiffnesses(scene.body, material, scene.held)
    records[:, 4], records[:, 5], records[:, 8] = bend, 0.0, twist


def _numbers(values: FloatArray) -> str:
    return " ".join(f"{x:.17g}" for x in np.ravel(values))
