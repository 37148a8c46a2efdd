"""Internal friction of bending: what makes a cloth stay where it was bent to."""

from typing import ClassVar

import numpy as np

from ...core.arrays import FloatArray
from ...core.bending import Bending, SheetBending
from ...core.effect import Effect, NodalForce
from ...core.parameters import Parameter
from ...core.scene import Scene
from ...core.simulator import State

#: Change of curvature [1/m] over which the friction builds up, where the time step allows so stiff a spring.
SLIP_CURVATURE = 5.0
#: Highest (h w)^2 of a step h with a spring of frequency w; a force held over the step is unstable from 2.
_STEADY = 0.25


class BendingHysteresis(Effect):
    """Friction between the yarns of a bent cloth: M = B kappa + M_f sgn(d kappa / dt).

    A spring in series with a Coulomb slider at every place of the cloth, in the tensor of curvature: the friction
    moment follows changes of curvature up to M_f and then stays. A cycle between curvatures +-K takes the energy
    4 M_f (K - K_s) per area, where K_s = M_f / k is the change of curvature over which friction builds up, k the
    stiffness of the spring. K_s is :data:`SLIP_CURVATURE`, or more where the masses are too light for so stiff a
    spring at the time step: what is not resolved is the beginning of the sliding, never its moment.

    The width 2HB of the loop that Kawabata's bending tester measures is 2 M_f. It is 0.005 to 0.15 gf cm/cm, so
    M_f is 2.5e-5 to 7.4e-4 N.

    References:
        Kawabata, *The Standardization and Analysis of Hand Evaluation*, 1980; Lahey and Heppler, *Mechanical
        modeling of fabrics in bending*, 2004; Miguel et al., *Modeling and estimation of internal friction in
        cloth*, 2013.
    """

    name: ClassVar[str] = "bending-hysteresis"
    acts_on: ClassVar[str] = "force"
    dissipative: ClassVar[bool] = True
    object_kinds: ClassVar[frozenset[str]] = frozenset({"cloth"})
    coefficients: ClassVar[tuple[Parameter, ...]] = (
        Parameter("friction_moment", "N", 0.0, 1e-3, description="M_f, moment per length; half of Kawabata's 2HB"),
    )
    symptom: ClassVar[str] = "springs back from every bend in the model where the real one stays a little bent"

    def bind(self, scene: Scene, masses: FloatArray) -> NodalForce:
        return _Friction(SheetBending(scene.body), self.values["friction_moment"], scene, masses)


class _Friction:
    """Springs with sliders on one object in one rollout.

    The force acts through the next step with the moment that is reached after it at the present velocities. That
    is a damper of h k beside the spring k: a spring alone, held through a step, would feed vibrations.
    """

    def __init__(self, bending: Bending, limit: float, scene: Scene, masses: FloatArray) -> None:
        bending.follow(scene.start_positions)
        self._bending, self._limit = bending, limit
        self._stiffest = bending.stiffest(masses, scene.held)
        self._curvature = bending.curvature
        self._moment = np.zeros_like(bending.curvature)
        self._time: float | None = None

    def __call__(self, time: float, state: State) -> FloatArray:
        self._bending.follow(state.positions)
        change = self._bending.curvature - self._curvature
        self._curvature = self._bending.curvature
        step = 0.0 if self._time is None else time - self._time
        self._time = time
        # limit / stiffness: the change of curvature that builds the friction up
        stiffness = self._limit / max(SLIP_CURVATURE, self._limit * step**2 * self._stiffest / _STEADY)
        self._moment = self._capped(self._moment + stiffness * change)
        ahead = stiffness * step * self._bending.rates(state.velocities)
        return self._bending.forces(self._capped(self._moment + ahead))

    def _capped(self, moment: FloatArray) -> FloatArray:
        size = np.sqrt(np.einsum("nk,nk->n", moment, moment))
        return np.asarray(moment * (self._limit / np.maximum(size, self._limit))[:, None])
