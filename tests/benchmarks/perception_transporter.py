"""What ``transporter`` finds on simulated frames of cloth and rope, with a robot in the picture and without.

Takes are draws from the middle half of the prior of the paper's scenarios, drawn by muslin's renderer from one camera
of 320 x 320 pixels. The robot is a dark bar that is painted over the frames where the gripper is, and its mask. On
takes that were not learned from:

- consistency: the share of frames in which a keypoint lies within 10 px of the spot of the object that is its own. That
  spot is the vertex which it lay near most often, of the visible ones, in the frames it learned from. Beside it the
  same of a fixed grid of as many points over the place where the object moves.
- the share of keypoints on the object, of those that are given, and the share that is given;
- the Chamfer distance between keypoints and the object's pixels.
"""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from paper_scene import SETTINGS, Setting
from perception_settings import Settings
from table import Row

from muslin.core.arrays import BoolArray, FloatArray
from muslin.core.camera import Camera
from muslin.core.errors import MuslinError
from muslin.core.frames import Frames
from muslin.core.picture import OBJECT
from muslin.core.renderer import find_renderer
from muslin.core.visibility import visible
from muslin.perception.chamfer import on_mask, point_chamfer
from muslin.perception.transporter import TransporterExtractor

#: A keypoint is at its spot if it is as near to it as this [px of 320].
NEAR = 10.0
#: The painted robot: half its width, and how far it reaches down over what it holds [px].
HALF_WIDTH, REACH = 12, 6
ROBOT_COLOUR = (40, 44, 60)
VARIANTS = ("no robot", "robot left out", "robot in the loss")
#: What is measured, how it is told, and its unit.
FIGURES = {
    "consistency": ("within 10 px of its own spot", "share of keypoints and frames"),
    "grid_consistency": ("a fixed grid within 10 px of its own spots", "share of points and frames"),
    "on_object": ("on the object, of those given", "share"),
    "grid_on_object": ("a fixed grid on the object", "share"),
    "given": ("given", "share of keypoints and frames"),
    "chamfer_px": ("Chamfer to the object's pixels", "px of 320"),
    "grid_chamfer_px": ("Chamfer of a fixed grid", "px of 320"),
    "training_s": ("training", "s"),
    "frames_per_second": ("extraction", "frames/s"),
}


@dataclass(frozen=True, eq=False)
class Seen:
    """Takes one after the other: pictures, masks of object and robot ``(T, H, W)``, vertices ``(T, V, 3)`` [m]."""

    rgb: Any
    object: BoolArray
    robot: BoolArray
    vertices: FloatArray

    def frames(self, variant: str) -> Frames:
        """Pictures of one of :data:`VARIANTS`."""
        if variant == "no robot":
            return Frames(self.rgb)
        painted = self.rgb.copy()
        painted[self.robot] = ROBOT_COLOUR
        return Frames(painted, robot=self.robot if variant == "robot left out" else None)

    def shown(self, variant: str) -> BoolArray:
        """The object's pixels that are to be seen."""
        return self.object if variant == "no robot" else self.object & ~self.robot


def seen_takes(setting: Setting, camera: Camera, count: int, seed: int) -> Seen:
    """``count`` takes with parameters from the middle half of the prior; those that fail are drawn again."""
    rng = np.random.default_rng([seed, 7])
    scene, made = setting.scene(), []
    with find_renderer("auto").open(scene) as view:
        while len(made) < count:
            try:
                vertices = setting.real(rng.uniform(0.25, 0.75, len(setting.space)), "same").vertices
            except MuslinError:
                continue
            drawn = [view.render(v, camera) for v in vertices]
            rgb, mask = np.stack([f.rgb for f in drawn]), np.stack([f.segmentation == OBJECT for f in drawn])
            grip = camera.project(vertices[:, scene.held].mean(axis=1))[0]
            made.append((rgb, mask, _bars(grip, mask.shape), vertices))
    return Seen(*(np.concatenate(part) for part in zip(*made, strict=True)))


def _bars(grip: FloatArray, shape: tuple[int, ...]) -> BoolArray:
    """A bar from above down to the gripper ``grip (T, 2)`` [px] in every frame ``(T, H, W)``."""
    row, column = np.ogrid[: shape[1], : shape[2]]
    u, v = grip[:, 0, None, None], grip[:, 1, None, None]
    return np.asarray((np.abs(column - u) <= HALF_WIDTH) & (row <= v + REACH))


def spots(points: FloatArray, pixels: FloatArray, seen: BoolArray) -> list[int]:
    """Of every keypoint of ``points (T, K, 2)`` the vertex it is nearest to most often.

    Args:
        points: [px], NaN where not seen.
        pixels: of the vertices ``(T, V, 2)``.
        seen: which of them ``(T, V)``.
    """
    chosen = []
    for k in range(points.shape[1]):
        apart = np.linalg.norm(pixels - points[:, k, None], axis=2)
        apart[~seen] = np.inf
        known = np.isfinite(points[:, k]).all(axis=1) & seen.any(axis=1)
        counts = np.bincount(apart[known].argmin(axis=1), minlength=pixels.shape[1]) if known.any() else np.zeros(1)
        chosen.append(int(np.argmax(counts)))
    return chosen


def consistency(points: FloatArray, pixels: FloatArray, chosen: Sequence[int]) -> float:
    """Share of frames and keypoints ``(T, K, 2)`` that lie within :data:`NEAR` of their spot; NaN does not."""
    return float((np.linalg.norm(points - pixels[:, list(chosen)], axis=2) <= NEAR).mean())


def grid(mask: BoolArray, count: int) -> FloatArray:
    """``count`` points ``(count, 2)`` [px], two rows of them, over the box around all pixels of ``mask (T, H, W)``."""
    rows, columns = np.flatnonzero(mask.any(axis=(0, 2))), np.flatnonzero(mask.any(axis=(0, 1)))
    u = columns[0] + (np.arange(count // 2) + 0.5) * np.ptp(columns) / (count // 2)
    v = rows[0] + np.array([0.25, 0.75]) * np.ptp(rows)
    return np.stack(np.meshgrid(u, v), axis=-1).reshape(-1, 2)


def measure(
    setting: Setting, known: Seen, fresh: Seen, camera: Camera, variant: str, extractor: TransporterExtractor
) -> dict[str, float]:
    """The numbers of :data:`FIGURES`, of an extractor that learns here."""
    began = time.perf_counter()
    extractor.fit(known.frames(variant))
    training = time.perf_counter() - began
    clock = np.arange(max(len(known.rgb), len(fresh.rgb))) / 10.0
    began = time.perf_counter()
    found = extractor.extract(fresh.frames(variant), clock[: len(fresh.rgb)]).points
    rate = len(fresh.rgb) / (time.perf_counter() - began)
    learned = extractor.extract(known.frames(variant), clock[: len(known.rgb)]).points
    (before, in_view), (after, _) = ((_projected(setting, camera, x)) for x in (known, fresh))
    fixed = grid(known.object, found.shape[1])
    baseline = [np.repeat(fixed[None], len(x.rgb), axis=0) for x in (known, fresh)]
    given, mask = np.isfinite(found).all(axis=2), fresh.shown(variant)
    on = np.stack([on_mask(p, m) for p, m in zip(found, mask, strict=True)])
    on_grid = np.stack([on_mask(p, m) for p, m in zip(baseline[1], mask, strict=True)])
    return {
        "given": float(given.mean()),
        "on_object": float(on[given].mean()) if given.any() else 0.0,
        "consistency": consistency(found, after, spots(learned, before, in_view)),
        "chamfer_px": float(point_chamfer(found, mask).mean()),
        "grid_on_object": float(on_grid.mean()),
        "grid_consistency": consistency(baseline[1], after, spots(baseline[0], before, in_view)),
        "grid_chamfer_px": float(point_chamfer(baseline[1], mask).mean()),
        "training_s": round(training, 1),
        "frames_per_second": round(rate, 1),
    }


def _projected(setting: Setting, camera: Camera, seen: Seen) -> tuple[FloatArray, BoolArray]:
    """Pixels ``(T, V, 2)`` of the vertices, and which of them the camera sees ``(T, V)``."""
    return camera.project(seen.vertices)[0], visible(setting.scene(), camera, seen.vertices, seen.vertices)


def figures(settings: Settings) -> list[Row]:
    """Every scenario, number of keypoints, focus and variant."""
    made: list[Row] = []
    for name in settings.scenarios:
        setting = SETTINGS[name]
        camera = setting.camera()
        known = seen_takes(setting, camera, settings.draws, settings.seed + 1)
        fresh = seen_takes(setting, camera, settings.held_out_draws, settings.seed + 1001)
        chosen = (0.0, settings.focus) if name in settings.focused else (0.0,)
        for count, focus, variant in product(settings.keypoints, chosen, VARIANTS):
            extractor = TransporterExtractor(keypoints=count, steps=settings.steps, focus=focus, seed=settings.seed)
            found = measure(setting, known, fresh, camera, variant, extractor)
            what = f"transporter {name}, {count} keypoints{f', focus {focus:g}' if focus else ''}, {variant}"
            for key, (figure, unit) in FIGURES.items():
                made.append(Row(f"{what}: {figure}", found[key], unit))
                print(f"{made[-1].figure}: {made[-1].value:.4g} {unit}", flush=True)
    return made
