"""One connection to Bullet: a deformable world with one soft body in it."""

import ctypes
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from ...core.arrays import FloatArray, IntArray
from ...core.errors import RolloutFailed
from .library import bullet

_DEFORMABLE_WORLD = 1
_SOFT_BODY_LOADED = 99
_NEVER_SLEEP = 2
#: Distance at which Bullet makes a vertex touch [m]. The table is lowered by it, so that vertices rest at
#: the height asked for.
MARGIN = 0.002
_TABLE_HALF_EXTENTS = np.array([10.0, 10.0, 1.0])


class _MeshData(ctypes.Structure):
    _fields_ = (("count", ctypes.c_int), ("vertices", ctypes.POINTER(ctypes.c_double)))


@contextmanager
def _quiet() -> Iterator[None]:
    """Send what C code prints on standard output to nowhere; Bullet prints mesh statistics while loading."""
    sys.stdout.flush()
    libc = ctypes.CDLL(None)
    saved, nowhere = os.dup(1), os.open(os.devnull, os.O_WRONLY)
    try:
        libc.fflush(None)
        os.dup2(nowhere, 1)
        yield
    finally:
        libc.fflush(None)
        os.dup2(saved, 1)
        os.close(saved)
        os.close(nowhere)


def _address(values: FloatArray) -> int:
    return int(values.ctypes.data)


class Client:
    """A world of its own without gravity, advancing ``time_step`` [s] a step. Close it."""

    def __init__(self, time_step: float) -> None:
        self._api = bullet()
        self._handle: int | None = self._api.b3ConnectPhysicsDirect()
        self._soft = -1
        self._count = 0
        command = self._api.b3InitResetSimulationCommand(self._handle)
        self._api.b3InitResetSimulationSetFlags(command, _DEFORMABLE_WORLD)
        self._submit(command)
        command = self._api.b3InitPhysicsParamCommand(self._handle)
        self._api.b3PhysicsParamSetTimeStep(command, time_step)
        self._api.b3PhysicsParamSetGravity(command, 0.0, 0.0, 0.0)
        # Files are cached by name for the life of the process, which would grow without end.
        self._api.b3PhysicsParamSetEnableFileCaching(command, 0)
        self._submit(command)

    def _submit(self, command: int) -> int:
        return int(self._api.b3SubmitClientCommandAndWaitStatus(self._handle, command))

    def add_table(self, height: float, friction: float) -> None:
        """A fixed horizontal slab on which vertices come to rest at ``height`` [m].

        A box and not Bullet's plane: soft bodies float 0.1 m above that and creep away from it.
        """
        api = self._api
        command = api.b3CreateCollisionShapeCommandInit(self._handle)
        api.b3CreateCollisionShapeAddBox(command, _address(_TABLE_HALF_EXTENTS))
        shape = api.b3GetStatusCollisionShapeUniqueId(self._submit(command))
        centre = np.array([0.0, 0.0, height - MARGIN - _TABLE_HALF_EXTENTS[2]])
        origin, upright = np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0])
        command = api.b3CreateMultiBodyCommandInit(self._handle)
        api.b3CreateMultiBodyBase(
            command, 0.0, shape, -1, _address(centre), _address(upright), _address(origin), _address(upright)
        )
        body = api.b3GetStatusBodyIndex(self._submit(command))
        command = api.b3InitChangeDynamicsInfo(self._handle)
        api.b3ChangeDynamicsInfoSetLateralFriction(command, body, -1, friction)
        self._submit(command)

    def load(self, path: str, mass: float, count: int, lame: tuple[float, float] | None) -> None:
        """Load the soft body, ``mass`` [kg] shared equally by its ``count`` vertices.

        Args:
            lame: Bullet's two Neo-Hookean constants [Pa], or None for a body without elasticity.

        Raises:
            RolloutFailed: Bullet refuses the file or reads another number of vertices from it.
        """
        api = self._api
        command = api.b3LoadSoftBodyCommandInit(self._handle, os.fsencode(path))
        api.b3LoadSoftBodySetMass(command, mass)
        api.b3LoadSoftBodySetCollisionMargin(command, MARGIN)
        api.b3LoadSoftBodyUseFaceContact(command, 0)
        # Bullet multiplies the coefficients of the two bodies: the table carries the real one.
        api.b3LoadSoftBodySetFrictionCoefficient(command, 1.0)
        if lame is None:
            api.b3LoadSoftBodyAddMassSpringForce(command, 0.0, 0.0)
        else:
            api.b3LoadSoftBodyAddNeoHookeanForce(command, lame[0], lame[1], 0.0)
        with _quiet():
            status = self._submit(command)
        if api.b3GetStatusType(status) != _SOFT_BODY_LOADED:
            raise RolloutFailed("Bullet refused to load the mesh")
        self._soft, self._count = api.b3GetStatusBodyIndex(status), count
        command = api.b3InitChangeDynamicsInfo(self._handle)
        api.b3ChangeDynamicsInfoSetActivationState(command, self._soft, _NEVER_SLEEP)
        self._submit(command)
        found = len(self.positions())
        if found != count:
            raise RolloutFailed(f"Bullet made {found} vertices from a mesh of {count}; some coincide or are unused")

    def fix(self, vertices: IntArray) -> None:
        """Make ``vertices`` infinitely heavy; they then move with the velocity they are given."""
        origin = np.zeros(3)
        for vertex in vertices:
            self._submit(
                self._api.b3InitCreateSoftBodyAnchorConstraintCommand(
                    self._handle, self._soft, int(vertex), -1, -1, _address(origin)
                )
            )

    def _read(self, velocity: bool) -> FloatArray:
        api, data = self._api, _MeshData()
        command = api.b3GetMeshDataCommandInit(self._handle, self._soft, -1)
        api.b3GetMeshDataSimulationMesh(command)
        if velocity:
            api.b3MeshDataSimulationMeshVelocity(command)
        self._submit(command)
        api.b3GetMeshData(self._handle, ctypes.byref(data))
        # Bullet's vectors have a fourth, unused component; the memory is overwritten by the next read.
        return np.ctypeslib.as_array(data.vertices, (data.count, 4))[:, :3].copy()

    def _write(self, values: FloatArray, velocity: bool) -> None:
        values = np.ascontiguousarray(values, dtype=np.float64)
        command = self._api.b3ResetMeshDataCommandInit(self._handle, self._soft, self._count, _address(values))
        if velocity:
            self._api.b3MeshDataSimulationMeshVelocity(command)
        self._submit(command)

    def positions(self) -> FloatArray:
        """``(V, 3)`` [m], a copy."""
        return self._read(velocity=False)

    def velocities(self) -> FloatArray:
        """``(V, 3)`` [m/s], a copy."""
        return self._read(velocity=True)

    def set_positions(self, positions: FloatArray) -> None:
        """Move every vertex to ``(V, 3)`` [m]; velocities stay."""
        self._write(positions, velocity=False)

    def set_velocities(self, velocities: FloatArray) -> None:
        """Give every vertex a velocity ``(V, 3)`` [m/s]."""
        self._write(velocities, velocity=True)

    def step(self) -> None:
        """Advance by the time step."""
        self._submit(self._api.b3InitStepSimulationCommand(self._handle))

    def close(self) -> None:
        """Free the world; a second call does nothing."""
        if self._handle is not None:
            self._api.b3DisconnectSharedMemory(self._handle)
            self._handle = None
