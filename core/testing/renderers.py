"""The conformance kit of renderers: what is drawn must be where :class:`~muslin.core.camera.Camera` puts it."""

from collections.abc import Callable
from functools import partial

import numpy as np

from ..arrays import BoolArray, FloatArray
from ..body import Body, cloth_grid, rope_line
from ..camera import Camera
from ..material import ClothMaterial, RopeMaterial
from ..obstacles import Cylinder, Obstacle, StaticMesh, Table
from ..picture import BACKGROUND, OBJECT, OBSTACLE, Appearance, DepthImage, Frame, Image, Light
from ..renderer import Renderer
from ..scene import Scene
from .checks import Check, check_leaves_random_state, check_pickles, must, raise_failures

MakeRenderer = Callable[[], Renderer]

#: Depth is right to this where the surface is flat [m].
EXACT = 0.001
#: Outlines are right to this [px].
OUTLINE = 1.5
_SIZE = 0.3
#: Neither square nor centred: the focal lengths differ and the principal point is off the middle.
_LENS = (112, 80, 100.0, 84.0, 60.0, 34.0)
_QUARTERS = ((200, 30, 30), (30, 180, 40), (40, 40, 210), (220, 200, 60))


def check_renderer(make: MakeRenderer) -> None:
    """Hold a renderer against everything that muslin relies on.

    Args:
        make: builds the renderer; its class, if all options have defaults.

    Raises:
        AssertionError: lists every broken promise.
    """
    raise_failures("the renderer", renderer_checks(make))


def renderer_checks(make: MakeRenderer) -> list[Check]:
    """The checks of :func:`check_renderer`, one a promise."""
    checks = {
        "declares itself and can draw on this machine": check_declares,
        "draws a sheet in the pixels and at the depth where it is": check_sheet,
        "draws what reaches behind the camera": check_clipped,
        "draws both sides of a sheet": check_both_sides,
        "draws a rope as thick as it is": check_rope,
        "lets obstacles hide the object, and be hidden": check_hiding,
        "draws a table to the horizon": check_table,
        "lays a texture upright": check_texture,
        "lights by ambient and diffuse light": check_light,
        "shows only the background where nothing is": check_nothing,
        "draws the same again, in another size between": check_repeats,
    }
    return [Check(title, partial(check, make)) for title, check in checks.items()]


def check_declares(make: MakeRenderer) -> None:
    """Name, and whether it works here; travels to worker processes."""
    renderer = make()
    must(isinstance(renderer, Renderer), f"{type(renderer).__name__} is not a muslin.core Renderer")
    must(isinstance(renderer.name, str) and renderer.name, "name must be a text")
    must(renderer.problem() == "", f"it cannot draw on this machine: {renderer.problem()}")
    copy = check_pickles(renderer, "the renderer")
    must(type(copy) is type(renderer), "a pickled copy is of another class")


def check_sheet(make: MakeRenderer) -> None:
    """A tilted sheet before a lens that is neither square nor centred."""
    for eye in ((0.1, -0.7, 0.2), (-0.5, -0.4, 0.5)):
        camera = _camera(eye)
        frame = _draw(make, _sheet(), camera)
        _must_show_plane(frame, camera, np.array([0.0, -1.0, 0.0]), 0.0)
        inner = np.abs(_sheet().vertices[:, [0, 2]]).max(axis=1) < 0.49 * _SIZE
        pixels, depth = camera.project(_sheet().vertices[inner])
        off = np.abs(_between(frame.depth, pixels) - depth).max()
        must(off < EXACT, f"the depth at the pixel of a vertex is off by {off:.4f} m")


def check_clipped(make: MakeRenderer) -> None:
    """A floor that begins behind the camera still fills the lower part of the picture."""
    floor = _sheet(20.0)
    turned = Body("cloth", floor.vertices[:, [0, 2, 1]] * [1.0, 1.0, 0.0] + [0.0, 10.0, 0.0], floor.elements)
    camera = Camera.look_at(np.array([0.0, 0.0, 0.3]), np.array([0.0, 1.0, 0.0]), width=64, height=48)
    frame = _draw(make, turned, camera)
    seen = frame.segmentation == OBJECT
    must(seen[-1].all(), "a sheet that reaches behind the camera is not drawn up to the edge of the picture")
    depth = -camera.pose[2] / camera.rays[..., 2]
    off = np.abs(frame.depth - depth)[seen].max()
    must(off < 0.01, f"its depth is off by {off:.4f} m")


def check_both_sides(make: MakeRenderer) -> None:
    """The sheet seen from behind covers as much."""
    ahead, behind = (_draw(make, _sheet(), _camera((0.0, y, 0.0))) for y in (-0.7, 0.7))
    areas = [int((f.segmentation == OBJECT).sum()) for f in (ahead, behind)]
    must(min(areas) > 0.9 * max(areas), f"the front of a sheet covers {areas[0]} pixels, its back {areas[1]}")


def check_rope(make: MakeRenderer) -> None:
    """A rope hanging straight down is as wide as its diameter and as long as it is."""
    body = rope_line(np.array([[0.0, 0.0, 0.15], [0.0, 0.0, -0.15]]), 9)
    camera = Camera.look_at(np.array([0.0, -0.6, 0.0]), np.zeros(3), width=160, height=160)
    frame = _draw(make, body, camera, diameter=0.04)
    seen = frame.segmentation == OBJECT
    expected = 0.04 / 0.6 * camera.fx
    width = seen[80].sum()
    must(abs(width - expected) < OUTLINE, f"a rope {expected:.1f} px thick is drawn {width} px thick")
    length = seen[:, 80].sum()
    expected = 0.3 / 0.6 * camera.fx
    must(abs(length - expected) < 3 * OUTLINE, f"a rope {expected:.1f} px long is drawn {length} px long")
    nearest = float(np.nanmin(frame.depth))
    must(abs(nearest - 0.58) < 2 * EXACT, f"the near side of the rope is at 0.58 m, but drawn at {nearest:.4f} m")


def check_hiding(make: MakeRenderer) -> None:
    """Of a rod before the sheet and a block behind it, the rod hides the sheet and the sheet the block."""
    rod = Cylinder(np.array([0.0, -0.2, 0.0]), np.array([1.0, 0.0, 0.0]), 0.02, 1.0)
    block = _block(np.array([-0.1, 0.1, -0.1]), np.array([0.1, 0.2, 0.1]))
    camera = _camera((0.0, -0.7, 0.0))
    frame = _draw(make, _sheet(), camera, obstacles=(rod, block))
    pixels, _ = camera.project(np.array([[0.0, -0.2, 0.0], [0.0, 0.0, 0.08]]))
    (u, v), (across, up) = np.rint(pixels).astype(int)
    must(frame.segmentation[v, u] == OBSTACLE, "an obstacle before the object does not hide it")
    off = abs(float(frame.depth[v, u]) - 0.48)
    must(off < 3 * EXACT, f"the depth of an obstacle is off by {off:.4f} m")
    must(frame.segmentation[up, across] == OBJECT, "the object does not hide an obstacle behind it")
    must(not (frame.segmentation == OBSTACLE + 1).any(), "an obstacle behind the object shows through")
    far = _draw(make, _sheet(), camera, obstacles=(rod, block), shift=np.array([0.0, 0.6, 0.0]))
    must((far.segmentation == OBSTACLE + 1).any(), "an obstacle before the object is not drawn")


def check_table(make: MakeRenderer) -> None:
    """A table has the depth of its plane, and hides what is below it."""
    camera = _camera((0.0, -0.7, 0.2))
    frame = _draw(make, _sheet(), camera, obstacles=(Table(-0.05),))
    table = frame.segmentation == OBSTACLE
    must(table[-1].all(), "the table does not reach the lower edge of the picture")
    off = np.abs(frame.depth - (-0.05 - camera.pose[2]) / camera.rays[..., 2])[table].max()
    must(off < EXACT, f"the depth of the table is off by {off:.4f} m")
    sheet = camera.pose[2] + frame.depth * camera.rays[..., 2]
    low = float(np.nanmin(sheet[frame.segmentation == OBJECT]))
    must(low > -0.06, f"the sheet is seen {-0.05 - low:.3f} m below the top of the table")


def check_texture(make: MakeRenderer) -> None:
    """The four quarters of a texture lie where the quarters of the sheet are: u right, v down."""
    texture = np.zeros((32, 32, 3), np.uint8)
    texture[:16, :16], texture[:16, 16:], texture[16:, :16], texture[16:, 16:] = _QUARTERS
    camera = _camera((0.0, -0.7, 0.0))
    frame = _draw(make, _sheet(), camera, Appearance(object=texture, light=Light(ambient=1.0, diffuse=0.0)))
    for k, (x, z) in enumerate(((-0.07, 0.07), (0.07, 0.07), (-0.07, -0.07), (0.07, -0.07))):
        u, v = np.rint(camera.project(np.array([x, 0.0, z]))[0]).astype(int)
        off = np.abs(frame.rgb[v, u].astype(int) - _QUARTERS[k]).max()
        must(off <= 3, f"quarter {k} of a texture shows {frame.rgb[v, u].tolist()}, not {list(_QUARTERS[k])}")


def check_light(make: MakeRenderer) -> None:
    """Colour times (ambient + diffuse * cosine), and ambient alone on the side that faces away."""
    towards = np.array([0.6, -0.8, 0.0])
    look = Appearance(object=(200, 100, 50), light=Light((0.6, -0.8, 0.0), 0.3, 0.5))
    for side in (-1.0, 1.0):
        camera = _camera((0.4, 0.6 * side, 0.2))  # aslant, so that the lamp has to turn with the camera
        frame = _draw(make, _sheet(), camera, look)
        u, v = np.rint(camera.project(np.zeros(3))[0]).astype(int)
        expected = np.array([200, 100, 50]) * (0.3 + 0.5 * max(0.0, side * towards[1]))
        off = np.abs(frame.rgb[v, u] - expected).max()
        must(off <= 3, f"a lit sheet shows {frame.rgb[v, u].tolist()}, not {np.rint(expected).tolist()}")


def check_nothing(make: MakeRenderer) -> None:
    """The background is untouched around the object, and fills the picture of a camera that looks away."""
    picture = np.random.default_rng(3).integers(0, 255, (80, 112, 3), np.uint8)
    look = Appearance(background=picture)
    for eye, target, full in (((0.0, -0.9, 0.0), np.zeros(3), False), ((0, -0.7, 0.0), np.array([0, -2.0, 0]), True)):
        frame = _draw(make, _sheet(), _camera(eye, target), look)
        empty = frame.segmentation == BACKGROUND
        must(empty.all() == full, "the object is drawn where it is not, or is not drawn at all")
        must((frame.rgb[empty] == picture[empty]).all(), "the background is not the picture that was given")
        must(np.isnan(frame.depth[empty]).all(), "the background has a depth")
        must(np.isfinite(frame.depth[~empty]).all(), "the object has pixels without depth")


def check_repeats(make: MakeRenderer) -> None:
    """The same frame is the same bit for bit: at once, after another, and in a new view."""
    scene, camera = _scene(_sheet()), _camera((0.1, -0.7, 0.2))
    vertices = scene.body.vertices
    frames: list[Frame] = []

    def shoot() -> None:
        with make().open(scene) as view:
            frames.append(view.render(vertices, camera))
            view.render(vertices * 0.5, Camera.look_at(np.array([0.0, -1.0, 0.0]), np.zeros(3), width=50, height=130))
            frames.append(view.render(vertices, camera))

    check_leaves_random_state(shoot)
    shoot()
    for frame in frames[1:]:
        same = [np.array_equal(a, b, equal_nan=True) for a, b in zip(_arrays(frames[0]), _arrays(frame), strict=True)]
        must(all(same), "the same vertices and camera give another picture")


def _must_show_plane(frame: Frame, camera: Camera, normal: FloatArray, offset: float) -> None:
    """The sheet must be seen wherever a ray meets it, and its depth be that of the plane normal . x = offset."""
    depth = (offset - normal @ camera.pose[:3]) / (camera.rays @ normal)
    where = camera.pose[:3] + depth[..., None] * camera.rays
    half = 0.5 * _SIZE
    slack = OUTLINE * float(depth[np.abs(where[..., [0, 2]]).max(axis=-1) < half].max()) / min(camera.fx, camera.fy)
    # a pixel is wider on a surface that is seen aslant
    slack /= abs(float(normal @ camera.rays[camera.height // 2, camera.width // 2]))
    seen = frame.segmentation == OBJECT
    must(not (_square(where, half - slack) & ~seen).any(), "the sheet has holes, or is drawn too small")
    must(not (seen & ~_square(where, half + slack)).any(), "the sheet is drawn where it is not")
    off = np.abs(frame.depth - depth)[seen & _square(where, half)].max()
    must(off < EXACT, f"the depth of a flat sheet is off by {off:.5f} m")


def _square(where: FloatArray, half: float) -> BoolArray:
    return np.asarray(np.abs(where[..., [0, 2]]).max(axis=-1) < half)


def _sheet(size: float = _SIZE) -> Body:
    """A square sheet upright in y = 0 about the origin, seen from -y as a picture on a wall."""
    body = cloth_grid(size, size, 5, 5)
    return Body("cloth", body.vertices + np.array([0.0, 0.0, 0.5 * size]), body.elements, body.grid)


def _between(depth: DepthImage, pixels: FloatArray) -> FloatArray:
    """Depth ``(P,)`` at ``pixels (P, 2)``, linear between pixel centres."""
    low = np.floor(pixels).astype(int)
    (u, v), (s, t) = low.T, (pixels - low).T
    rows = [(1 - s) * depth[v + k, u] + s * depth[v + k, u + 1] for k in (0, 1)]
    return np.asarray((1 - t) * rows[0] + t * rows[1])


def _camera(eye: tuple[float, float, float], target: FloatArray | None = None) -> Camera:
    aim = Camera.look_at(np.array(eye, float), np.zeros(3) if target is None else target)
    return Camera(*_LENS, aim.pose)


def _block(low: FloatArray, high: FloatArray) -> StaticMesh:
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    triangles = [[q[0], q[i], q[i + 1]] for q in quads for i in (1, 2)]
    return StaticMesh(low + corners * (high - low), np.array(triangles, np.int64))


def _scene(body: Body, obstacles: tuple[Obstacle, ...] = (), diameter: float = 0.01) -> Scene:
    material = RopeMaterial(diameter=diameter) if body.kind == "rope" else ClothMaterial()
    return Scene(body, material, np.zeros(3), (), np.zeros(len(body.vertices)), obstacles)


def _draw(
    make: MakeRenderer,
    body: Body,
    camera: Camera,
    look: Appearance | None = None,
    *,
    obstacles: tuple[Obstacle, ...] = (),
    diameter: float = 0.01,
    shift: FloatArray | None = None,
) -> Frame:
    with make().open(_scene(body, obstacles, diameter), look) as view:
        return view.render(body.vertices + (0.0 if shift is None else shift), camera)


def _arrays(frame: Frame) -> tuple[Image | DepthImage, ...]:
    return frame.rgb, frame.depth, frame.segmentation
