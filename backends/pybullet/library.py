"""Finds Bullet's C API inside the pybullet wheel and declares the part of it that is used here."""

import ctypes
import importlib.metadata
import importlib.util
from functools import cache
from typing import Any

from ...core.errors import BrokenPluginError

_ADDRESS, _REAL, _INT, _TEXT = ctypes.c_void_p, ctypes.c_double, ctypes.c_int, ctypes.c_char_p
_HOW_TO_GET_IT = "install it with `pip install muslin[pybullet]`"

#: Name, result and arguments of every function used; source: Bullet's ``PhysicsClientC_API.h``.
_FUNCTIONS: tuple[tuple[str, Any, tuple[Any, ...]], ...] = (
    ("b3ConnectPhysicsDirect", _ADDRESS, ()),
    ("b3DisconnectSharedMemory", None, (_ADDRESS,)),
    ("b3SubmitClientCommandAndWaitStatus", _ADDRESS, (_ADDRESS, _ADDRESS)),
    ("b3GetStatusType", _INT, (_ADDRESS,)),
    ("b3GetStatusBodyIndex", _INT, (_ADDRESS,)),
    ("b3GetStatusCollisionShapeUniqueId", _INT, (_ADDRESS,)),
    ("b3InitResetSimulationCommand", _ADDRESS, (_ADDRESS,)),
    ("b3InitResetSimulationSetFlags", _INT, (_ADDRESS, _INT)),
    ("b3InitPhysicsParamCommand", _ADDRESS, (_ADDRESS,)),
    ("b3PhysicsParamSetTimeStep", _INT, (_ADDRESS, _REAL)),
    ("b3PhysicsParamSetGravity", _INT, (_ADDRESS, _REAL, _REAL, _REAL)),
    ("b3PhysicsParamSetEnableFileCaching", _INT, (_ADDRESS, _INT)),
    ("b3InitStepSimulationCommand", _ADDRESS, (_ADDRESS,)),
    ("b3CreateCollisionShapeCommandInit", _ADDRESS, (_ADDRESS,)),
    ("b3CreateCollisionShapeAddBox", _INT, (_ADDRESS, _ADDRESS)),
    ("b3CreateMultiBodyCommandInit", _ADDRESS, (_ADDRESS,)),
    ("b3CreateMultiBodyBase", _INT, (_ADDRESS, _REAL, _INT, _INT, _ADDRESS, _ADDRESS, _ADDRESS, _ADDRESS)),
    ("b3InitChangeDynamicsInfo", _ADDRESS, (_ADDRESS,)),
    ("b3ChangeDynamicsInfoSetLateralFriction", _INT, (_ADDRESS, _INT, _INT, _REAL)),
    ("b3ChangeDynamicsInfoSetActivationState", _INT, (_ADDRESS, _INT, _INT)),
    ("b3LoadSoftBodyCommandInit", _ADDRESS, (_ADDRESS, _TEXT)),
    ("b3LoadSoftBodySetMass", _INT, (_ADDRESS, _REAL)),
    ("b3LoadSoftBodySetCollisionMargin", _INT, (_ADDRESS, _REAL)),
    ("b3LoadSoftBodySetFrictionCoefficient", _INT, (_ADDRESS, _REAL)),
    ("b3LoadSoftBodyUseFaceContact", _INT, (_ADDRESS, _INT)),
    ("b3LoadSoftBodyAddMassSpringForce", _INT, (_ADDRESS, _REAL, _REAL)),
    ("b3GetMeshDataCommandInit", _ADDRESS, (_ADDRESS, _INT, _INT)),
    ("b3GetMeshDataSimulationMesh", None, (_ADDRESS,)),
    ("b3MeshDataSimulationMeshVelocity", None, (_ADDRESS,)),
    ("b3GetMeshData", None, (_ADDRESS, _ADDRESS)),
    ("b3ResetMeshDataCommandInit", _ADDRESS, (_ADDRESS, _INT, _INT, _ADDRESS)),
)


@cache
def bullet() -> ctypes.PyDLL:
    """The library, loaded once a process.

    The pybullet *module* is never imported: its initialisation prints a line. ``PyDLL`` keeps the
    interpreter lock, so two threads are never inside Bullet at once; its allocator and profiler are global.

    Raises:
        BrokenPluginError: pybullet is not installed, or is a build that does not export its C API.
    """
    spec = importlib.util.find_spec("pybullet")
    if spec is None or spec.origin is None:
        raise BrokenPluginError(
            f"simulator 'pybullet' needs the package pybullet, which is not installed; {_HOW_TO_GET_IT}"
        )
    try:
        library = ctypes.PyDLL(spec.origin)
        for name, result, arguments in _FUNCTIONS:
            function = getattr(library, name)
            function.restype, function.argtypes = result, arguments
    except (OSError, AttributeError) as problem:
        raise BrokenPluginError(
            f"simulator 'pybullet' needs Bullet's C API, which {spec.origin} does not offer ({problem}); "
            f"{_HOW_TO_GET_IT}"
        ) from problem
    return library


def version() -> str:
    """Name and version of the engine.

    Raises:
        BrokenPluginError: pybullet is not installed.
    """
    try:
        return f"pybullet {importlib.metadata.version('pybullet')}"
    except importlib.metadata.PackageNotFoundError as problem:
        raise BrokenPluginError(
            f"simulator 'pybullet' needs the package pybullet, which is not installed; {_HOW_TO_GET_IT}"
        ) from problem
