"""Swings the shirt by its shoulders on any simulator.

python examples/own_mesh/swing.py mujoco|pybullet [recording.zarr]
"""

import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from muslin.core.errors import MuslinError
from muslin.core.importing.mesh import read_body
from muslin.core.material import ClothMaterial
from muslin.core.measurement import Measurement, Recording
from muslin.core.measurement_store import save_measurement
from muslin.core.registry import REGISTRY
from muslin.core.rollout import rollout
from muslin.core.scenarios import preset
from muslin.core.scenarios.grasps import grasps_at

#: One gripper, a hanger, holds what is within 5 cm of the middle of both shoulders [m].
SHOULDERS = np.array([[-0.09, 0.0, 0.0], [0.09, 0.0, 0.0]])


def main(engine: str, output: str | None = None) -> None:
    shirt = read_body(Path(__file__).with_name("shirt.obj"))
    scenario = replace(
        preset("swing").scenario(),
        body=shirt,
        grasps=grasps_at(shirt, [SHOULDERS], radius=0.05),
        markers=np.eye(len(shirt.vertices)),
    )
    simulator = REGISTRY.get("simulator", engine)()
    began = time.perf_counter()
    seen = rollout(simulator, scenario, ClothMaterial(areal_density=0.18))
    hem = np.flatnonzero(shirt.vertices[:, 2] < shirt.vertices[:, 2].min() + 1e-9)
    reach = np.ptp(seen.vertices[:, hem].mean(axis=1), axis=0)
    print(
        f"{engine}: {len(shirt.vertices)} vertices, {scenario.times[-1]:.1f} s simulated in "
        f"{time.perf_counter() - began:.1f} s; the hem swung over {100 * reach[1]:.0f} cm"
    )
    if output:
        save_measurement(Measurement((Recording("swing", seen.series, scenario.motion),)), Path(output), overwrite=True)


if __name__ == "__main__":
    try:
        main(*sys.argv[1:3]) if len(sys.argv) > 1 else print(__doc__)
    except MuslinError as error:
        sys.exit(f"error: {error}")
