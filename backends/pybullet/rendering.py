"""Drawing with Bullet's TinyRenderer, which runs on the processor and needs no OpenGL."""

import ctypes
import os
import struct
import tempfile
from functools import cache
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from ...core.arrays import FloatArray
from ...core.camera import Camera
from ...core.errors import BrokenPluginError
from ...core.picture import DepthImage, Image, Light, texel_centres
from ...core.renderer import Canvas, Renderer, clipping
from ...core.surface import Surface
from .library import bullet

_TINY_RENDERER = 1 << 16
#: Bullet keeps the mesh of a removed body; the world is emptied after this many frames.
_FRAMES_A_WORLD = 32

_ADDRESS, _INT, _TEXT, _SINGLE = ctypes.c_void_p, ctypes.c_int, ctypes.c_char_p, ctypes.c_float
#: Name, result and arguments of what :mod:`.library` does not declare; source: ``PhysicsClientC_API.h``.
_FUNCTIONS: tuple[tuple[str, Any, tuple[Any, ...]], ...] = (
    ("b3CreateVisualShapeCommandInit", _ADDRESS, (_ADDRESS,)),
    ("b3CreateVisualShapeAddMesh2", _INT, (*(_ADDRESS,) * 4, *(_INT, _ADDRESS) * 3, _INT)),
    ("b3CreateVisualShapeSetRGBAColor", None, (_ADDRESS, _INT, _ADDRESS)),
    ("b3GetStatusVisualShapeUniqueId", _INT, (_ADDRESS,)),
    ("b3InitRemoveBodyCommand", _ADDRESS, (_ADDRESS, _INT)),
    ("b3InitLoadTexture", _ADDRESS, (_ADDRESS, _TEXT)),
    ("b3GetStatusTextureUniqueId", _INT, (_ADDRESS,)),
    ("b3InitUpdateVisualShape2", _ADDRESS, (_ADDRESS, _INT, _INT, _INT)),
    ("b3UpdateVisualShapeTexture", None, (_ADDRESS, _INT)),
    ("b3InitRequestCameraImage", _ADDRESS, (_ADDRESS,)),
    ("b3RequestCameraImageSelectRenderer", None, (_ADDRESS, _INT)),
    ("b3RequestCameraImageSetCameraMatrices", None, (_ADDRESS, _ADDRESS, _ADDRESS)),
    ("b3RequestCameraImageSetPixelResolution", None, (_ADDRESS, _INT, _INT)),
    ("b3RequestCameraImageSetLightDirection", None, (_ADDRESS, _ADDRESS)),
    ("b3RequestCameraImageSetLightAmbientCoeff", None, (_ADDRESS, _SINGLE)),
    ("b3RequestCameraImageSetLightDiffuseCoeff", None, (_ADDRESS, _SINGLE)),
    ("b3RequestCameraImageSetLightSpecularCoeff", None, (_ADDRESS, _SINGLE)),
    ("b3RequestCameraImageSetShadow", None, (_ADDRESS, _INT)),
    ("b3GetCameraImageData", None, (_ADDRESS, _ADDRESS)),
)


class _Picture(ctypes.Structure):
    _fields_ = (
        ("width", _INT),
        ("height", _INT),
        ("rgba", ctypes.POINTER(ctypes.c_ubyte)),
        ("depth", ctypes.POINTER(ctypes.c_float)),
        ("bodies", ctypes.POINTER(ctypes.c_int)),
    )


@cache
def _library() -> ctypes.PyDLL:
    library = bullet()
    for name, result, arguments in _FUNCTIONS:
        function = getattr(library, name)
        function.restype, function.argtypes = result, arguments
    return library


class TinyRenderer(Renderer):
    """Bullet's software renderer: nearest texture pixel, no antialiasing."""

    name: ClassVar[str] = "tiny"

    def problem(self) -> str:
        try:
            _library()
        except (BrokenPluginError, AttributeError) as error:
            return f"it draws with Bullet, which cannot be loaded ({error})"
        return ""

    def canvas(self, surface: Surface, texture: Image, light: Light) -> Canvas:
        problem = self.problem()
        if problem:
            raise BrokenPluginError(f"renderer 'tiny' cannot draw on this machine: {problem}")
        return _TinyCanvas(surface, texture, light)


class _TinyCanvas(Canvas):
    """A world of one body that is made anew for every frame; the camera is the world's origin."""

    def __init__(self, surface: Surface, texture: Image, light: Light) -> None:
        self._light = light
        self._triangles = np.ascontiguousarray(surface.triangles, np.int32)
        self._uv = np.ascontiguousarray(texel_centres(surface.uv, texture), np.float64)
        self._folder = tempfile.TemporaryDirectory(prefix="muslin-")
        self._texture_file = Path(self._folder.name) / "texture.bmp"
        self._texture_file.write_bytes(_bitmap(texture))
        self._api = _library()
        self._handle = self._api.b3ConnectPhysicsDirect()
        self._texture, self._body, self._frames = -1, -1, 0

    def _submit(self, command: int) -> int:
        return int(self._api.b3SubmitClientCommandAndWaitStatus(self._handle, command))

    def _clear(self) -> None:
        """Take the body of the frame before out of the world."""
        api, handle = self._api, self._handle
        if self._frames % _FRAMES_A_WORLD == 0:
            self._submit(api.b3InitResetSimulationCommand(handle))
            loaded = self._submit(api.b3InitLoadTexture(handle, os.fsencode(self._texture_file)))
            self._texture = api.b3GetStatusTextureUniqueId(loaded)
        else:
            self._submit(api.b3InitRemoveBodyCommand(handle, self._body))
        self._frames += 1

    def _put(self, points: FloatArray, normals: FloatArray) -> None:
        """Make a body of the surface."""
        api, handle = self._api, self._handle
        points, normals = np.ascontiguousarray(points), np.ascontiguousarray(normals)
        ones, zeros, upright = np.ones(4), np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0])
        command = api.b3CreateVisualShapeCommandInit(handle)
        mesh = ((points, len(points)), (self._triangles, self._triangles.size), (normals, len(normals)))
        parts = [x for array, size in (*mesh, (self._uv, len(self._uv))) for x in (_at(array), size)]
        shape = api.b3CreateVisualShapeAddMesh2(handle, command, _at(ones), *parts)
        api.b3CreateVisualShapeSetRGBAColor(command, shape, _at(ones))
        shape = api.b3GetStatusVisualShapeUniqueId(self._submit(command))
        command = api.b3CreateMultiBodyCommandInit(handle)
        api.b3CreateMultiBodyBase(command, 0.0, -1, shape, _at(zeros), _at(upright), _at(zeros), _at(upright))
        self._body = api.b3GetStatusBodyIndex(self._submit(command))
        command = api.b3InitUpdateVisualShape2(handle, self._body, -1, -1)
        api.b3UpdateVisualShapeTexture(command, self._texture)
        self._submit(command)

    def draw(
        self, points: FloatArray, normals: FloatArray, towards: FloatArray, camera: Camera
    ) -> tuple[Image, DepthImage]:
        api, shape = self._api, (camera.height, camera.width)
        self._clear()
        self._put(points, normals)
        near, far = clipping(points)
        lens, view = _projection(camera, near, far), np.diag([1.0, -1.0, -1.0, 1.0]).astype(np.float32)
        lamp = towards.astype(np.float32)
        command = api.b3InitRequestCameraImage(self._handle)
        api.b3RequestCameraImageSelectRenderer(command, _TINY_RENDERER)
        api.b3RequestCameraImageSetCameraMatrices(command, _at(view), _at(lens))
        api.b3RequestCameraImageSetPixelResolution(command, camera.width, camera.height)
        api.b3RequestCameraImageSetLightDirection(command, _at(lamp))
        api.b3RequestCameraImageSetLightAmbientCoeff(command, self._light.ambient)
        api.b3RequestCameraImageSetLightDiffuseCoeff(command, self._light.diffuse)
        api.b3RequestCameraImageSetLightSpecularCoeff(command, 0.0)
        api.b3RequestCameraImageSetShadow(command, 0)
        self._submit(command)
        got = _Picture()
        api.b3GetCameraImageData(self._handle, ctypes.byref(got))
        # Bullet's memory is overwritten by the next picture
        rgb = np.ctypeslib.as_array(got.rgba, (*shape, 4))[..., :3].copy()
        seen = np.ctypeslib.as_array(got.bodies, shape) >= 0
        buffer = np.ctypeslib.as_array(got.depth, shape).astype(np.float64)
        depth = np.where(seen, near * far / (far - (far - near) * buffer), np.nan)
        return rgb, depth.astype(np.float32)

    def close(self) -> None:
        self._api.b3DisconnectSharedMemory(self._handle)
        self._folder.cleanup()


def _at(values: np.ndarray[Any, Any]) -> int:
    return int(values.ctypes.data)


def _projection(camera: Camera, near: float, far: float) -> np.ndarray[Any, np.dtype[np.float32]]:
    """OpenGL's projection matrix, column by column.

    TinyRenderer takes a pixel's colour at its lower left corner where OpenGL takes it in the middle: the
    frustum reaches from column 0 to column ``width``, and down from row ``height - 1`` to row -1.
    """
    left, right = -camera.cx / camera.fx, (camera.width - camera.cx) / camera.fx
    top, bottom = (camera.cy + 1.0) / camera.fy, (camera.cy + 1.0 - camera.height) / camera.fy
    matrix = np.zeros((4, 4), np.float32)
    matrix[0, 0], matrix[2, 0] = 2.0 / (right - left), (right + left) / (right - left)
    matrix[1, 1], matrix[2, 1] = 2.0 / (top - bottom), (top + bottom) / (top - bottom)
    matrix[2, 2], matrix[3, 2] = -(far + near) / (far - near), -2.0 * far * near / (far - near)
    matrix[2, 3] = -1.0
    return matrix


def _bitmap(picture: Image) -> bytes:
    """A Windows bitmap that Bullet can read, blue first; of ``picture (h, w, 3)`` upside down, as v shall run down.

    A bitmap's rows run from the bottom up, and so does TinyRenderer's v.
    """
    height, width = picture.shape[:2]
    rows = np.zeros((height, (3 * width + 3) // 4 * 4), np.uint8)
    rows[:, : 3 * width] = picture[:, :, ::-1].reshape(height, -1)
    header = struct.pack("<2sIII", b"BM", 54 + rows.size, 0, 54)
    header += struct.pack("<IiiHHIIiiII", 40, width, height, 1, 24, 0, rows.size, 0, 0, 0, 0)
    return header + rows.tobytes()
