"""A short rope on the reference simulator with a made-up fit, and drags that only fast motions tell apart."""

from dataclasses import replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest

from muslin.core.arrays import FloatArray
from muslin.core.effect import Effect, NodalForce
from muslin.core.errors import RolloutFailed
from muslin.core.material import RopeMaterial
from muslin.core.measurement import Measurement, Recording
from muslin.core.measurement_store import save_measurement
from muslin.core.motion import Motion
from muslin.core.parameters import Parameter
from muslin.core.registry import REGISTRY
from muslin.core.rollout import rollout
from muslin.core.scenarios import preset, smooth_path
from muslin.core.scene import Scene
from muslin.core.simulator import State, World
from muslin.core.store import put
from muslin.core.study import Study, parse_config, write_config
from muslin.core.study.windows import cut_all
from muslin.core.testing.reference import ReferenceSimulator

NOISE = 0.008
STIFFNESS = 50.0


class LinearDrag(Effect):
    name: ClassVar[str] = "linear-drag"
    acts_on: ClassVar[str] = "force"
    coefficients: ClassVar[tuple[Parameter, ...]] = (Parameter("rate", "1/s", 0.0, 5.0),)

    def bind(self, scene: Scene, masses: FloatArray) -> NodalForce:
        factor = -self.values["rate"] * masses[:, None]
        return lambda time, state: factor * state.velocities


class TwinDrag(LinearDrag):
    name: ClassVar[str] = "twin-drag"


class QuadraticDrag(Effect):
    name: ClassVar[str] = "quadratic-drag"
    acts_on: ClassVar[str] = "force"
    coefficients: ClassVar[tuple[Parameter, ...]] = (Parameter("factor", "1/m", 0.0, 20.0),)

    def bind(self, scene: Scene, masses: FloatArray) -> NodalForce:
        factor = -self.values["factor"] * masses[:, None]

        def force(time: float, state: State) -> FloatArray:
            return factor * state.velocities * np.linalg.norm(state.velocities, axis=1, keepdims=True)

        return force


class Fragile(ReferenceSimulator):
    """Fails where the held end is faster than :attr:`strength` [m/s]."""

    name: ClassVar[str] = "fragile"
    strength: ClassVar[float] = 0.2

    def open(self, scene: Scene) -> World:
        world = super().open(scene)
        step, strength = world.step, self.strength

        def careful(held: FloatArray, forces: FloatArray | None, stiffness: FloatArray | None = None) -> None:
            moved = float(np.linalg.norm(held - world.state().positions[scene.held], axis=1).max())
            if moved > strength * world.time_step:
                raise RolloutFailed("torn")
            step(held, forces, stiffness)

        world.step = careful  # type: ignore[method-assign]
        return world


class Stepped(ReferenceSimulator):
    """Knows that a smaller step would do better, as the engines do."""

    name: ClassVar[str] = "stepped"

    def finer(self) -> "Stepped":
        return type(self)(time_step=self.time_step / 2)


def register(monkeypatch: pytest.MonkeyPatch) -> None:
    for effect in (LinearDrag, TwinDrag, QuadraticDrag):
        monkeypatch.setitem(REGISTRY._objects, ("effect", effect.name), effect)
    for simulator in (ReferenceSimulator, Fragile, Stepped):
        monkeypatch.setitem(REGISTRY._objects, ("simulator", simulator.name), simulator)


#: To and fro, gently; up and down again.
GENTLE = smooth_path([(0, 0, 0, 1), (0.5, 0.03, 0, 1), (1.0, 0, 0, 1)])
LIFT = smooth_path([(0, 0, 0, 1), (1.0, 0, 0, 1.4), (2.0, 0, 0, 1)])


def rope_study(
    folder: Path, *effects: Effect, simulator: str = "reference", noise: float = NOISE, motion: Motion = GENTLE
) -> Study:
    """A rope moved once, with a fit that is what a fit would find without any effects."""
    times = np.arange(0, motion.times[-1], 1 / 25)
    scenario = replace(preset("swing").scenario(size=[0.4], vertices=[5]), motion=motion, times=times, settle=0.0)
    truth = RopeMaterial(stretch_stiffness=STIFFNESS, linear_density=0.05)
    series = rollout(ReferenceSimulator(0.02), scenario, truth, effects).series
    noisy = series.points + np.random.default_rng(0).normal(0, noise, series.points.shape)
    save_measurement(Measurement((Recording("slow", replace(series, points=noisy), motion),)), folder / "m.zarr")
    table = {
        "study": {"measurement": "m.zarr"},
        "scenario": {"name": "swing", "size": [0.4], "vertices": [5], "settle": 0.0},
        "simulator": {"name": simulator, "time_step": 0.02},
        "material": {"linear_density": 0.05},
        "noise": {"sd": noise},
        "parameters": {"stretch_stiffness": {"low": 20.0, "high": 200.0, "scale": "log"}},
    }
    write_config(parse_config(table, "test"), folder / "study.toml")
    study = Study.load(folder / "study.toml", workers=0)
    _put_fit(study, noise)
    return study


def cut_in_half(study: Study, noise: float = NOISE) -> None:
    """What is fitted in two pieces, as where a study has a window."""
    problem = study.problem
    (recording,) = problem.recordings.values()
    pieces, of = cut_all([recording], 0.5 * float(np.ptp(recording.series.time)))
    (whole,) = problem.scenarios.values()
    study.__dict__["problem"] = replace(
        problem,
        recordings={p.name: p for p in pieces},
        fit_on=tuple(of),
        scenarios={p.name: whole.for_recording(p) for p in pieces},
        cut_from={name: r.name for name, r in of.items()},
    )
    _put_fit(study, noise)


def _put_fit(study: Study, noise: float) -> None:
    space = study.problem.space
    group = study.results("r+").create_group("fit", overwrite=True)
    unit = space.to_unit(np.array([STIFFNESS]))
    put(group, "estimate", np.array([STIFFNESS]), ["parameter"])
    put(group, "estimate_sd", np.array([2.0]), ["parameter"])
    put(group, "estimate_unit", unit, ["parameter"])
    put(group, "estimate_covariance", np.array([[4e-4]]), ["parameter", "parameter_2"])
    put(group, "posterior_samples", np.full((50, 1), STIFFNESS), ["sample", "parameter"])
    about = {"sd": noise, "ar1": 0.0, "source": "given", "unit": "m", "relative_error": 0.02}
    group.attrs.update(
        parameters=list(space.names), units=list(space.units), noise=about, at_bound=[], warnings=[], rounds=1,
        ended="made up", simulations=1, failed=0, seconds=1.0, derivative_step=1e-4,
        fingerprint=study.fingerprint("fit"), finished=True,
    )  # fmt: skip


def put_diagnosis(study: Study, verdict: str, effects: list[str], hidden: list[str] = [], **more: Any) -> None:  # noqa: B006
    """A diagnosis as the step saves it, with these effects named or tied, and these not seen."""
    rows = [
        {"name": n, "coefficients": {}, "explained": 0.0, "z": 0.0, "identifiability": 0.0 if n in hidden else 0.5}
        for n in (*effects, *hidden)
    ]
    group = study.results("r+").create_group("diagnose", overwrite=True)
    result = {"verdict": verdict, "effects": effects, "candidates": rows}
    group.attrs.update(result=result, fingerprint=study.fingerprint("diagnose"), finished=True, **more)
