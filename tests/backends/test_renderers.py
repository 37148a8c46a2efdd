"""Both renderers keep the promises of the kit, agree with each other, and leave nothing behind."""

import os
import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pytest

from muslin.core.arrays import FloatArray
from muslin.core.body import Body, cloth_grid, rope_line, solid_box
from muslin.core.camera import Camera
from muslin.core.errors import BrokenPluginError
from muslin.core.material import ClothMaterial, RopeMaterial, SolidMaterial
from muslin.core.obstacles import Cylinder, Table
from muslin.core.picture import DepthImage, Frame, Image, Light
from muslin.core.renderer import Canvas, Renderer, find_renderer, frames_per_second
from muslin.core.scene import Scene
from muslin.core.surface import Surface
from muslin.core.testing import check_renderer

RENDERERS = ("mujoco", "tiny")


def drawing(name: str) -> Renderer:
    """A renderer by name, or a skipped test that says what is missing."""
    try:
        return find_renderer(name)
    except BrokenPluginError as error:
        pytest.skip(str(error))


def scene(kind: str) -> Scene:
    """An object in the air behind a rod, over a table."""
    if kind == "cloth":
        flat = cloth_grid(0.3, 0.3, 12, 12)
        wave = np.stack(
            [0 * flat.vertices[:, 0], 0.04 * np.sin(20 * flat.vertices[:, 0]), 0.5 + 0 * flat.vertices[:, 0]]
        )
        body: Body = replace(flat, vertices=flat.vertices + wave.T)
    elif kind == "rope":
        t = np.linspace(0, 1, 50)
        body = rope_line(np.stack([0.15 * np.cos(7 * t), 0.15 * np.sin(7 * t), 0.25 + 0.3 * t], axis=1), 50)
    else:
        body = solid_box(np.array([-0.05, -0.1, 0.25]), np.array([0.05, 0.1, 0.35]), (3, 5, 3))
    material = {"cloth": ClothMaterial(), "rope": RopeMaterial(diameter=0.02), "solid": SolidMaterial()}[kind]
    rod = Cylinder(np.array([0.05, -0.2, 0.35]), np.array([1.0, 0.3, 0.0]), 0.02, 0.3)
    return Scene(body, material, np.zeros(3), (), np.zeros(len(body.vertices)), (Table(0.2), rod))


def shot(renderer: Renderer, kind: str, size: int = 160) -> Frame:
    where = scene(kind)
    with renderer.open(where) as view:
        return view.render(where.body.vertices, Camera.framing(where.body.vertices, width=size, height=size))


@pytest.mark.parametrize("name", RENDERERS)
def test_renderer(name: str) -> None:
    drawing(name)
    check_renderer(lambda: find_renderer(name))


@pytest.mark.parametrize("kind", ["cloth", "rope", "solid"])
def test_both_renderers_draw_the_same(kind: str) -> None:
    one, other = (shot(drawing(name), kind) for name in RENDERERS)
    for label in (1, 2, 3):
        a, b = one.segmentation == label, other.segmentation == label
        assert a.sum() > 100 and (a & b).sum() / (a | b).sum() > 0.99, f"label {label}"
    same = one.segmentation == other.segmentation
    assert same.mean() > 0.999
    assert np.nanmax(np.abs(one.depth - other.depth)[same]) < 0.001
    assert np.abs(one.rgb.astype(int) - other.rgb)[same].mean() < 2.0


class Wrong(Canvas):
    """Another canvas, with one fault."""

    def __init__(self, inner: Canvas, fault: str) -> None:
        self.inner, self.fault = inner, fault

    def draw(
        self, points: FloatArray, normals: FloatArray, towards: FloatArray, camera: Camera
    ) -> tuple[Image, DepthImage]:
        if self.fault == "left-handed light":
            towards = towards * [-1, 1, 1]
        rgb, depth = self.inner.draw(points, normals, towards, camera)
        if self.fault == "two pixels to the right":
            return np.roll(rgb, 2, axis=1), np.roll(depth, 2, axis=1)
        if self.fault == "upside down":
            return rgb[::-1], depth[::-1]
        if self.fault == "distance for depth":
            return rgb, (depth * np.linalg.norm(camera.rays, axis=-1)).astype(np.float32)
        return rgb, depth

    def close(self) -> None:
        self.inner.close()


class Faulty(Renderer):
    name = "faulty"

    def __init__(self, fault: str) -> None:
        self.fault = fault

    def canvas(self, surface: Surface, texture: Image, light: Light) -> Canvas:
        if self.fault == "one side":
            surface = replace(surface, triangles=surface.triangles[: len(surface.triangles) // 2])
        return Wrong(drawing("tiny").canvas(surface, texture, light), self.fault)


@pytest.mark.parametrize(
    ("fault", "told"),
    [
        ("two pixels to the right", "drawn where it is not|has holes"),
        ("upside down", "drawn where it is not|has holes"),
        ("distance for depth", "depth of a flat sheet is off"),
        ("left-handed light", "a lit sheet shows"),
        ("one side", "its back 0"),
    ],
)
def test_the_kit_finds_a_renderer_that_draws_wrongly(fault: str, told: str) -> None:
    drawing("tiny")
    with pytest.raises(AssertionError, match=told):
        check_renderer(lambda: Faulty(fault))


def resident() -> int:
    """Memory that this process holds [bytes]."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="memory is read from Linux's /proc")
@pytest.mark.parametrize("name", RENDERERS)
def test_five_hundred_frames_and_many_views_hold_no_memory(name: str) -> None:
    renderer, where = drawing(name), scene("cloth")
    camera = Camera.framing(where.body.vertices, width=48, height=48)

    def shoot(frames: int) -> None:
        with renderer.open(where) as view:
            for k in range(frames):
                view.render(where.body.vertices * (1.0 + 1e-4 * k), camera)

    for _ in range(2):
        shoot(40)
    before = resident()
    shoot(500)
    for _ in range(6):
        shoot(2)
    grown = resident() - before
    assert grown < 6e6, f"{grown / 1e6:.1f} MB were kept"


@pytest.mark.slow
@pytest.mark.parametrize("name", RENDERERS)
def test_a_worker_process_draws_the_same_bit_for_bit(name: str) -> None:
    renderer = drawing(name)
    here = shot(renderer, "rope", 64)
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        there = pool.submit(shot, renderer, "rope", 64).result(timeout=120)
    for a, b in ((here.rgb, there.rgb), (here.depth, there.depth), (here.segmentation, there.segmentation)):
        assert np.array_equal(a, b, equal_nan=True)


FIND = "from muslin.core.renderer import find_renderer; print(find_renderer({name!r}).name)"


@pytest.mark.slow
@pytest.mark.parametrize("switched", ["disable", "no-such-thing"])
def test_without_opengl_the_software_renderer_draws_and_mujoco_says_what_to_do(tmp_path: Path, switched: str) -> None:
    drawing("tiny")

    def find(name: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [sys.executable, "-c", FIND.format(name=name)],
            cwd=tmp_path,
            capture_output=True,
            text=True,
            timeout=120,
            env={**os.environ, "MUJOCO_GL": switched},
        )

    assert find("auto").stdout.strip() == "tiny"
    assert "renderer 'mujoco' cannot draw on this machine" in find("mujoco").stderr


def test_a_machine_without_egl_is_told_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where an OpenGL context cannot be made, even if trying ends the process."""
    from muslin.backends.mujoco import rendering

    for trial, told in (("import os; os.abort()", "ended with -6"), ("raise ImportError('no EGL {module}')", "no EGL")):
        monkeypatch.setattr(rendering, "_TRIAL", trial)
        rendering._working.cache_clear()
        problem = rendering.MujocoRenderer().problem()
        assert told in problem and "apt-get install" in problem and "'tiny'" in problem and "\n" not in problem
    rendering._working.cache_clear()


@pytest.mark.parametrize("name", RENDERERS)
def test_frames_a_second_are_measured(name: str) -> None:
    drawing(name)
    assert frames_per_second(name, side=5, frames=3, size=64) > 1.0
