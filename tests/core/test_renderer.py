"""What a picture consists of, whatever draws it; with a stand-in that draws nothing but one distance."""

from dataclasses import replace
from typing import ClassVar

import numpy as np
import pytest

from muslin.core.arrays import FloatArray
from muslin.core.body import cloth_grid
from muslin.core.camera import Camera
from muslin.core.errors import BrokenPluginError, InputError, UnknownPluginError
from muslin.core.material import ClothMaterial
from muslin.core.obstacles import Cylinder, Table
from muslin.core.picture import Appearance, DepthImage, Image, Light
from muslin.core.registry import REGISTRY
from muslin.core.renderer import Canvas, Renderer, best_renderer, find_renderer
from muslin.core.scene import Scene
from muslin.core.surface import Surface


class Wall(Canvas):
    """Fills the left half of a picture at the mean depth of the surface."""

    opened = 0
    drawn = 0

    def __init__(self, texture: Image) -> None:
        self.texture = texture
        Wall.opened += 1

    def draw(
        self, points: FloatArray, normals: FloatArray, towards: FloatArray, camera: Camera
    ) -> tuple[Image, DepthImage]:
        Wall.drawn += 1
        depth = np.full((camera.height, camera.width), np.nan, np.float32)
        depth[:, : camera.width // 2] = points[:, 2].mean()
        return np.broadcast_to(self.texture[0, 0], (*depth.shape, 3)).astype(np.uint8), depth

    def close(self) -> None:
        Wall.opened -= 1


class Walls(Renderer):
    name: ClassVar[str] = "walls"

    def canvas(self, surface: Surface, texture: Image, light: Light) -> Canvas:
        if len(surface.triangles) == 256:  # of a cylinder
            raise RuntimeError("this canvas breaks")
        return Wall(texture)


class Nowhere(Walls):
    def problem(self) -> str:
        return "there is no paint; install paint"


BODY = cloth_grid(0.2, 0.2, 3, 3)
SCENE = Scene(BODY, ClothMaterial(), np.zeros(3), (), np.zeros(9))
CAMERA = Camera.look_at(np.array([0.0, -1.0, -0.1]), np.array([0.0, 0.0, -0.1]), width=20, height=10)
ROD = Cylinder(np.array([0.0, 0.0, -0.1]), np.array([1.0, 0.0, 0.0]), 0.01, 1.0)


def test_a_frame_has_the_object_before_the_background() -> None:
    picture = np.random.default_rng(0).integers(0, 255, (10, 20, 3), np.uint8)
    with Walls().open(SCENE, Appearance(object=(9, 8, 7), background=picture)) as view:
        frame = view.render(BODY.vertices, CAMERA)
    assert (frame.segmentation[:, :10] == 1).all() and (frame.segmentation[:, 10:] == 0).all()
    assert (frame.rgb[:, :10] == [9, 8, 7]).all() and (frame.rgb[:, 10:] == picture[:, 10:]).all()
    assert np.allclose(frame.depth[:, :10], 1.0) and np.isnan(frame.depth[:, 10:]).all()


def test_a_background_is_stretched_over_the_frame() -> None:
    picture = np.arange(4, dtype=np.uint8).repeat(3).reshape(2, 2, 3)
    with Walls().open(SCENE, Appearance(background=picture)) as view:
        frame = view.render(BODY.vertices - np.array([0, 5, 0]), CAMERA)  # behind the camera
    assert (frame.segmentation == 0).all()
    assert (frame.rgb[:5, :10] == 0).all() and (frame.rgb[5:, 10:] == 3).all()


def test_what_touches_an_obstacle_is_not_swallowed_by_it() -> None:
    table = replace(SCENE, obstacles=(Table(-0.3),))
    eye = Camera.look_at(np.array([0.0, 0.0, 1.0]), np.zeros(3), width=20, height=10)
    flat = BODY.vertices[:, [0, 2, 1]] * [1, 1, 0]
    with Walls().open(table) as view:
        for under, label in ((-0.002, 1), (-0.01, 2)):
            frame = view.render(flat + np.array([0, 0, under - 0.3]), eye)
            assert (frame.segmentation[:, :10] == label).all() and (frame.segmentation[:, 10:] == 2).all()


def test_a_table_seen_from_below_is_not_drawn() -> None:
    low = Camera.look_at(np.array([0.0, -1.0, -1.0]), np.zeros(3), width=20, height=10)
    with Walls().open(replace(SCENE, obstacles=(Table(-0.3),))) as view:
        assert not (view.render(BODY.vertices, low).segmentation == 2).any()


def test_what_stands_still_is_drawn_once_a_camera() -> None:
    class Rods(Walls):
        def canvas(self, surface: Surface, texture: Image, light: Light) -> Canvas:
            return Wall(texture)

    with Rods().open(replace(SCENE, obstacles=(ROD,))) as view:
        before = Wall.drawn
        for camera in (CAMERA, CAMERA, replace(CAMERA), replace(CAMERA, fx=30.0)):
            view.render(BODY.vertices, camera)
    assert Wall.drawn - before == 4 + 2


def test_a_view_frees_its_canvases_also_where_one_cannot_be_made() -> None:
    before = Wall.opened
    view = Walls().open(SCENE)
    assert Wall.opened == before + 1
    view.close()
    view.close()
    with pytest.raises(RuntimeError, match="breaks"):
        Walls().open(replace(SCENE, obstacles=(replace(ROD),)))
    assert Wall.opened == before


@pytest.mark.parametrize("wrong", [np.zeros((8, 3)), np.full((9, 3), np.nan), np.zeros((9, 2))])
def test_vertices_that_cannot_be_drawn_are_refused(wrong: FloatArray) -> None:
    with Walls().open(SCENE) as view, pytest.raises(InputError, match="9 finite vertices"):
        view.render(wrong, CAMERA)


@pytest.mark.parametrize(
    "paint", [(1, 2), (1, 2, 300), (0.5, 0.5, 0.5), np.zeros((4, 4), np.uint8), np.zeros((4, 4, 3))]
)
def test_a_paint_that_is_none_is_refused(paint: object) -> None:
    with pytest.raises(InputError, match="object needs a colour"):
        Appearance(object=paint)  # type: ignore[arg-type]


def test_a_light_that_is_none_is_refused() -> None:
    with pytest.raises(InputError, match="direction"):
        Light((0.0, 0.0, 0.0))
    with pytest.raises(InputError, match="0 to 1"):
        Light(ambient=1.5)


def test_the_best_renderer_is_the_first_that_works(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(REGISTRY._objects, ("renderer", "mujoco"), Nowhere)
    monkeypatch.setitem(REGISTRY._objects, ("renderer", "tiny"), Walls)
    assert type(best_renderer()) is Walls and type(find_renderer()) is Walls
    with pytest.raises(BrokenPluginError, match=r"'mujoco' cannot draw.*install paint"):
        find_renderer("mujoco")
    with pytest.raises(UnknownPluginError, match="tiny"):
        find_renderer("tyni")


def test_where_none_works_one_line_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in REGISTRY.names("renderer"):
        monkeypatch.setitem(REGISTRY._objects, ("renderer", name), Nowhere)
    with pytest.raises(BrokenPluginError, match="no renderer works") as caught:
        best_renderer()
    told = str(caught.value)
    assert "\n" not in told and "'mujoco'" in told and "'tiny'" in told and "install paint" in told
