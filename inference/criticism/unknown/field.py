"""An unknown force in a rollout: told by coefficients, and if wanted a pull towards what was measured."""

from dataclasses import dataclass
from functools import partial
from typing import Any, ClassVar, cast

import numpy as np

from ....core.arrays import FloatArray
from ....core.effect import Effect, NodalForce
from ....core.parameters import Parameter
from ....core.scene import Scene
from ....core.simulator import State
from .basis import Basis

#: The coefficient that says how fast a model is pulled towards its aim [rad/s].
PULL = "pull"


@dataclass(frozen=True, eq=False)
class Aim:
    """Where the markers were measured.

    Args:
        times: rising at equal steps ``(N,)`` [s].
        positions, velocities: ``(N, M, 3)`` [m], [m/s].
        markers: weights ``(M, V)`` that give marker positions from vertex positions.
        spread: ``(P, M)``: modal amplitudes of a field that is known at the markers.
    """

    times: FloatArray
    positions: FloatArray
    velocities: FloatArray
    markers: FloatArray
    spread: FloatArray

    def at(self, time: float) -> tuple[FloatArray, FloatArray]:
        """Positions and velocities ``(M, 3)``, linear in between."""
        step = self.times[1] - self.times[0]
        place = float(np.clip((time - self.times[0]) / step, 0.0, len(self.times) - 1.001))
        k, share = int(place), place % 1.0
        return (
            (1 - share) * self.positions[k] + share * self.positions[k + 1],
            (1 - share) * self.velocities[k] + share * self.velocities[k + 1],
        )


class UnknownForce(Effect):
    """A nodal force that nobody has named: mass times an acceleration that is smooth in time and over the mesh.

    With the coefficient ``pull`` = w above zero the modes of the basis are drawn to the aim, besides, by
    w^2 (y - x) + 2 w (y' - x'): a critically damped observer (Luenberger 1971) which makes a model follow a
    measurement that it would otherwise leave at once, and whose pull says which force it lacks.

    Args:
        basis: of the field.
        aim: what was measured, or None.
        values: coefficients by the number of the function [m/s2]; those that are missing are zero.
    """

    name: ClassVar[str] = "unknown-force"
    acts_on: ClassVar[str] = "force"
    candidate: ClassVar[bool] = False
    coefficients: ClassVar[tuple[Parameter, ...]] = ()

    def __init__(self, basis: Basis, aim: Aim | None, **values: float) -> None:
        super().__init__()
        self.basis, self.aim = basis, aim
        self.values = dict(values)

    def bind(self, scene: Scene, masses: FloatArray) -> NodalForce:
        basis, aim, rate = self.basis, self.aim, self.values.get(PULL, 0.0)
        coefficients = np.array([self.values.get(str(k), 0.0) for k in range(len(basis))])
        table, weights = basis.table(coefficients), masses[:, None]

        def force(time: float, state: State) -> FloatArray:
            modal = np.tensordot(basis.cosines(np.array([time]))[0], table, axes=1)
            if aim is not None and rate > 0 and time >= aim.times[0]:  # before, nothing was seen
                modal = modal + pulled(aim, rate, time, state.positions, state.velocities)
            return np.asarray(weights * (basis.modes @ modal))

        return force


def pulled(aim: Aim, rate: float, time: float, positions: FloatArray, velocities: FloatArray) -> FloatArray:
    """Modal accelerations ``(P, 3)`` [m/s2] with which the aim draws vertices ``(V, 3)``."""
    where, how_fast = aim.at(time)
    away = rate**2 * (where - aim.markers @ positions) + 2 * rate * (how_fast - aim.markers @ velocities)
    return np.asarray(aim.spread @ away)


def field_effect(basis: Basis, aim: Aim | None) -> type[Effect]:
    """What makes an :class:`UnknownForce` of its values, as the class of an effect does; it can be pickled."""
    return cast("type[Effect]", cast(Any, partial(UnknownForce, basis, aim)))
