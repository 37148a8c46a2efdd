"""Whether tables, cylinders and meshes carry an object: at their surface, with the friction of both."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ..arrays import FloatArray
from ..body import Body, rope_line, solid_box
from ..material import Material
from ..obstacles import Cylinder, Obstacle, StaticMesh, Table
from ..scenario import STANDARD_GRAVITY
from ..scene import Scene
from ..simulator import World
from .checks import must
from .samples import sample_body
from .worlds import MakeSimulator, damped, with_world

#: Height of the surfaces [m], and friction of the obstacles [1]: with the material's 0.3, a coefficient of 0.45.
TOP, ROUGH = 1.0, 1.5
COEFFICIENT = 0.3 * ROUGH

Run = Callable[[MakeSimulator, str], None]


def _box() -> Obstacle:
    """A block of 60 x 60 x 30 cm of twelve triangles."""
    body = solid_box(np.array([-0.3, -0.3, TOP - 0.3]), np.array([0.3, 0.3, TOP]), (2, 2, 2))
    return StaticMesh(body.vertices, body.triangles, ROUGH)


#: By the capability that each needs; all are highest at x = y = 0, and nowhere else for the cylinder along x.
OBSTACLES: dict[str, Callable[[], Obstacle]] = {
    "table": lambda: Table(TOP, ROUGH),
    "cylinder": lambda: Cylinder(np.array([0.0, 0.0, TOP - 0.5]), np.array([1.0, 0.0, 0.0]), 0.5, 2.0, ROUGH),
    "static-mesh": _box,
}


def _lying(kind: str, height: float) -> tuple[Body, Material]:
    """The sample laid flat over the origin, its lowest part at ``height`` [m]."""
    material = damped(kind)
    body = sample_body(kind)
    if kind == "cloth":
        x, y = np.meshgrid(np.linspace(-0.06, 0.06, 4), np.linspace(0.045, -0.045, 3))
        flat = np.stack([x.ravel(), y.ravel(), np.full(12, height)], axis=1)
        return replace(body, vertices=flat, warp=None), material
    if kind == "rope":
        return rope_line(np.array([[-0.075, 0.0, height], [0.075, 0.0, height]]), 6), material
    return solid_box(np.array([-0.03, -0.03, height]), np.array([0.03, 0.03, height + 0.06]), (3, 3, 3)), material


def _scene(name: str, kind: str, slope: float = 0.0, drop: float = 0.0) -> Scene:
    """The sample on an obstacle, gravity leaning towards x by ``slope``, let go ``drop`` [m] above it."""
    body, material = _lying(kind, TOP)
    material = replace(material, friction=0.3)
    obstacle = OBSTACLES[name]()
    gravity = np.array([slope * STANDARD_GRAVITY, 0.0, -STANDARD_GRAVITY])
    scene = Scene(body, material, gravity, (), np.zeros(len(body.vertices)), (obstacle,))
    lift = np.array([0.0, 0.0, scene.contact_radius + drop])
    return replace(scene, body=replace(body, vertices=body.vertices + lift))


def landing(name: str) -> Callable[[str], Scene]:
    """The scene that needs obstacle ``name``, by kind."""
    return lambda kind: _scene(name, kind)


def _watch(world: World, duration: float) -> FloatArray:
    """Mean velocities ``(N, 3)`` [m/s], weighted by mass, after every step."""
    share = world.masses / world.masses.sum()
    path = []
    for _ in range(round(duration / world.time_step)):
        world.step(np.zeros((0, 3)), None)
        path.append(share @ world.state().velocities)
    return np.array(path)


def carries(name: str) -> Run:
    """Let go 1 cm above it, the object comes to lie on the surface: no lower, and no higher, than 2 mm."""

    def check(make: MakeSimulator, kind: str) -> None:
        scene = _scene(name, kind, drop=0.01)

        def look(world: World) -> None:
            _watch(world, 0.5)
            away = scene.obstacles[0].signed_distance(world.state().positions)[0] - scene.contact_radius
            lowest = float(away.min())
            must(abs(lowest) < 2e-3, f"after 0.5 s the nearest vertex is {1e3 * lowest:.1f} mm above the {name}")

        with_world(make(), scene, look)

    return check


def sticks(name: str) -> Run:
    """Below the angle of friction it stays: it moves by less than a twentieth of what it would without friction."""

    def check(make: MakeSimulator, kind: str) -> None:
        scene, slope = _scene(name, kind, slope=0.55 * COEFFICIENT), 0.55 * COEFFICIENT

        def look(world: World) -> None:
            moved = float(_watch(world, 0.3).sum(axis=0)[0] * world.time_step)
            free = 0.5 * slope * STANDARD_GRAVITY * 0.3**2
            must(
                abs(moved) < 0.05 * free,
                f"on a slope of {slope:.2f}, with a coefficient of {COEFFICIENT:g}, it slides {1e3 * moved:.1f} mm "
                f"in 0.3 s; without friction it would be {1e3 * free:.0f} mm",
            )

        with_world(make(), scene, look)

    return check


def slides(name: str) -> Run:
    """Above it, it slides with g (slope - coefficient), to 15 %: the coefficients of both have been multiplied."""

    def check(make: MakeSimulator, kind: str) -> None:
        slope = 2.0 * COEFFICIENT
        scene = _scene(name, kind, slope=slope)

        def look(world: World) -> None:
            speed = _watch(world, 0.25)[:, 0]
            early = round(0.1 / world.time_step)
            got = float(speed[-1] - speed[early - 1]) / ((len(speed) - early) * world.time_step)
            wanted = STANDARD_GRAVITY * (slope - COEFFICIENT)
            must(
                abs(got / wanted - 1.0) < 0.15,
                f"on a slope of {slope:.2f}, with a coefficient of {COEFFICIENT:g}, it gains {got:.2f} m/s2, "
                f"not {wanted:.2f}",
            )

        with_world(make(), scene, look)

    return check


def check_contact_forces(make: MakeSimulator, kind: str) -> None:
    """The forces of a table are zero in the air, and make up for what weight alone does not explain, to 3 %.

    While it lands and lies, their impulse is the change of momentum less that of gravity; lying, they sum to
    the weight.
    """
    scene = _scene("table", kind, drop=0.02)

    def look(world: World) -> None:
        mass = world.masses.sum()
        impulse = np.zeros(3)
        for k in range(round(0.4 / world.time_step)):
            world.step(np.zeros((0, 3)), None)
            forces = world.state().contact_forces()
            must(forces.shape == scene.body.vertices.shape, f"contact forces have shape {forces.shape}")
            if (k + 1) * world.time_step < 0.04:
                must(not forces.any(), "there are contact forces while nothing touches the table yet")
            impulse += forces.sum(axis=0) * world.time_step
        duration = round(0.4 / world.time_step) * world.time_step
        gained = world.masses @ world.state().velocities
        missing = gained - mass * scene.gravity * duration - impulse
        share = float(np.linalg.norm(missing)) / (mass * STANDARD_GRAVITY * duration)
        must(share < 0.03, f"over 0.4 s contact forces miss {share:.1%} of the impulse of the weight")

    with_world(make(), scene, look)
