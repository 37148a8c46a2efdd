"""How a step that touches nothing is made of a shorter one of MuJoCo's, which are by implicit Euler.

Implicit Euler of step h damps a mode of angular frequency w at the rate h w^2 / 2, whatever the material does: a rope
that swings at 2 Hz loses a third of it a second at 5 ms. What MuJoCo solves, with states before and behind its own
step combined, is a scheme that damps less.

References:
    Hairer and Wanner, *Solving Ordinary Differential Equations II*, 1996, sections IV.3 and V.1; Ascher, Ruuth and
    Wetton, *Implicit-explicit methods for time-dependent partial differential equations*, SIAM Journal on Numerical
    Analysis 32, 1995.
"""

from abc import ABC, abstractmethod

import numpy as np

from ...core.arrays import FloatArray

#: How far the first of many steps that look back is thrown, where they look back as far as is useful.
FIRST_OVERSHOOT = 0.7
#: Changes of the velocities that go to and fro from step to step: their correlation, the largest of them that nobody
#: sees [m a step], in how many steps on end they shake an object, and what is left then of looking back, if not so
#: little that it is of no use.
TO_AND_FRO, UNSEEN, ON_END, LEFT, OF_NO_USE = -0.3, 1e-4, 4, 0.25, 0.01


class Gliding(ABC):
    """A scheme on the displacements ``(N,)`` and their velocities, which are changed in place.

    What it says of a step holds until that step begins.

    Attributes:
        step: of MuJoCo [s].
        way: how long what is held takes from where MuJoCo starts to where the whole step ends, at its speed [s].
        own_damping: damping time of the stiffness-proportional damping that the scheme has by itself [s].
    """

    step: float
    way: float
    own_damping: float

    @abstractmethod
    def begin(self, x: FloatArray, v: FloatArray) -> None:
        """Put the state where MuJoCo starts."""

    @abstractmethod
    def forces(self, forces: FloatArray | None) -> FloatArray | None:
        """Those ``(N,)`` [N] to make the step with, of those where it begins; to be asked for after :meth:`begin`."""

    @abstractmethod
    def end(self, x: FloatArray, v: FloatArray) -> None:
        """Make the end of the step of where MuJoCo has come to."""

    @abstractmethod
    def forget(self) -> None:
        """The last step was not made so, and the next one must not look back."""


class Thrown(Gliding):
    """The theta method: from where the step ``theta h`` of implicit Euler leads, the state is thrown on to h.

    It damps at the rate (theta - 1/2) h w^2.

    Args:
        time_step: h [s].
        overshoot: how far it is thrown, as a part of MuJoCo's own step: 1 / theta - 1.
        count: N.
    """

    def __init__(self, time_step: float, overshoot: float, count: int) -> None:
        self.step = time_step / (1.0 + overshoot)
        self.way = time_step
        self.own_damping = 2.0 * self.step - time_step
        self._overshoot = overshoot
        self._x, self._v = np.empty(count), np.empty(count)

    def begin(self, x: FloatArray, v: FloatArray) -> None:
        self._x[:], self._v[:] = x, v

    def forces(self, forces: FloatArray | None) -> FloatArray | None:
        return forces

    def forget(self) -> None:
        pass

    def end(self, x: FloatArray, v: FloatArray) -> None:
        for now, was in ((x, self._x), (v, self._v)):
            np.subtract(now, was, out=was)
            was *= self._overshoot
            now += was


class TwoStep(Gliding):
    """From x_n + a (x_n - x_(n-1)) implicit Euler of step (1 - a) h leads to x_(n+1); the first step is thrown.

    With a = 1/3 that is BDF2: of second order, it damps at the rate h^3 w^4 / 4, a mode of 2 Hz at 5 ms by 0.001 a
    second. What is too fast for the step it damps as Euler does, which is a = 0. Forces that MuJoCo does not know are
    those where the step begins, which would be a step late: 2 f_n - f_(n-1) goes on to its end.

    How far a rope can look back hangs on how it lies: where what MuJoCo's implicit matrix leaves out is stiff or damped
    enough, the rope shakes, its velocities going to and fro from step to step. It then looks back less from there on.

    Args:
        time_step: h [s].
        looking_back: a at first, at most 1/3.
        count: N.
    """

    def __init__(self, time_step: float, looking_back: float, count: int) -> None:
        self._first = Thrown(time_step, FIRST_OVERSHOOT * 3.0 * looking_back, count)
        self._time_step = time_step
        self._x, self._v, self._change, self._forces = (np.empty(count) for _ in range(4))
        self._ahead, self._nothing = np.empty(count), np.zeros(count)
        self._gain, self._last_gain, self._shaken = np.zeros(count), np.zeros(count), 0
        self._look_back(looking_back)
        self.forget()

    def _look_back(self, looking_back: float) -> None:
        self._looking_back = looking_back
        self._step = (1.0 - looking_back) * self._time_step
        self._own_damping = self._time_step * (1.0 - 3.0 * looking_back) / (1.0 - looking_back)

    def forget(self) -> None:
        self._started = self._pushed = False
        self._last_gain[:] = self._gain[:] = 0.0
        self._shaken = 0
        self.step, self.way, self.own_damping = self._first.step, self._first.way, self._first.own_damping

    def begin(self, x: FloatArray, v: FloatArray) -> None:
        if not self._started:
            self._first.begin(x, v)
            self._x[:], self._v[:] = x, v
            return
        for now, was in ((x, self._x), (v, self._v)):
            np.subtract(now, was, out=self._change)
            self._change *= self._looking_back
            was[:] = now
            now += self._change

    def forces(self, forces: FloatArray | None) -> FloatArray | None:
        if forces is None and not self._pushed:
            return None
        given = self._nothing if forces is None else forces
        before = (self._forces if self._pushed else self._nothing) if self._started else given
        np.subtract(given, before, out=self._ahead)
        self._ahead += given
        self._forces[:], self._pushed = given, forces is not None
        return self._ahead

    def end(self, x: FloatArray, v: FloatArray) -> None:
        if not self._started:
            self._first.end(x, v)
            self._started = True
        elif self._looking_back > 0.0:
            self._calm(v)
        self.step = self.way = self._step
        self.own_damping = self._own_damping

    def _calm(self, v: FloatArray) -> None:
        """Look back less if the velocities ``v (N,)`` go to and fro."""
        self._gain, self._last_gain = self._last_gain, self._gain
        np.subtract(v, self._v, out=self._gain)
        along, size = self._gain @ self._last_gain, self._gain @ self._gain + self._last_gain @ self._last_gain
        if 2.0 * along > TO_AND_FRO * size or np.abs(self._gain).max() * self._time_step < UNSEEN:
            self._shaken = 0
            return
        self._shaken += 1
        if self._shaken == ON_END:
            left = LEFT * self._looking_back
            self._look_back(left if left > OF_NO_USE else 0.0)
            self._shaken = 0
