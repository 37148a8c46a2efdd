"""Transporter: keypoints go to what moves, not to the robot, and survive the disk."""

import pickle
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from muslin.core.errors import InputError, MissingFileError, StepMissingError
from muslin.core.frames import Frames
from muslin.perception.transporter import TransporterExtractor
from muslin.perception.transporter_net import SPREAD, Transporter, gaussians
from muslin.perception.transporter_training import _pairs, _without_robot, focused, shrunk

COUNT = 24
TIME = np.arange(COUNT) / 10.0


def moving(robot: bool = False, height: int = 48, width: int = 64) -> Frames:
    """A red patch that circles over grey; a blue one that runs to and fro, with its mask, is the robot."""
    rgb = np.full((COUNT, height, width, 3), 140, np.uint8)
    mask = np.zeros((COUNT, height, width), bool)
    for t in range(COUNT):
        u, v = _centre(t)
        rgb[t, v - 5 : v + 5, u - 5 : u + 5] = (200, 60, 50)
        if robot:
            left = 4 + 2 * t
            mask[t, 1:9, left : left + 10] = True
    rgb[mask] = (30, 30, 120)
    return Frames(rgb, robot=mask if robot else None)


def _centre(t: int) -> tuple[int, int]:
    return 32 + round(18 * np.cos(2 * np.pi * t / COUNT)), 28 + round(12 * np.sin(2 * np.pi * t / COUNT))


@pytest.fixture(scope="module")
def learned() -> TransporterExtractor:
    extractor = TransporterExtractor(keypoints=2, size=48, steps=200, window=COUNT)
    extractor.fit(moving(robot=True))
    return extractor


@pytest.mark.slow
def test_a_keypoint_follows_what_moves_and_none_the_robot(learned: TransporterExtractor) -> None:
    frames = moving(robot=True)
    found = learned.extract(frames, TIME)
    assert (found.unit, found.correspondence, found.points.shape) == ("px", True, (COUNT, 2, 2))
    centres = np.array([_centre(t) for t in range(COUNT)])
    off = np.linalg.norm(found.points - centres[:, None], axis=2)
    assert (off < 7.0).mean(axis=0).max() > 0.85
    assert frames.robot is not None
    for spots, mask in zip(found.points, frames.robot, strict=True):
        for u, v in np.rint(spots[np.isfinite(spots).all(axis=1)]).astype(int):
            assert not mask[v, u]
    assert np.mean(learned.losses[-10:]) < 0.2 * np.mean(learned.losses[:5])


@pytest.mark.slow
def test_weights_survive_the_disk_and_pickle(learned: TransporterExtractor, tmp_path: Path) -> None:
    learned.save(tmp_path / "w.safetensors")
    right = learned.extract(moving(), TIME).points
    for copy in (TransporterExtractor(tmp_path / "w.safetensors"), pickle.loads(pickle.dumps(learned))):
        np.testing.assert_array_equal(copy.extract(moving(), TIME).points, right)
        assert copy.keypoints == 2
    alone = np.concatenate([learned._located(moving()[t : t + 1])[0] for t in range(COUNT)])
    np.testing.assert_allclose(alone, learned._located(moving())[0], atol=1e-4)


@pytest.mark.slow
def test_frames_of_another_size_are_scaled_and_of_another_shape_refused(learned: TransporterExtractor) -> None:
    small, large = moving(), moving().rgb.repeat(2, axis=1).repeat(2, axis=2)
    one, other = learned.extract(small, TIME).points, learned.extract(large, TIME).points
    np.testing.assert_allclose(2.0 * (one + 0.5) - 0.5, other, atol=0.5)
    with pytest.raises(InputError, match="learned from frames of 64 x 48 pixels, but these have 64 x 64"):
        learned.extract(moving(height=64), TIME)
    with pytest.raises(InputError, match="no keypoint reaches a confidence"):
        sure = TransporterExtractor(confidence=1.0)
        sure.__dict__.update({k: v for k, v in learned.__dict__.items() if k != "confidence"})
        sure.extract(moving(), TIME)


def test_the_same_seed_learns_the_same_and_leaves_the_global_one_alone() -> None:
    made = [TransporterExtractor(keypoints=1, size=32, steps=3, batch=2, seed=5) for _ in range(2)]
    state = torch.get_rng_state()
    for extractor in made:
        extractor.fit(moving())
    assert torch.equal(torch.get_rng_state(), state)
    assert made[0].losses == made[1].losses
    other = TransporterExtractor(keypoints=1, size=32, steps=3, batch=2, seed=6)
    other.fit(moving())
    assert other.losses != made[0].losses


def test_the_robot_and_its_outline_weigh_nothing() -> None:
    kept = _without_robot(moving(robot=True).robot, (48, 64))  # type: ignore[arg-type]
    assert kept[0, :10, 3:15].max() == 0.0 and kept[0, 10:, 3:15].min() == 1.0 and kept[0, :, 16:].min() == 1.0


def test_features_are_carried_from_source_to_target() -> None:
    """Of the transported features, those at the target's keypoint are the target's, those at the source's are gone."""
    net = Transporter(1).eval()
    source, target = torch.rand(2, 1, 3, 64, 64)
    carried: list[torch.Tensor] = []
    net.refiner.register_forward_pre_hook(lambda module, given: carried.append(given[0]))
    net(source, target)
    with torch.no_grad():
        phi = [net.features(p) for p in (source, target)]
        heat = [gaussians(net.locate(p)[0], phi[0].shape[2:]) for p in (source, target)]
    right = (1 - heat[0]) * (1 - heat[1]) * phi[0] + heat[1] * phi[1]
    torch.testing.assert_close(carried[0], right)


def test_what_differs_weighs_more_however_thin_it_is() -> None:
    one, other = torch.zeros(1, 3, 20, 20), torch.zeros(1, 3, 20, 20)
    other[:, :, 5, :] = 0.5
    assert (focused(one, other, 0.0) == 1.0).all() and (focused(one, one, 3.0) == 1.0).all()
    weight = focused(one, other, 3.0)
    assert (weight[..., 6:, :] == 1.0).all() and weight.mean() == pytest.approx(4.0)
    torch.testing.assert_close(weight[0, 0, 5], torch.full((20,), 1.0 + 3.0 * 20))


def test_pairs_are_of_different_frames_within_the_window() -> None:
    rng = np.random.default_rng(0)
    one, other = _pairs(rng, 10, 5000, 3)
    apart = other - one
    assert set(np.unique(apart)) == {-3, -2, -1, 1, 2, 3} and other.min() == 0 and other.max() == 9


def test_a_peak_is_sure_and_a_flat_map_is_not() -> None:
    net = Transporter(1)
    net.detector = torch.nn.Identity()
    peak = torch.zeros(1, 1, 24, 24)
    peak[0, 0, 6, 17] = 50.0
    places, sure = net.locate(peak)
    np.testing.assert_allclose(places[0, 0], [2 * 17.5 / 24 - 1, 2 * 6.5 / 24 - 1], atol=1e-5)
    assert sure[0, 0] == pytest.approx(1.0, abs=1e-5)
    assert net.locate(torch.zeros(1, 1, 24, 24))[1][0, 0] == pytest.approx(np.pi * SPREAD**2, rel=0.1)


def test_pictures_are_shrunk_to_multiples_of_the_stride() -> None:
    assert shrunk(np.zeros((2, 240, 320, 3), np.uint8), 80).shape == (2, 60, 80, 3)
    assert shrunk(np.zeros((1, 33, 320, 3), np.uint8), 80).shape == (1, 8, 80, 3)


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"keypoints": 0}, "keypoints must be 1 to 64"),
        ({"size": 8}, "size must be 32"),
        ({"steps": 0}, "steps"),
        ({"batch": 1}, "batch"),
        ({"window": 0}, "window"),
        ({"focus": -1.0}, "focus must be 0 or more"),
        ({"confidence": 2.0}, "0 to 1"),
    ],
)
def test_options_that_cannot_be_are_refused(options: dict[str, Any], told: str) -> None:
    with pytest.raises(InputError, match=told):
        TransporterExtractor(**options)


def test_what_cannot_be_learned_from_is_refused(tmp_path: Path) -> None:
    extractor = TransporterExtractor()
    with pytest.raises(StepMissingError, match="muslin train transporter"):
        extractor.extract(moving(), TIME)
    with pytest.raises(StepMissingError, match="muslin train transporter"):
        extractor.save(tmp_path / "w.safetensors")
    with pytest.raises(InputError, match="8 frames or more, but got 4"):
        extractor.fit(moving()[:4])
    with pytest.raises(InputError, match="nothing moves"):
        extractor.fit(replace(moving(), rgb=moving().rgb[:1].repeat(COUNT, axis=0)))
    with pytest.raises(MissingFileError, match="no file of weights"):
        TransporterExtractor(tmp_path / "none.safetensors")
    (tmp_path / "bad.safetensors").write_bytes(b"not weights")
    with pytest.raises(InputError, match="cannot be read as weights"):
        TransporterExtractor(tmp_path / "bad.safetensors")
