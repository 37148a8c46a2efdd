"""The lab: runs worlds for the virtual tests, without a scenario or grippers in between."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import TypeAlias

import numpy as np

from ..arrays import FloatArray
from ..errors import RolloutFailed
from ..sanity import SanityCheck
from ..scene import Scene
from ..simulator import Simulator, State, World

#: ``(time [s], state, masses (V,) [kg]) -> nodal forces (V, 3) [N]``
Push: TypeAlias = Callable[[float, State, FloatArray], FloatArray]
#: ``time [s] -> where the held vertices are (H, 3) [m]``
Lead: TypeAlias = Callable[[float], FloatArray]
#: ``(time [s], state) -> whether it is enough``
Stop: TypeAlias = Callable[[float, State], bool]
#: Largest artificial damping times the world's time step: it acts explicitly.
_MOST_DAMPING = 0.2
_LEAST_STEPS = 12
#: Damping time of the material [s]: enough for vibrations faster than a step, and cheap for explicit engines.
_DAMPING_TIME = 3e-5
_MOST_INTERVALS = 60
_CHECK_EVERY = 10


class TooSlow(RolloutFailed):
    """A run took longer than the bench allows."""


class Lab:
    """One simulator under test.

    Args:
        simulator: any.
        time_limit: seconds of this process that a run may take.
    """

    def __init__(self, simulator: Simulator, time_limit: float = np.inf) -> None:
        self.simulator = simulator
        self.time_limit = time_limit

    def watch(
        self,
        scene: Scene,
        duration: float,
        look: Callable[[State], FloatArray],
        push: Push | None = None,
        lead: Lead | None = None,
        stop: Stop | None = None,
    ) -> tuple[FloatArray, FloatArray]:
        """Run a world and look at its state after every step.

        Args:
            scene: to build.
            duration: [s].
            look: gives an array of any one shape.
            push: forces besides gravity, elasticity and contact.
            lead: where the held vertices are; default where they start.
            stop: ends the run early.

        Returns:
            Times ``(T,)`` [s] and what was seen ``(T, ...)``.

        Raises:
            InputError: the simulator does not claim to do this.
            RolloutFailed: it could not, or took too long.
        """
        with self._opened(scene) as world:
            return self._loop(world, scene, duration, look, push, lead, stop)

    def settle(
        self,
        scene: Scene,
        pace: float,
        accuracy: float,
        push: Push | None = None,
        lead: Lead | None = None,
        busy: float = 0.0,
        damping_time: float = _DAMPING_TIME,
    ) -> FloatArray:
        """Where the object comes to rest ``(V, 3)`` [m], found with damping that vanishes there.

        An artificial force -2 pace m v brakes the slow motions. It is held over a step of the world, within which fast
        vibrations turn around, so that it would rather feed those of an explicit engine; they are damped by the
        material. At rest means that no vertex moved by
        more than ``accuracy`` in a time of 3 / pace.

        Args:
            scene: to build.
            pace: angular frequency of the slowest motion that matters [1/s]; it is damped critically.
            accuracy: [m].
            push: forces that stay.
            lead: where the held vertices are.
            busy: how long ``lead`` moves them [s].
            damping_time: of the material [s].

        Raises:
            InputError: the simulator does not claim to do this.
            RolloutFailed: it could not, or did not come to rest.
        """
        damped = replace(scene, material=replace(scene.material, damping_time=damping_time))
        with self._opened(damped) as world:
            interval = max(3.0 / pace, _LEAST_STEPS * world.time_step)
            rate = min(2.0 * pace, _MOST_DAMPING / world.time_step)
            limit = busy + _MOST_INTERVALS * interval
            then, last, left = busy, scene.start_positions, np.inf

            def at_rest(now: float, state: State) -> bool:
                nonlocal then, last, left
                if now < then + interval:
                    return False
                left = float(np.abs(state.positions - last).max())
                then, last = now, np.array(state.positions)
                return left < accuracy

            def braked(now: float, state: State, masses: FloatArray) -> FloatArray:
                slow = -rate * masses[:, None] * state.velocities
                return slow if push is None else slow + push(now, state, masses)

            self._loop(world, scene, limit, lambda state: np.zeros(0), braked, lead, at_rest)
        if not left < accuracy:
            raise RolloutFailed(
                f"did not come to rest in {limit:.2g} s: a vertex still moves {1e3 * left:.2g} mm in {interval:.2g} s"
            )
        return last

    @contextmanager
    def _opened(self, scene: Scene) -> Iterator[World]:
        self._deadline = time.process_time() + self.time_limit
        self.simulator.check(scene)
        world = self.simulator.open(scene)
        try:
            yield world
        finally:
            world.close()

    def _loop(
        self,
        world: World,
        scene: Scene,
        duration: float,
        look: Callable[[State], FloatArray],
        push: Push | None,
        lead: Lead | None,
        stop: Stop | None,
    ) -> tuple[FloatArray, FloatArray]:
        dt, masses = world.time_step, world.masses.copy()
        sane, still = SanityCheck(scene), scene.start_positions[scene.held]
        steps = int(np.ceil(duration / dt - 1e-9))
        seen = []
        for k in range(steps + 1):
            now, state = k * dt, world.state()
            seen.append(np.array(look(state)))
            if k % _CHECK_EVERY == 0 or k == steps:
                sane(state.positions, now)
                if time.process_time() > self._deadline:
                    raise TooSlow(f"took longer than {self.time_limit:.2g} s, and had come to {now:.3f} s")
            if k == steps or (stop is not None and stop(now, state)):
                break
            force = None if push is None else push(now, state, masses)
            world.step(still if lead is None else lead(now + dt), force)
        return np.arange(len(seen), dtype=np.float64) * dt, np.array(seen)


def period(times: FloatArray, values: FloatArray) -> float:
    """Period [s] of a decaying oscillation about zero: twice the mean time between its zeros.

    Raises:
        RolloutFailed: it does not cross zero twice.
    """
    change = np.flatnonzero(np.sign(values[:-1]) * np.sign(values[1:]) < 0)
    if len(change) < 2:
        raise RolloutFailed(f"no oscillation: zero is crossed {len(change)} times in {times[-1]:.2g} s")
    share = values[change] / (values[change] - values[change + 1])
    zeros = times[change] + share * (times[change + 1] - times[change])
    return float(2 * (zeros[-1] - zeros[0]) / (len(zeros) - 1))
