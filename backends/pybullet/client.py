"""One connection to Bullet: a deformable world with nodes that move freely and touch fixed shapes."""

import ctypes
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from ...core.arrays import FloatArray
from ...core.errors import RolloutFailed
from .library import bullet
from .meshfile import HUB, node_file

_DEFORMABLE_WORLD = 1
_SOFT_BODY_LOADED = 99
_NEVER_SLEEP = 2
#: Height at which nodes are out of reach of everything [m].
_AWAY = 1000.0
_UPRIGHT = np.array([0.0, 0.0, 0.0, 1.0])
_REAL_SIZE = ctypes.sizeof(ctypes.c_double)


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


def address(values: FloatArray) -> int:
    """Of the first number of a contiguous array."""
    return int(values.ctypes.data)


class Client:
    """A world of its own without gravity. Close it."""

    def __init__(self) -> None:
        self.api = bullet()
        self.handle: int | None = self.api.b3ConnectPhysicsDirect()
        self._soft = -1
        self._parked = self._places = self._speeds = np.zeros((0, 3))
        self._data = _MeshData()
        self._time_step = 0.0
        command = self.api.b3InitResetSimulationCommand(self.handle)
        self.api.b3InitResetSimulationSetFlags(command, _DEFORMABLE_WORLD)
        self._submit(command)
        command = self.api.b3InitPhysicsParamCommand(self.handle)
        self.api.b3PhysicsParamSetGravity(command, 0.0, 0.0, 0.0)
        # Files are cached by name for the life of the process, which would grow without end.
        self.api.b3PhysicsParamSetEnableFileCaching(command, 0)
        self._submit(command)

    def _submit(self, command: int) -> int:
        return int(self.api.b3SubmitClientCommandAndWaitStatus(self.handle, command))

    def set_time_step(self, time_step: float) -> None:
        """Advance by ``time_step`` [s] a step from now on."""
        if time_step != self._time_step:
            command = self.api.b3InitPhysicsParamCommand(self.handle)
            self.api.b3PhysicsParamSetTimeStep(command, time_step)
            self._submit(command)
            self._time_step = time_step

    def new_shape(self) -> int:
        """A command to which one shape is to be added."""
        return int(self.api.b3CreateCollisionShapeCommandInit(self.handle))

    def add_fixed(self, shape_command: int, place: FloatArray, friction: float) -> None:
        """Fix a shape at ``place (3,)`` [m].

        Raises:
            RolloutFailed: Bullet makes nothing of the shape.
        """
        api = self.api
        shape = api.b3GetStatusCollisionShapeUniqueId(self._submit(shape_command))
        if shape < 0:
            raise RolloutFailed("Bullet refused the shape of an obstacle")
        place, origin = np.ascontiguousarray(place), np.zeros(3)
        command = api.b3CreateMultiBodyCommandInit(self.handle)
        api.b3CreateMultiBodyBase(
            command, 0.0, shape, -1, address(place), address(_UPRIGHT), address(origin), address(_UPRIGHT)
        )
        body = api.b3GetStatusBodyIndex(self._submit(command))
        command = api.b3InitChangeDynamicsInfo(self.handle)
        api.b3ChangeDynamicsInfoSetLateralFriction(command, body, -1, friction)
        self._submit(command)

    def load(self, count: int, margin: float) -> None:
        """Load ``count`` nodes that keep ``margin`` [m] away from shapes, out of their reach for now.

        Raises:
            RolloutFailed: Bullet refuses the file or reads another number of nodes from it.
        """
        api = self.api
        with node_file(count) as path:
            command = api.b3LoadSoftBodyCommandInit(self.handle, os.fsencode(path))
            api.b3LoadSoftBodySetMass(command, 1.0)
            api.b3LoadSoftBodySetCollisionMargin(command, margin)
            api.b3LoadSoftBodyUseFaceContact(command, 0)
            # Bullet multiplies the coefficients of the two bodies: the obstacles carry the real one.
            api.b3LoadSoftBodySetFrictionCoefficient(command, 1.0)
            api.b3LoadSoftBodyAddMassSpringForce(command, 0.0, 0.0)
            with _quiet():
                status = self._submit(command)
        if api.b3GetStatusType(status) != _SOFT_BODY_LOADED:
            raise RolloutFailed("Bullet refused to load the nodes")
        self._soft = api.b3GetStatusBodyIndex(status)
        nodes = count + HUB
        self._parked = np.stack([0.01 * np.arange(nodes), 0.01 * (np.arange(nodes) % 2), np.full(nodes, _AWAY)], axis=1)
        self._places, self._speeds = self._parked.copy(), np.zeros((nodes, 3))
        command = api.b3InitChangeDynamicsInfo(self.handle)
        api.b3ChangeDynamicsInfoSetActivationState(command, self._soft, _NEVER_SLEEP)
        self._submit(command)
        self.set_positions(self._parked[:0])
        self.positions(count)

    def _read(self, count: int, velocity: bool) -> FloatArray:
        """Of the first ``count`` nodes ``(count, 3)``; Bullet's vectors have a fourth, unused component."""
        api, data, out = self.api, self._data, np.empty((count, 4))
        command = api.b3GetMeshDataCommandInit(self.handle, self._soft, -1)
        api.b3GetMeshDataSimulationMesh(command)
        if velocity:
            api.b3MeshDataSimulationMeshVelocity(command)
        self._submit(command)
        api.b3GetMeshData(self.handle, ctypes.byref(data))
        if data.count != len(self._places):
            raise RolloutFailed(f"Bullet has {data.count} nodes instead of {len(self._places)}")
        ctypes.memmove(address(out), data.vertices, 4 * _REAL_SIZE * count)
        return out[:, :3]

    def positions(self, count: int) -> FloatArray:
        """Of the first ``count`` nodes ``(count, 3)`` [m]."""
        return self._read(count, velocity=False)

    def velocities(self, count: int) -> FloatArray:
        """Of the first ``count`` nodes ``(count, 3)`` [m/s]."""
        return self._read(count, velocity=True)

    def _write(self, values: FloatArray, velocity: bool) -> None:
        command = self.api.b3ResetMeshDataCommandInit(self.handle, self._soft, len(values), address(values))
        if velocity:
            self.api.b3MeshDataSimulationMeshVelocity(command)
        self._submit(command)

    def set_positions(self, positions: FloatArray) -> None:
        """Put the first nodes at ``(N, 3)`` [m] and all others out of reach."""
        count = len(positions)
        self._places[:count], self._places[count:] = positions, self._parked[count:]
        self._write(self._places, velocity=False)

    def set_velocities(self, velocities: FloatArray) -> None:
        """Give the first nodes velocities ``(N, 3)`` [m/s] and let all others rest."""
        count = len(velocities)
        self._speeds[:count], self._speeds[count:] = velocities, 0.0
        self._write(self._speeds, velocity=True)

    def step(self) -> None:
        """Advance by the time step."""
        self._submit(self.api.b3InitStepSimulationCommand(self.handle))

    def close(self) -> None:
        """Free the world; a second call does nothing."""
        if self.handle is not None:
            self.api.b3DisconnectSharedMemory(self.handle)
            self.handle = None
