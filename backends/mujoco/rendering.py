"""Drawing with MuJoCo's OpenGL renderer, without a display: through EGL, or OSMesa."""

import os
import platform
import subprocess
import sys
from functools import cache
from importlib import import_module
from typing import Any, ClassVar

import numpy as np

from ...core.arrays import FloatArray
from ...core.camera import Camera
from ...core.errors import BrokenPluginError
from ...core.picture import DepthImage, Image, Light, texel_centres
from ...core.renderer import Canvas, Renderer, clipping
from ...core.surface import Surface

_OFF = ("disable", "disabled", "off", "false", "0")
#: Tried in a process of its own, as a broken driver may end the process that asks it.
_TRIAL = """
import mujoco
from {module} import GLContext
context = GLContext(8, 8)
context.make_current()
mujoco.MjrContext(mujoco.MjModel.from_xml_string("<mujoco/>"), 50)
"""
_TRIAL_SECONDS = 60.0
_INSTALL = (
    "install EGL with a driver (Debian, Ubuntu: apt-get install libegl1 libgl1-mesa-dri), or use the renderer "
    "'tiny', which needs no OpenGL (pip install 'muslin[pybullet]')"
)


@cache
def _working(asked: str) -> tuple[str, str]:
    """The module of an OpenGL context that works here, or an empty text and why there is none.

    Args:
        asked: value of MUJOCO_GL, which names one or switches all of them off.
    """
    if asked in _OFF:
        return "", f"OpenGL is switched off by MUJOCO_GL={asked}"
    if platform.system() != "Linux":
        names = ["mujoco.gl_context"]
    else:
        names = [f"mujoco.{asked}"] if asked in ("egl", "osmesa") else ["mujoco.egl", "mujoco.osmesa"]
    reasons = []
    for name in names:
        reason = _try(name)
        if not reason:
            return name, ""
        reasons.append(f"{name}: {reason}")
    return "", f"{'; '.join(reasons)}; {_INSTALL}"


def _try(module: str) -> str:
    """Why an OpenGL context of ``module`` cannot be made; empty if it can."""
    try:
        done = subprocess.run(
            [sys.executable, "-c", _TRIAL.format(module=module)],
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=_TRIAL_SECONDS,
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        return f"{type(error).__name__}"
    if done.returncode == 0:
        return ""
    said = done.stderr.strip().splitlines()
    return said[-1][:200] if said else f"the process ended with {done.returncode}"


class MujocoRenderer(Renderer):
    """MuJoCo's classic renderer: linear texture filtering, no antialiasing."""

    name: ClassVar[str] = "mujoco"

    def __init__(self) -> None:
        self._module = ""

    def problem(self) -> str:
        if not self._module:  # kept, and so carried to worker processes, which need not try again
            try:
                import_module("mujoco")
            except ImportError as error:
                return f"MuJoCo cannot be imported ({error}); install it with: pip install 'muslin[mujoco]'"
            except RuntimeError as error:  # of a MUJOCO_GL that it does not know
                return str(error)
            self._module, problem = _working(os.environ.get("MUJOCO_GL", "").lower().strip())
            return problem
        return ""

    def canvas(self, surface: Surface, texture: Image, light: Light) -> Canvas:
        problem = self.problem()
        if problem:
            raise BrokenPluginError(f"renderer 'mujoco' cannot draw on this machine: {problem}")
        return _MujocoCanvas(surface, texture, light, self._module)


class _MujocoCanvas(Canvas):
    """A static mesh whose vertices are uploaded anew for every frame; the camera is the world's origin."""

    def __init__(self, surface: Surface, texture: Image, light: Light, module: str) -> None:
        self._engine = engine = import_module("mujoco")
        self._light, self._size = light, (320, 320)
        self._model = model = _model(engine, surface, texture)
        data = engine.MjData(model)
        engine.mj_forward(model, data)
        self._scene = scene = engine.MjvScene(model, maxgeom=4)
        engine.mjv_updateScene(
            model, data, engine.MjvOption(), None, engine.MjvCamera(), engine.mjtCatBit.mjCAT_ALL, scene
        )
        flags = engine.mjtRndFlag
        for flag in (flags.mjRND_SHADOW, flags.mjRND_REFLECTION, flags.mjRND_SKYBOX, flags.mjRND_HAZE, flags.mjRND_FOG):
            scene.flags[flag] = 0
        self._gl = import_module(module).GLContext(*self._size)
        self._gl.make_current()
        self._context = engine.MjrContext(model, engine.mjtFontScale.mjFONTSCALE_50)
        engine.mjr_setBuffer(engine.mjtFramebuffer.mjFB_OFFSCREEN, self._context)
        self._context.readDepthMap = engine.mjtDepthMap.mjDEPTH_ZEROFAR

    def draw(
        self, points: FloatArray, normals: FloatArray, towards: FloatArray, camera: Camera
    ) -> tuple[Image, DepthImage]:
        engine, shape = self._engine, (camera.height, camera.width)
        self._gl.make_current()
        if shape != self._size:
            engine.mjr_resizeOffscreen(camera.width, camera.height, self._context)
            self._size = shape
        self._model.mesh_vert[:] = points
        self._model.mesh_normal[:] = normals
        engine.mjr_uploadMesh(self._model, self._context, 0)
        near, far = clipping(points)
        self._aim(camera, near, far)
        self._shine(towards)
        rgb, closeness = np.empty((*shape, 3), np.uint8), np.empty(shape, np.float32)
        window = engine.MjrRect(0, 0, camera.width, camera.height)
        engine.mjr_render(window, self._scene, self._context)
        engine.mjr_readPixels(rgb, closeness, window, self._context)
        # 0 at the far plane, where nothing is seen, and 1 at the near one
        with np.errstate(invalid="ignore"):
            depth = near * far / (near + closeness[::-1].astype(np.float64) * (far - near))
        depth[closeness[::-1] <= 0] = np.nan
        return rgb[::-1], depth.astype(np.float32)

    def _aim(self, camera: Camera, near: float, far: float) -> None:
        """The view frustum whose borders are the outer edges of the outer pixels."""
        for eye in self._scene.camera:
            eye.pos, eye.forward, eye.up, eye.orthographic = [0, 0, 0], [0, 0, 1], [0, -1, 0], 0
            eye.frustum_near, eye.frustum_far = near, far
            eye.frustum_top = (camera.cy + 0.5) / camera.fy * near
            eye.frustum_bottom = (camera.cy + 0.5 - camera.height) / camera.fy * near
            eye.frustum_width = 0.5 * camera.width / camera.fx * near
            eye.frustum_center = (0.5 * (camera.width - 1) - camera.cx) / camera.fx * near

    def _shine(self, towards: FloatArray) -> None:
        self._scene.nlight = 1
        lamp = self._scene.lights[0]
        lamp.type = self._engine.mjtLightType.mjLIGHT_DIRECTIONAL
        lamp.headlight, lamp.castshadow, lamp.texid = 0, 0, -1
        lamp.pos, lamp.dir, lamp.attenuation = towards, -towards, [1, 0, 0]
        lamp.ambient, lamp.diffuse, lamp.specular = [self._light.ambient] * 3, [self._light.diffuse] * 3, [0] * 3

    def close(self) -> None:
        self._gl.make_current()
        self._context.free()
        self._gl.free()


def _model(engine: Any, surface: Surface, texture: Image) -> Any:
    """A model of one mesh of the right size; its numbers are written over afterwards.

    The compiler only sees points spread over a ball, as it refuses meshes that are flat or folded.
    """
    count, faces = len(surface.uv), surface.triangles.astype(np.int32)
    ball = np.random.default_rng(0).normal(size=(count, 3))
    spec = engine.MjSpec()
    mesh = spec.add_mesh(name="surface", inertia=engine.mjtMeshInertia.mjMESH_INERTIA_SHELL)
    mesh.uservert, mesh.usernormal = ball.ravel(), ball.ravel()
    mesh.userface, mesh.userfacetexcoord = faces.ravel(), faces.ravel()
    mesh.usertexcoord = np.zeros(2 * count)
    height, width = texture.shape[:2]
    spec.add_texture(
        name="paint",
        type=engine.mjtTexture.mjTEXTURE_2D,
        builtin=engine.mjtBuiltin.mjBUILTIN_FLAT,
        width=width,
        height=height,
        nchannel=3,
    )
    material = spec.add_material(name="paint", specular=0, shininess=0)
    material.textures[engine.mjtTextureRole.mjTEXROLE_RGB] = "paint"
    spec.worldbody.add_geom(
        type=engine.mjtGeom.mjGEOM_MESH, meshname="surface", material="paint", contype=0, conaffinity=0
    )
    spec.visual.quality.offsamples = spec.visual.quality.shadowsize = 0
    spec.visual.global_.offwidth = spec.visual.global_.offheight = 320
    model = spec.compile()
    model.geom_pos[:], model.geom_quat[:] = 0.0, [1.0, 0.0, 0.0, 0.0]
    model.mesh_face[:] = model.mesh_facenormal[:] = model.mesh_facetexcoord[:] = faces
    model.mesh_texcoord[:] = texel_centres(surface.uv, texture)
    model.tex_data[:] = texture.ravel()
    return model
