"""From pictures to a posterior: a fling that MuJoCo plays, and PyBullet is the model.

Size, stretch and bending stiffness of the cloth are drawn from the prior and hidden. The recording is 320 x 320 frames
at 10 Hz of one camera, drawn like the model's. ``heatmap`` learns from frames of PyBullet with random looks and
cameras, annotated by the simulation, ``transporter`` from the recording and from draws of the model, without
annotation. Each finds keypoints [px] in the recording and in drawn frames of every simulated draw, and
``bayessim-rkhs`` fits a study of them as of any other. Beside them the same study of all markers, projected with 1 px
of noise: what is to be had from this take with this model.

Printed for every hidden draw:

- how far the mean of the posterior lies from that of the markers' posterior, over the unit cube of the prior, and how
  far the mean of the prior does;
- the Chamfer distance of the object's pixels between recording and model at the mean of the posterior, and at the mean
  of the prior: on the fling, and on a swing that nothing was fitted to.

A smaller run is one with fewer ``--studies``, ``--frames``, ``--epochs`` and ``--steps``.
"""

import argparse
import os
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from perception_heatmap import ENGINES
from perception_settings import Settings
from table import Row, report, write

from muslin.core.arrays import BoolArray, FloatArray
from muslin.core.camera import Camera
from muslin.core.errors import RolloutFailed
from muslin.core.frames import Frames
from muslin.core.material import with_fields
from muslin.core.measurement import Measurement, Recording
from muslin.core.measurement_store import save_measurement
from muslin.core.parameters import Parameter, ParameterSpace
from muslin.core.registry import REGISTRY
from muslin.core.rollout import rollout
from muslin.core.scenario import STANDARD_GRAVITY
from muslin.core.scenarios import fling_motion, preset, swing_motion
from muslin.core.simulated_take import SimulatedTake
from muslin.core.simulator import Simulator
from muslin.core.study import Study, parse_config, write_config
from muslin.perception.chamfer import mask_chamfer
from muslin.perception.heatmap import HeatmapExtractor
from muslin.perception.simulated import training_set
from muslin.perception.transporter import TransporterExtractor

MOTIONS = {"fling": fling_motion, "swing": swing_motion}
FITTED = "fling"
RATE = 10.0  # of the frames [Hz]
NOISE = 1.0  # of the markers that are compared with [px]
#: Draws a round of the fit, and rounds at most.
DRAWS, ROUNDS = 60, 2
SPACE = ParameterSpace((*preset("fling").default_priors(), Parameter("scale", "1", 0.8, 1.2)))


@dataclass(frozen=True, eq=False)
class Reality:
    """What is recorded: takes and the object's pixels by motion, and the frames of the one that is fitted."""

    takes: dict[str, SimulatedTake]
    masks: dict[str, BoolArray]
    frames: Frames


def reality(seed: int) -> Reality:
    """MuJoCo's, with hidden parameters drawn from ``seed``."""
    simulator = REGISTRY.get("simulator", "mujoco")()
    middle = _take(simulator, FITTED, np.full(len(SPACE), 0.5), None)
    camera = Camera.framing(middle.vertices, margin=1.3)
    hidden = np.random.default_rng([seed, 77]).random(len(SPACE))
    takes = {motion: _take(simulator, motion, hidden, camera) for motion in MOTIONS}
    return Reality(takes, {motion: take.masks() for motion, take in takes.items()}, takes[FITTED].frames())


def _take(simulator: Simulator, motion: str, unit: FloatArray, camera: Camera | None) -> SimulatedTake:
    """A rollout with parameters ``unit (3,)`` in the unit cube of the prior."""
    path = MOTIONS[motion]()
    times = np.arange(0.0, path.times[-1] + 1e-9, 1.0 / RATE)
    plan = replace(preset("fling").scenario(), motion=path, times=times)
    values = SPACE.as_dict(SPACE.from_unit(unit))
    scale = values.pop("scale")
    material = with_fields(preset("fling").default_material(), values)
    made = rollout(simulator, plan, material, scale=scale)
    scene = plan.scene(material, np.array([0.0, 0.0, -STANDARD_GRAVITY]), scale)
    return SimulatedTake(made.series, made.vertices, scene, camera)


def main() -> None:
    default = Settings()
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--studies", type=int, default=3, help="hidden draws that are fitted")
    for name in ("frames", "draws", "epochs", "steps", "seed"):
        parser.add_argument(f"--{name}", type=int, default=getattr(default, name))
    given = vars(parser.parse_args())
    count, settings = given.pop("studies"), replace(default, **given)
    seeds = [settings.seed + 2000 + k for k in range(count)]
    began, made = time.monotonic(), list[Row]()
    with TemporaryDirectory() as name:
        folder = Path(name)
        known = training_set(
            FITTED, *ENGINES["pybullet"], frames=settings.frames, seed=settings.seed, draws=settings.draws
        )
        learner = HeatmapExtractor(epochs=settings.epochs, seed=settings.seed)
        learner.fit(known.frames, known.keypoints)
        learner.save(folder / "heatmap.safetensors")
        for seed in seeds:
            for row in _case(folder, reality(seed), settings, seed):
                made.append(row)
                print(f"{row.figure}: {row.value} {row.unit} {row.goal}", flush=True)
            write("perception-study", made, seeds, time.monotonic() - began)
    report("perception-study", made, seeds, time.monotonic() - began)


def _case(folder: Path, real: Reality, settings: Settings, seed: int) -> Iterator[Row]:
    simulator, camera = REGISTRY.get("simulator", "pybullet")(), real.takes[FITTED].camera
    centre = np.full(len(SPACE), 0.5)
    rng = np.random.default_rng([seed, 78])
    seen = real.takes[FITTED].projected()
    markers = replace(seen, points=seen.points + rng.normal(0.0, NOISE, seen.points.shape))
    _learn_transporter(folder / "transporter.safetensors", real, settings, rng)
    reference = None
    for name in ("markers", "heatmap", "transporter"):
        options, series = {}, markers
        if name != "markers":
            options = {"weights": str(folder / f"{name}.safetensors")}
            series = REGISTRY.get("extractor", name)(**options).extract(real.frames, seen.time)
        recording = Recording(FITTED, series, MOTIONS[FITTED](), camera=camera)
        study = _study(folder / f"{name}-{seed}", recording, {"name": name} | options, seed)
        fit = study.fit()
        mean = SPACE.to_unit(fit.samples).mean(axis=0)
        what = f"fling from {name}, draw {seed}"
        yield Row(f"{what}: fit", fit.seconds, "s")
        if reference is None:
            reference = mean
        else:
            apart, before = (float(np.linalg.norm(m - reference)) for m in (mean, centre))
            goal = f"< {before:.3g}, the prior's"
            yield Row(f"{what}: posterior mean to that of markers", apart, "of the unit cube", goal, apart < before)
        for motion, mask in real.masks.items():
            drawn = [_take(simulator, motion, unit, camera).masks() for unit in (centre, mean)]
            before, after = (float(mask_chamfer(d, mask).mean()) for d in drawn)
            goal = f"< {before:.3g}, the prior's"
            yield Row(f"{what}: Chamfer of the {motion}", after, "px of 320", goal, after < before)


def _learn_transporter(weights: Path, real: Reality, settings: Settings, rng: np.random.Generator) -> None:
    """From the recording, as often as there are draws, and from draws of the model."""
    simulator, camera = REGISTRY.get("simulator", "pybullet")(), real.takes[FITTED].camera
    shown = []
    while len(shown) < 2 * settings.held_out_draws:
        try:
            shown += [_take(simulator, FITTED, rng.random(len(SPACE)), camera).frames().rgb, real.frames.rgb]
        except RolloutFailed:
            continue
    learner = TransporterExtractor(steps=settings.steps, seed=settings.seed)
    learner.fit(np.concatenate(shown))
    learner.save(weights)


def _study(folder: Path, recording: Recording, extractor: dict[str, Any], seed: int) -> Study:
    folder.mkdir()
    save_measurement(Measurement((recording,)), folder / "recording.zarr")
    table = {
        "study": {"measurement": "recording.zarr", "seed": seed},
        "scenario": {"name": "fling"},
        "simulator": {"name": "pybullet"},
        "extractor": extractor,
        "estimator": {"name": "bayessim-rkhs", "rounds": ROUNDS, "draws": DRAWS},
        "parameters": {p.name: {"low": p.low, "high": p.high, "scale": p.scale} for p in SPACE},
    }
    write_config(parse_config(table, "benchmark"), folder / "study.toml")
    return Study.load(folder / "study.toml")


if __name__ == "__main__":
    os.environ.setdefault("OMP_NUM_THREADS", str(len(os.sched_getaffinity(0))))
    main()
