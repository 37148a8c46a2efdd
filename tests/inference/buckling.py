"""A study that chance decides: a rope is lowered straight down onto a table and buckles to one side or another."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from muslin.core.measurement import Measurement, Recording
from muslin.core.measurement_store import save_measurement
from muslin.core.scenarios import smooth_path
from muslin.core.series import PointSeries
from muslin.core.study import Study, parse_config, write_config

#: When the rope, 0.6 m long and held 0.63 m above the table at first, is down [s].
LANDED = 0.4


def buckling_study(folder: Path) -> Study:
    """Two recordings: ``down``, and ``up``, which the table plays no part in."""
    table = {
        "study": {"measurement": "recording.zarr"},
        "scenario": {
            "name": "swing",
            "size": [0.6],
            "vertices": [16],
            "grasps": [[0, 1]],
            "obstacles": [{"kind": "table", "height": 0.0}],
        },
        "simulator": {"name": "mujoco", "time_step": 0.005},
        "noise": {"sd": 0.001},
    }
    time = np.arange(0.0, 1.01, 1 / 20)
    recordings = []
    for name, z in (("down", 0.45), ("up", 0.7)):
        motion = smooth_path([(0, 0, 0, 0.63), (0.4, 0, 0, z), (0.9, 0.2, 0.25, z)], 0.2)
        recordings.append(Recording(name, PointSeries(time, np.zeros((len(time), 16, 3))), motion))
    write_config(parse_config(table, "test"), folder / "study.toml")
    blank = tuple(recordings)
    save_measurement(Measurement(blank), folder / "recording.zarr")
    problem = Study.load(folder / "study.toml", workers=0).problem
    middle = problem.space.as_dict(problem.space.from_unit(np.full(len(problem.space), 0.5)))
    seen = tuple(replace(r, series=problem.simulate(middle, r.name).series) for r in blank)
    save_measurement(Measurement(seen), folder / "recording.zarr", overwrite=True)
    return Study.load(folder / "study.toml", workers=0)
