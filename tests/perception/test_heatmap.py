"""``heatmap``: peaks to a fraction of a cell, clear errors, and what it learns from a few frames."""

import pickle
from pathlib import Path

import numpy as np
import pytest
import torch

from muslin.core.errors import InputError, MissingFileError, StepMissingError
from muslin.core.frames import Frames
from muslin.core.series import PointSeries
from muslin.core.testing.image_extractors import lesson
from muslin.perception.heatmap import HeatmapExtractor
from muslin.perception.heatmap_net import HeatmapNet, log_shares
from muslin.perception.heatmap_peaks import gaussians, peaks
from muslin.perception.heatmap_training import best_threshold, moved, shrunk
from muslin.perception.weights import save_weights

FRAMES, POINTS = lesson()
TIME = 0.1 * np.arange(len(FRAMES))


def test_a_peak_is_found_to_a_fraction_of_a_cell() -> None:
    rng = np.random.default_rng(0)
    cells = torch.from_numpy(rng.uniform(6, 26, (50, 3, 2)))
    shares = gaussians(cells, (32, 32))
    place, sure = peaks(shares)
    assert float((place - cells).abs().max()) < 0.06
    assert float(sure.min()) > 0.97
    coarse, _ = peaks(shares, "argmax")
    assert torch.equal(coarse, cells.round())


def test_a_second_lower_peak_does_not_draw_a_point_away() -> None:
    shares = 0.6 * gaussians(torch.tensor([[[8.3, 8.0]]]), (32, 32)) + 0.4 * gaussians(
        torch.tensor([[[24.0, 24.0]]]), (32, 32)
    )
    place, sure = peaks(shares)
    assert place[0, 0].tolist() == pytest.approx([8.3, 8.0], abs=0.06)
    assert float(sure[0, 0]) == pytest.approx(0.6, abs=0.02)


def test_a_keypoint_that_is_not_seen_has_an_empty_heatmap() -> None:
    points = torch.tensor([[[5.0, 5.0], [torch.nan, torch.nan]]])
    assert gaussians(points, (16, 16)).sum(dim=(2, 3))[0].tolist() == pytest.approx([1.0, 0.0])
    nowhere = log_shares(torch.full((1, 1, 4, 4), -50.0)).exp()
    assert float(nowhere[0, 0, -1]) == pytest.approx(1.0)


def test_points_move_with_the_pixels_of_a_picture_that_is_shrunk() -> None:
    rgb = np.zeros((1, 128, 128, 3), np.uint8)
    rgb[0, 40:44, 80:84] = 255  # its middle at (81.5, 41.5)
    small = shrunk(rgb, 32)[0, :, :, 0]
    assert small.shape == (32, 32)
    v, u = np.argwhere(small == 255)[0]
    assert moved(np.array([81.5, 41.5]), (128, 128), (32, 32)).tolist() == [u, v]
    assert moved(np.array([float(u), float(v)]), (32, 32), (128, 128)).tolist() == [81.5, 41.5]
    assert shrunk(np.zeros((1, 48, 64, 3), np.uint8), 320).shape == (1, 64, 64, 3)  # little is enlarged


def test_the_threshold_tells_seen_from_unseen() -> None:
    assert 0.4 < best_threshold(np.array([0.8, 0.9]), np.array([0.2, 0.4])) < 0.8
    assert best_threshold(np.array([0.3]), np.zeros(0)) < 0.3
    assert best_threshold(np.zeros(0), np.array([0.3])) > 0.3


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda p: None, "learns from annotated frames"),
        (lambda p: p[:5], r"shape \(10, K, 2\)"),
        (lambda p: p * np.nan, "no keypoint is annotated in any frame"),
        (lambda p: np.where([[[False], [True]]], np.nan, p), "keypoint 1 .* is annotated in no frame"),
        (lambda p: p + 100, "lies at .* outside of a picture of 64 x 48"),
    ],
)
def test_annotations_that_cannot_be_learned_from_are_told(change: object, says: str) -> None:
    with pytest.raises(InputError, match=says):
        HeatmapExtractor().fit(FRAMES, change(POINTS))  # type: ignore[operator]


def test_too_few_frames_and_wrong_options_are_told() -> None:
    with pytest.raises(InputError, match="4 annotated frames or more, but got 3"):
        HeatmapExtractor().fit(FRAMES[:3], POINTS[:3])
    for options, says in (
        ({"peak": "mean"}, "peak must be"),
        ({"preset": "huge"}, "preset must be one of small, paper"),
        ({"threshold": 2.0}, "threshold must be 0 to 1"),
        ({"size": 7}, "size must be 32"),
        ({"epochs": 0}, "epochs must be 1"),
        ({"device": "tpu"}, "device must be"),
    ):
        with pytest.raises(InputError, match=says):
            HeatmapExtractor(**options)  # type: ignore[arg-type]


def test_it_looks_only_after_it_has_learned_and_at_frames() -> None:
    with pytest.raises(StepMissingError, match=r"has not learned yet.*muslin train heatmap"):
        HeatmapExtractor().extract(FRAMES, TIME)
    with pytest.raises(InputError, match="takes images, not points"):
        HeatmapExtractor().extract(PointSeries(TIME, POINTS), TIME)


def test_files_that_are_not_its_weights_are_told(tmp_path: Path) -> None:
    with pytest.raises(MissingFileError, match="no file of weights"):
        HeatmapExtractor(weights=tmp_path / "none.safetensors")
    path = tmp_path / "other.safetensors"
    path.write_bytes(b"not weights at all")
    with pytest.raises(InputError, match="cannot be read as weights"):
        HeatmapExtractor(weights=path)
    save_weights(path, "transporter", {"a": np.zeros(1)}, {})
    with pytest.raises(InputError, match="not of extractor 'heatmap'"):
        HeatmapExtractor(weights=path)
    about = {"keypoints": 4, "stages": 3, "height": 64, "width": 64, "threshold": 0.5}
    save_weights(path, "heatmap", {"draw.bias": np.zeros(3)}, about)
    with pytest.raises(InputError, match=r"these weights are not of this 'heatmap'.*Train it again"):
        HeatmapExtractor(weights=path).extract(FRAMES, TIME)
    save_weights(path, "heatmap", {"draw.bias": np.zeros(4)}, {"keypoints": 4})
    with pytest.raises(InputError, match=r"does not describe a trained 'heatmap' \(no stages\)"):
        HeatmapExtractor(weights=path)


@pytest.fixture(scope="module")
def learned() -> HeatmapExtractor:
    extractor = HeatmapExtractor(epochs=18)
    before = torch.random.get_rng_state()
    extractor.fit(FRAMES, POINTS)
    assert torch.equal(torch.random.get_rng_state(), before)
    return extractor


@pytest.mark.slow
def test_it_learns_where_two_squares_are(learned: HeatmapExtractor) -> None:
    found, _ = learned.locate(FRAMES)
    apart = np.linalg.norm(found - POINTS, axis=2)
    assert np.nanmedian(apart) < 2.0
    assert 0.0 < learned._about["threshold"] < 1.0


@pytest.mark.slow
def test_frames_of_another_size_give_points_in_their_own_pixels(learned: HeatmapExtractor) -> None:
    double = np.repeat(np.repeat(FRAMES.rgb, 2, axis=1), 2, axis=2)
    one, two = (learned.locate(Frames(rgb))[0] for rgb in (FRAMES.rgb, double))
    assert np.median(np.abs((two + 0.5) / 2 - 0.5 - one)) < 0.5


@pytest.mark.slow
def test_its_file_says_what_it_is_and_carries_options_of_its_user(learned: HeatmapExtractor, tmp_path: Path) -> None:
    learned.save(tmp_path / "squares.safetensors")
    again = HeatmapExtractor(weights=tmp_path / "squares.safetensors", peak="argmax", threshold=0.0)
    assert again.keypoints == 2
    assert np.isfinite(again.extract(FRAMES, TIME).points).all()
    with pytest.raises(InputError, match=r"no keypoint reaches a confidence of 1\.00"):
        HeatmapExtractor(weights=tmp_path / "squares.safetensors", threshold=1.0).extract(FRAMES, TIME)


def test_the_paper_s_setting_is_one_option_away() -> None:
    paper = HeatmapExtractor(preset="paper")
    assert (paper.size, paper.stages, 250 * paper.training.copies) == (320, 4, 3000)
    assert pickle.loads(pickle.dumps(paper)).training == paper.training
    assert HeatmapNet(2, 4)(torch.zeros(1, 3, 64, 32)).shape == (1, 2, 32, 16)


@pytest.mark.skipif(not torch.cuda.is_available(), reason="no GPU")
def test_a_gpu_finds_what_the_processor_finds(learned: HeatmapExtractor, tmp_path: Path) -> None:
    learned.save(tmp_path / "squares.safetensors")
    one, two = (
        HeatmapExtractor(weights=tmp_path / "squares.safetensors", device=name).locate(FRAMES)[0]
        for name in ("cpu", "cuda")
    )
    np.testing.assert_allclose(one, two, atol=0.2)
