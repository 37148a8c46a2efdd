"""A small study that is simulated in seconds: a 4 x 4 cloth swung for half a second, two recordings."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from muslin.backends.mujoco import MujocoSimulator
from muslin.core.effect import Effect
from muslin.core.material import ClothMaterial
from muslin.core.measurement import Measurement, Recording
from muslin.core.measurement_store import save_measurement
from muslin.core.motion import Motion
from muslin.core.rollout import rollout
from muslin.core.scenario import Scenario
from muslin.core.scenarios import preset, smooth_path
from muslin.core.study import parse_config, write_config

NOISE = 0.001
TRUTH = ClothMaterial(stretch_stiffness=200.0, bending_rigidity=3e-5)


def small_motion(reach: float) -> Motion:
    return smooth_path([(0, 0, 0, 1), (0.25, 0.03, reach, 1.03), (0.5, 0, 0, 1)], 0.2)


def small_measurement(*effects: Effect, seed: int = 0, noise: float = NOISE) -> Measurement:
    rng = np.random.default_rng(seed)
    body = preset("fling").body((0.2, 0.2), (4, 4))
    recordings = []
    for name, reach in (("near", 0.08), ("far", 0.14), ("other", -0.11)):
        motion = small_motion(reach)
        scenario = Scenario(
            "small",
            body,
            (np.array([0, 3]),),
            motion,
            np.arange(0, 0.7, 1 / 40),
            np.eye(16),
            np.zeros(0, np.int64),
            settle=0.1,
        )
        series = rollout(MujocoSimulator(0.01), scenario, TRUTH, effects).series
        noisy = series.points + rng.normal(0, noise, series.points.shape)
        recordings.append(Recording(name, replace(series, points=noisy), motion))
    return Measurement(tuple(recordings))


def small_config(**study: object) -> dict[str, object]:
    return {
        "study": {"measurement": "recording.zarr", "hold_out": ["other"], **study},
        "scenario": {"name": "fling", "size": [0.2, 0.2], "vertices": [4, 4], "settle": 0.1},
        "simulator": {"name": "mujoco", "time_step": 0.01},
        "estimator": {"name": "bayessim-rkhs", "rounds": 2, "draws": 16},
        "diagnose": {"draws": 4},
    }


def write_study(folder: Path, measurement: Measurement, **study: object) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    save_measurement(measurement, folder / "recording.zarr")
    write_config(parse_config(small_config(**study), "test"), folder / "study.toml")
    return folder / "study.toml"
