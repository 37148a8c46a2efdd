"""Pictures of a trajectory: colour, depth and segmentation from any camera, whichever engine draws.

A renderer owes one thing: to draw one textured mesh. What a picture consists of, and what hides
what, is decided here, so that it is the same in every renderer.
"""

import time
from abc import ABC, abstractmethod
from types import TracebackType
from typing import ClassVar

import numpy as np

from .arrays import FloatArray
from .body import cloth_grid
from .camera import Camera
from .errors import BrokenPluginError, InputError
from .material import ClothMaterial
from .motion import inverse, rotate
from .obstacles import Table
from .picture import (
    BACKGROUND,
    OBJECT,
    OBSTACLE,
    Appearance,
    DepthImage,
    Frame,
    Image,
    Light,
    Paint,
    stretched,
    texture_of,
)
from .registry import REGISTRY
from .scene import Scene
from .surface import Surface, object_surface, obstacle_surface

#: In the order in which they are tried.
_PREFERRED = ("mujoco", "tiny")
#: Nothing nearer to the camera than this is drawn [m].
NEAREST = 0.01
#: An object is drawn before an obstacle that hides it by no more than this [m]. An object that touches lies in
#: the surface of the obstacle, and the flat triangles between its vertices dip below a curved one.
TOUCHING = 0.003


class Canvas(ABC):
    """One surface that a renderer draws over and over, alone. Owns whatever the engine allocates."""

    @abstractmethod
    def draw(
        self, points: FloatArray, normals: FloatArray, towards: FloatArray, camera: Camera
    ) -> tuple[Image, DepthImage]:
        """Colour ``(H, W, 3)`` and depth ``(H, W)`` [m], NaN where the surface is not seen.

        Args:
            points: of the surface ``(N, 3)`` [m] in the camera's frame, at least one in front of it.
            normals: unit vectors ``(N, 3)`` in the camera's frame.
            towards: unit vector ``(3,)`` to the lamp in the camera's frame.
            camera: size and lens; its pose is already in the points.
        """

    def close(self) -> None:
        """Free what the engine allocated. Called once."""
        return None


class Renderer(ABC):
    """A factory of views. Small, picklable, without engine objects: it travels to worker processes."""

    name: ClassVar[str]

    @abstractmethod
    def canvas(self, surface: Surface, texture: Image, light: Light) -> Canvas:
        """A canvas for ``surface``, painted with ``texture (h, w, 3)``, lit by ``light``."""

    def problem(self) -> str:
        """Why it cannot draw on this machine, and what to install; empty if it can."""
        return ""

    def open(self, scene: Scene, appearance: Appearance | None = None) -> "View":
        """A view of a scene. Close it.

        Raises:
            BrokenPluginError: it cannot draw on this machine; the message says what to install.
        """
        return View(self, scene, appearance or Appearance())


class View:
    """A scene that is drawn frame by frame. Use it in a ``with`` block, or close it."""

    def __init__(self, renderer: Renderer, scene: Scene, appearance: Appearance) -> None:
        self._appearance = appearance
        self._vertices = len(scene.body.vertices)
        self._layers: list[_Layer] = []
        self._tables: list[tuple[int, float, FloatArray]] = []
        self._behind: tuple[tuple[object, ...], Frame] | None = None
        try:
            self._object = _Layer(renderer, object_surface(scene), appearance.object, OBJECT, appearance.light)
            self._layers.append(self._object)
            for k, obstacle in enumerate(scene.obstacles):
                paint = appearance.obstacles[k % len(appearance.obstacles)]
                if isinstance(obstacle, Table):
                    colour = np.asarray(texture_of(paint), float).reshape(-1, 3).mean(axis=0)
                    self._tables.append((OBSTACLE + k, obstacle.height, colour))
                else:
                    surface = obstacle_surface(obstacle)
                    self._layers.append(_Layer(renderer, surface, paint, OBSTACLE + k, appearance.light))
        except BaseException:
            self.close()
            raise

    def render(self, vertices: FloatArray, camera: Camera) -> Frame:
        """The object at ``vertices (V, 3)`` [m] as ``camera`` sees it.

        Raises:
            InputError: the vertices are not finite, or not as many as the mesh has.
        """
        if vertices.shape != (self._vertices, 3) or not np.isfinite(vertices).all():
            raise InputError(f"a frame needs {self._vertices} finite vertices (V, 3), got shape {vertices.shape}")
        back = self._backdrop(camera)
        frame = Frame(back.rgb.copy(), back.depth.copy(), back.segmentation.copy())
        self._object.put(frame, vertices, camera, TOUCHING)
        return frame

    def _backdrop(self, camera: Camera) -> Frame:
        """Everything but the object; kept as long as the camera stays."""
        key = (*(getattr(camera, k) for k in ("width", "height", "fx", "fy", "cx", "cy")), camera.pose.tobytes())
        if self._behind is None or self._behind[0] != key:
            shape = (camera.height, camera.width)
            rgb = stretched(self._appearance.background, shape)
            frame = Frame(rgb, np.full(shape, np.nan, np.float32), np.full(shape, BACKGROUND, np.uint8))
            for label, height, colour in self._tables:
                _lay_table(frame, height, colour, label, self._appearance.light, camera)
            for layer in self._layers[1:]:
                layer.put(frame, np.zeros((0, 3)), camera, 0.0)
            self._behind = (key, frame)
        return self._behind[1]

    def close(self) -> None:
        """Free what the engine allocated; a second call does nothing."""
        while self._layers:
            self._layers.pop().canvas.close()

    def __enter__(self) -> "View":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


class _Layer:
    """One surface, its canvas and its label."""

    def __init__(self, renderer: Renderer, surface: Surface, paint: Paint, label: int, light: Light) -> None:
        self._surface, self._label, self._light = surface, label, light
        self.canvas = renderer.canvas(surface, texture_of(paint), light)

    def put(self, frame: Frame, vertices: FloatArray, camera: Camera, ahead: float) -> None:
        """Draw into ``frame`` wherever nothing is nearer by more than ``ahead`` [m]."""
        points = camera.local(self._surface.place(vertices))
        if not (points[:, 2] > NEAREST).any():
            return
        towards = rotate(inverse(camera.pose[3:]), self._light.direction)
        rgb, depth = self.canvas.draw(points, self._surface.normals(points), towards, camera)
        with np.errstate(invalid="ignore"):
            seen = np.isfinite(depth) & ~(depth > frame.depth + np.float32(ahead))
        np.copyto(frame.rgb, rgb, where=seen[..., None])
        np.copyto(frame.depth, depth, where=seen)
        np.copyto(frame.segmentation, np.uint8(self._label), where=seen)


def _lay_table(frame: Frame, height: float, colour: FloatArray, label: int, light: Light, camera: Camera) -> None:
    """A table reaches to the horizon, which no mesh does: its depth is that of the plane, pixel by pixel."""
    eye = float(camera.pose[2])
    if eye <= height:
        return
    fall = camera.rays[..., 2]
    depth = np.where(fall < 0, (height - eye) / np.where(fall < 0, fall, -1.0), np.inf)
    with np.errstate(invalid="ignore"):
        seen = (depth > NEAREST) & np.isfinite(depth) & ~(depth > frame.depth)
    shade = light.ambient + light.diffuse * max(0.0, float(light.direction[2]))
    frame.rgb[seen] = np.clip(shade * colour, 0, 255).astype(np.uint8)
    frame.depth[seen], frame.segmentation[seen] = depth[seen], label


def clipping(points: FloatArray) -> tuple[float, float]:
    """Near and far plane [m] just around ``points (N, 3)`` in the camera's frame: the most exact depth."""
    near = max(NEAREST, 0.95 * float(points[:, 2].min()))
    return near, max(1.05 * float(points[:, 2].max()), 1.05 * near)


def find_renderer(name: str = "auto") -> Renderer:
    """A renderer that works on this machine.

    Args:
        name: of the renderer, or ``"auto"`` for :func:`best_renderer`.

    Raises:
        UnknownPluginError: there is none of that name.
        BrokenPluginError: it cannot draw here; the message says what to install.
    """
    if name == "auto":
        return best_renderer()
    renderer: Renderer = REGISTRY.get("renderer", name)()
    problem = renderer.problem()
    if problem:
        raise BrokenPluginError(f"renderer {name!r} cannot draw on this machine: {problem}")
    return renderer


def best_renderer() -> Renderer:
    """The first renderer that works on this machine: ``mujoco``, then ``tiny``, then any other installed.

    Raises:
        BrokenPluginError: none works; the message says of each what to install.
    """
    problems = []
    installed = REGISTRY.names("renderer")
    for name in [*(n for n in _PREFERRED if n in installed), *(n for n in installed if n not in _PREFERRED)]:
        try:
            return find_renderer(name)
        except BrokenPluginError as error:
            problems.append(str(error))
    raise BrokenPluginError("no renderer works on this machine; " + "; ".join(problems or ["none is installed"]))


def frames_per_second(renderer: str, side: int = 9, frames: int = 60, size: int = 320) -> float:
    """How fast a renderer draws a waving sheet, colour, depth and segmentation together.

    Args:
        renderer: its name, or ``"auto"``.
        side: vertices along each edge of the sheet.
        frames: how many are timed, after one that is not.
        size: pixels along each edge of the picture.
    """
    body = cloth_grid(0.3, 0.3, side, side)
    scene = Scene(body, ClothMaterial(), np.zeros(3), (), np.zeros(len(body.vertices)))
    camera = Camera.framing(body.vertices, width=size, height=size)
    wave = np.zeros((frames + 1, *body.vertices.shape))
    phase = 2 * np.pi * np.arange(frames + 1) / 30.0
    wave[..., 1] = 0.03 * np.sin(20.0 * body.vertices[:, 0] + phase[:, None])
    with find_renderer(renderer).open(scene) as view:
        view.render(body.vertices, camera)
        began = time.perf_counter()
        for shift in wave[1:]:
            view.render(body.vertices + shift, camera)
        return frames / (time.perf_counter() - began)
