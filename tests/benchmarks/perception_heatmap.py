"""``heatmap`` on simulated frames of draws that it has not seen, from its own engine and from the other one.

Four keypoints: the corners of a cloth; evenly along a rope, both ends among them. Frames have 320 x 320 pixels. Looks,
light and camera are drawn anew every few frames (:mod:`muslin.perception.randomisation`), in the held-out frames, too;
half of the objects have one colour and half a print that is another one each time. So a corner is told by where it
lies in the picture and not by what is printed on it: the camera and the motion are roughly the same in all frames.
"""

import time
from collections.abc import Iterator

import numpy as np
from perception_settings import Settings
from table import Row

from muslin.perception.heatmap import HeatmapExtractor
from muslin.perception.simulated import TrainingSet, training_set

#: Simulator and renderer of either side of the shift.
ENGINES = {"mujoco": ("mujoco", "mujoco"), "pybullet": ("pybullet", "tiny")}
#: Goal of the median error of cloth corners in wiping [px of 320].
GOAL = 3.0


def rows(settings: Settings) -> list[Row]:
    """Errors, confidences and times."""
    made: list[Row] = []
    for scenario in settings.scenarios:
        for row in _scenario(scenario, settings):
            made.append(row)
            print(f"{row.figure}: {row.value} {row.unit}", flush=True)
    return made


def _scenario(scenario: str, settings: Settings) -> Iterator[Row]:
    engines = list(ENGINES) if scenario in settings.shifts else ["mujoco"]
    known = {e: _frames(scenario, e, settings.frames, settings.draws, settings.seed) for e in engines}
    fresh = {e: _frames(scenario, e, settings.held_out, settings.held_out_draws, settings.seed + 1000) for e in engines}
    for engine in engines:
        began = time.monotonic()
        extractor = HeatmapExtractor(epochs=settings.epochs, seed=settings.seed)
        extractor.fit(known[engine].frames, known[engine].keypoints)
        yield Row(f"heatmap {scenario}, {engine}: training", time.monotonic() - began, "s")
        for other in engines:
            goal = scenario == "wiping" and engine == other
            yield from _measured(extractor, fresh[other], f"heatmap {scenario}, {engine} to {other}", goal)


def _frames(scenario: str, engine: str, frames: int, draws: int, seed: int) -> TrainingSet:
    return training_set(scenario, *ENGINES[engine], frames=frames, seed=seed, draws=draws)


def _measured(extractor: HeatmapExtractor, data: TrainingSet, what: str, goal: bool) -> Iterator[Row]:
    began = time.perf_counter()
    found, sure = extractor.locate(data.frames)
    rate = len(data.frames) / (time.perf_counter() - began)
    seen = np.isfinite(data.keypoints).all(axis=2)
    given = sure >= extractor.least
    apart = np.linalg.norm(found - data.keypoints, axis=2)[seen & given]
    median = float(np.median(apart)) if len(apart) else float("nan")
    goal_text, met = (f"<= {GOAL:g}", median <= GOAL) if goal else ("", None)
    yield Row(f"{what}: median error", median, "px of 320", goal_text, met)
    if len(apart):
        yield Row(f"{what}: 90 % of errors below", float(np.quantile(apart, 0.9)), "px of 320")
    yield Row(f"{what}: seen keypoints lost", float(np.mean(~given[seen])), "share")
    hidden = float(np.mean(~given[~seen])) if (~seen).any() else "none hidden"
    yield Row(f"{what}: hidden keypoints given as NaN", hidden, f"share of {int((~seen).sum())}")
    yield Row(f"{what}: extraction", rate, "frames/s")
