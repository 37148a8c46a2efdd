"""One connection to Bullet: a deformable world with nodes that move freely and touch fixed shapes."""

import ctypes
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from ...core.arrays import FloatArray, IntArray
from ...core.errors import RolloutFailed
from .library import bullet
from .meshfile import node_file

_DEFORMABLE_WORLD = 1
_SOFT_BODY_LOADED = 99
_NEVER_SLEEP = 2
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
        self._nodes = 0
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

    def load(self, count: int, mass: float, margin: float) -> None:
        """Load ``count`` nodes that share ``mass`` [kg] equally and keep ``margin`` [m] away from shapes.

        Raises:
            RolloutFailed: Bullet refuses the file or reads another number of nodes from it.
        """
        api = self.api
        nodes = max(count, 3)
        with node_file(nodes) as path:
            command = api.b3LoadSoftBodyCommandInit(self.handle, os.fsencode(path))
            api.b3LoadSoftBodySetMass(command, mass)
            api.b3LoadSoftBodySetCollisionMargin(command, margin)
            api.b3LoadSoftBodyUseFaceContact(command, 0)
            # Bullet multiplies the coefficients of the two bodies: the obstacles carry the real one.
            api.b3LoadSoftBodySetFrictionCoefficient(command, 1.0)
            api.b3LoadSoftBodyAddMassSpringForce(command, 0.0, 0.0)
            with _quiet():
                status = self._submit(command)
        if api.b3GetStatusType(status) != _SOFT_BODY_LOADED:
            raise RolloutFailed("Bullet refused to load the nodes")
        self._soft, self._nodes = api.b3GetStatusBodyIndex(status), nodes
        command = api.b3InitChangeDynamicsInfo(self.handle)
        api.b3ChangeDynamicsInfoSetActivationState(command, self._soft, _NEVER_SLEEP)
        self._submit(command)
        self._read(velocity=False, out=np.empty((nodes, 4)))

    def fix(self, vertices: IntArray) -> None:
        """Make ``vertices`` infinitely heavy; they then move with the velocity they are given."""
        origin = np.zeros(3)
        for vertex in vertices:
            self._submit(
                self.api.b3InitCreateSoftBodyAnchorConstraintCommand(
                    self.handle, self._soft, int(vertex), -1, -1, address(origin)
                )
            )

    def _read(self, velocity: bool, out: FloatArray) -> None:
        """Copy to ``out (V, 4)``: Bullet's vectors have a fourth, unused component."""
        api, data = self.api, self._data
        command = api.b3GetMeshDataCommandInit(self.handle, self._soft, -1)
        api.b3GetMeshDataSimulationMesh(command)
        if velocity:
            api.b3MeshDataSimulationMeshVelocity(command)
        self._submit(command)
        api.b3GetMeshData(self.handle, ctypes.byref(data))
        if data.count != self._nodes:
            raise RolloutFailed(f"Bullet has {data.count} nodes instead of {self._nodes}")
        ctypes.memmove(address(out), data.vertices, 4 * _REAL_SIZE * len(out))

    def read_positions(self, out: FloatArray) -> None:
        """Copy positions [m] to the first three columns of ``out (V, 4)``."""
        self._read(False, out)

    def read_velocities(self, out: FloatArray) -> None:
        """Copy velocities [m/s] to the first three columns of ``out (V, 4)``."""
        self._read(True, out)

    def _write(self, values: FloatArray, velocity: bool) -> None:
        values = np.ascontiguousarray(values, dtype=np.float64)
        if len(values) < self._nodes:  # what is missing follows the last vertex
            values = np.concatenate([values, np.repeat(values[-1:], self._nodes - len(values), axis=0)])
        command = self.api.b3ResetMeshDataCommandInit(self.handle, self._soft, self._nodes, address(values))
        if velocity:
            self.api.b3MeshDataSimulationMeshVelocity(command)
        self._submit(command)

    def set_positions(self, positions: FloatArray) -> None:
        """Move every vertex to ``(V, 3)`` [m]; velocities stay."""
        self._write(positions, velocity=False)

    def set_velocities(self, velocities: FloatArray) -> None:
        """Give every vertex a velocity ``(V, 3)`` [m/s]."""
        self._write(velocities, velocity=True)

    def step(self) -> None:
        """Advance by the time step."""
        self._submit(self.api.b3InitStepSimulationCommand(self.handle))

    def close(self) -> None:
        """Free the world; a second call does nothing."""
        if self.handle is not None:
            self.api.b3DisconnectSharedMemory(self.handle)
            self.handle = None
