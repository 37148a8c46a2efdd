"""A small cloth with a hidden force, in NumPy, and a study of it that is taken as fitted."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import ClassVar

import numpy as np

from muslin.core.arrays import FloatArray
from muslin.core.body import cloth_grid
from muslin.core.effect import Effect, NodalForce
from muslin.core.material import ClothMaterial
from muslin.core.measurement import Measurement, Recording
from muslin.core.measurement_store import save_measurement
from muslin.core.parameters import Parameter
from muslin.core.registry import REGISTRY
from muslin.core.rollout import rollout
from muslin.core.scenario import Scenario
from muslin.core.scenarios import smooth_path
from muslin.core.scene import Scene
from muslin.core.simulator import State
from muslin.core.store import new_store, put
from muslin.core.study import Study, parse_config, write_config
from muslin.core.testing.reference import ReferenceSimulator
from muslin.inference.noise import Noise
from muslin.inference.polish import Objective, polish
from muslin.inference.residuals import Offsets

NOISE = 0.001
TRUTH = ClothMaterial(stretch_stiffness=80.0)
#: ``(time [s], positions, velocities) -> accelerations (V, 3) [m/s2]``
Push = Callable[[float, FloatArray, FloatArray], FloatArray]


class Hidden(Effect):
    """Any acceleration, of a kind that nobody has named."""

    name: ClassVar[str] = "hidden"
    acts_on: ClassVar[str] = "force"
    coefficients: ClassVar[tuple[Parameter, ...]] = (Parameter("on", "1", 0.0, 1.0),)

    def __init__(self, push: Push) -> None:
        super().__init__(on=1.0)
        self.push = push

    def bind(self, scene: Scene, masses: FloatArray) -> NodalForce:
        def force(time: float, state: State) -> FloatArray:
            return masses[:, None] * self.push(time, state.positions, state.velocities)

        return force


def measurement(push: Push | None, noise: float = NOISE) -> Measurement:
    """Three motions of a sheet of 0.2 m held at two corners."""
    rng = np.random.default_rng(0)
    body = cloth_grid(0.2, 0.2, 3, 3)
    effects = [Hidden(push)] if push else []
    recordings = []
    for name, reach in (("near", 0.08), ("far", 0.14), ("other", -0.11)):
        motion = smooth_path([(0, 0, 0, 1), (0.25, 0.03, reach, 1.03), (0.5, 0, 0, 1)], 0.2)
        times = np.arange(0, 0.9, 1 / 40)
        scenario = Scenario(
            "small", body, (np.array([0, 2]),), motion, times, np.eye(9), np.zeros(0, np.int64), settle=0.1
        )
        series = rollout(ReferenceSimulator(0.01), scenario, TRUTH, effects).series
        noisy = series.points + rng.normal(0, noise, series.points.shape)
        recordings.append(Recording(name, replace(series, points=noisy), motion))
    return Measurement(tuple(recordings))


def fitted_study(folder: Path, push: Push | None, hold_out: tuple[str, ...] = ("other",)) -> Study:
    """The plain model fitted by least squares alone, its results as those of ``muslin fit``."""
    REGISTRY.add("simulator", "reference", ReferenceSimulator)
    save_measurement(measurement(push), folder / "recording.zarr")
    table = {
        "study": {"measurement": "recording.zarr", "hold_out": list(hold_out)},
        "scenario": {"name": "fling", "size": [0.2, 0.2], "vertices": [3, 3], "markers": list(range(9)), "settle": 0.1},
        "simulator": {"name": "reference", "time_step": 0.01},
        "parameters": {"stretch_stiffness": {"low": 20.0, "high": 300.0, "scale": "log"}},
        "noise": {"sd": NOISE},
    }
    write_config(parse_config(table, "test"), folder / "study.toml")
    study = Study.load(folder / "study.toml", workers=0)
    problem, noise = study.problem, Noise(NOISE, 0.0, "told", "m", 0.02)
    with study.pool(problem) as pool:
        fit = polish(Objective(pool, problem.space, problem.fit_on, noise, Offsets()), np.array([0.5]), 12)
    with new_store(study.results_path) as root:
        root.attrs["kind"] = "results"
        group = root.create_group("fit")
        estimate = problem.space.from_unit(fit.unit)
        put(group, "posterior_samples", np.repeat(estimate[None], 10, axis=0), ["sample", "parameter"])
        put(group, "estimate", estimate, ["parameter"])
        put(group, "estimate_sd", np.ones(1), ["parameter"])
        put(group, "estimate_unit", fit.unit, ["parameter"])
        group.attrs.update(
            parameters=list(problem.space.names), units=list(problem.space.units), noise=noise.as_dict(), at_bound=[],
            warnings=[], rounds=1, ended="made up", simulations=1, failed=0, seconds=0.0, derivative_step=1e-4,
            fingerprint=study.fingerprint("fit"), finished=True,
        )  # fmt: skip
    return study
