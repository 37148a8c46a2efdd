"""Annotated frames for nothing: a simulation knows where its keypoints are, and which of them are seen."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from ..core.arrays import FloatArray
from ..core.camera import Camera
from ..core.errors import InputError, RolloutFailed
from ..core.frames import Frames
from ..core.keypoints import keypoint_weights
from ..core.material import with_fields
from ..core.parameters import ParameterSpace
from ..core.picture import Appearance
from ..core.registry import REGISTRY
from ..core.rollout import rollout
from ..core.scenario import STANDARD_GRAVITY
from ..core.scenarios import preset
from ..core.simulated_take import SimulatedTake
from ..core.visibility import visible
from .randomisation import random_appearance, shaken

#: Frames of a draw of the prior that look alike: they share one appearance and one camera.
_ALIKE = 2
#: Seconds of computation after which a draw is given up, and draws that may fail before it is.
_TIME_LIMIT, _FAILURES = 60.0, 10


def simulated_annotations(
    take: SimulatedTake, weights: FloatArray, renderer: str = "auto", appearance: Appearance | None = None
) -> tuple[Frames, FloatArray]:
    """Rendered frames of a take, and its keypoints.

    Args:
        take: with a camera.
        weights: of the keypoints over the vertices ``(K, V)``, as :func:`~muslin.core.keypoints.keypoint_weights`
            gives them.
        renderer: its name.
        appearance: of object, surroundings and light.

    Returns:
        T frames, and keypoints ``(T, K, 2)`` [px], NaN where something hides them or they are out of the picture.

    Raises:
        InputError: the take has no camera.
    """
    frames = take.frames(renderer, appearance)
    assert take.camera is not None
    points = np.asarray(weights @ take.vertices)
    pixels = take.camera.project(points)[0]
    pixels[~visible(take.scene, take.camera, take.vertices, points)] = np.nan
    return frames, pixels


@dataclass(frozen=True)
class TrainingSet:
    """Frames to learn from.

    Args:
        frames: N; every few of them from a camera of its own, which therefore is not among them.
        keypoints: ``(N, K, 2)`` [px], NaN where not seen.
        draws: which draw of the prior a frame shows ``(N,)``.
    """

    frames: Frames
    keypoints: FloatArray
    draws: FloatArray


def training_set(
    scenario: str,
    simulator: str = "mujoco",
    renderer: str = "auto",
    frames: int = 250,
    keypoints: int = 4,
    size: int = 320,
    seed: int = 0,
    draws: int = 0,
) -> TrainingSet:
    """Annotated frames of a built-in scenario under draws of its prior.

    Object, background, obstacles and light are drawn anew for every few frames, and the camera is moved a little, so
    that what is learned goes by the object's shape and not by its looks.

    Args:
        scenario: its name.
        simulator, renderer: names of plugins.
        frames: N.
        keypoints: K, those of :func:`~muslin.core.keypoints.keypoint_weights`.
        size: pixels along each edge of a frame.
        seed: of everything that is drawn.
        draws: of the prior; default one for every ten frames.

    Raises:
        InputError: a number that cannot be, or an unknown name.
        RolloutFailed: draw after draw failed.
    """
    count = draws or max(1, -(-frames // 10))
    if frames < 2 or not 1 <= count <= frames:
        raise InputError(f"a training set needs 2 frames or more and a frame a draw, got {frames} of {count} draws")
    rng = np.random.default_rng([seed, 34])
    parts: list[tuple[Frames, FloatArray]] = []
    shares = np.diff(np.linspace(0, frames, count + 1).astype(int))
    for take, share in zip(_takes(scenario, simulator, size, rng), shares, strict=False):
        weights = keypoint_weights(take.scene.body, keypoints)
        chosen = np.sort(rng.choice(len(take.vertices), int(share), replace=share > len(take.vertices)))
        for some in np.array_split(chosen, -(-len(chosen) // _ALIKE)):
            assert take.camera is not None
            pair = np.resize(some, max(2, len(some)))  # a series has two frames or more
            part = replace(
                take,
                series=replace(take.series, time=np.arange(len(pair), dtype=float), points=take.series.points[pair]),
                vertices=take.vertices[pair],
                camera=shaken(take.camera, rng),
            )
            look = random_appearance(rng, obstacles=len(take.scene.obstacles))
            shot, seen = simulated_annotations(part, weights, renderer, look)
            parts.append((shot[: len(some)], seen[: len(some)]))
    depth = [part.depth for part, _ in parts if part.depth is not None]
    together = Frames(np.concatenate([p.rgb for p, _ in parts]), np.concatenate(depth))
    return TrainingSet(together, np.concatenate([k for _, k in parts]), np.repeat(np.arange(count), shares))


def _takes(scenario: str, simulator: str, size: int, rng: np.random.Generator) -> Iterator[SimulatedTake]:
    """Rollouts of draws of the prior without end, all seen by the camera that frames the first."""
    base = preset(scenario)
    engine, plan, material = REGISTRY.get("simulator", simulator)(), base.scenario(), base.default_material()
    space = ParameterSpace(base.default_priors())
    camera: Camera | None = None
    failures = 0
    while True:
        values = space.as_dict(space.from_unit(rng.random(len(space))))
        drawn = with_fields(material, values)
        try:
            made = rollout(engine, plan, drawn, time_limit=_TIME_LIMIT)
        except RolloutFailed:
            failures += 1
            if failures > _FAILURES:
                raise
            continue
        camera = camera or Camera.framing(made.vertices, margin=1.3, width=size, height=size)
        yield SimulatedTake(made.series, made.vertices, plan.scene(drawn, _DOWN), camera)


_DOWN = np.array([0.0, 0.0, -STANDARD_GRAVITY])
