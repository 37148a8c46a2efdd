"""Readers of published sets on the real recordings, where there are any."""

import re

import numpy as np
import pytest
from published import ROOT, published
from test_datasets import read

from muslin.core.motion import inverse, rotate
from muslin.core.study import read_config


def test_real_cables_have_a_length_that_hardly_changes() -> None:
    path = published("cable") / "cable1.npz"
    takes, notes = read("deform-cable", path)
    assert len(takes) == 56 and any("lost frames" in n for n in notes)
    for take in takes:
        apart = np.linalg.norm(np.diff(take.series.points, axis=1), axis=2)
        assert np.isfinite(apart).mean() > 0.95
        assert 0.9 < np.nansum(np.nanmedian(apart, axis=0)) < 1.15  # metres
        assert take.gripper is not None and take.gripper.grippers == 2
    hangs = np.mean([t.series.points[:, 6, 2].mean() < t.gripper.poses[:, :, 2].mean() for t in takes if t.gripper])
    assert hangs == 1.0  # z is up


def test_real_carried_cloths_lag_as_published() -> None:
    takes, notes = read("carried-cloth", published("cloth_carried"))
    assert len(takes) == len(list(published("cloth_carried").glob("*.npz")))
    lags = [float(lag.group(1)) for n in notes if (lag := re.search(r" by ([\d.]+) s[;,]", n))]
    assert len(lags) + sum("no poses of the robot" in n for n in notes) == len(takes)
    assert min(lags) >= 0.24 and max(lags) <= 0.38
    for take in takes:
        n = int(np.sqrt(take.series.points.shape[1]))
        top, low = take.series.points[:, :n], take.series.points[:, -n:]
        assert 0.15 < np.nanmedian(top[..., 2]) - np.nanmedian(low[..., 2]) < 0.35
        assert take.gripper is not None
        pose = take.gripper.at(take.series.time)[:, 0, :3]
        assert np.nanmedian(np.linalg.norm(np.nanmean(top, axis=1) - pose, axis=1)) < 0.03


def test_real_carried_cloths_differ_while_held_still_as_their_study_says() -> None:
    """Of what hangs still from a hand that is still, a model can tell the mean; what it differs by is no model's."""
    config = read_config(ROOT / "examples/carried_cloth/study.toml")
    names = [*config.study.fit_on, *config.study.hold_out]
    takes, _ = read("carried-cloth", published("cloth_carried"), *names)
    within, means = [], []
    for take in takes:
        assert take.gripper is not None
        time, poses = take.series.time, take.gripper.at(take.series.time)[:, 0]
        fine = np.arange(time[0], time[-1], 0.02)
        speed = np.linalg.norm(np.diff(take.gripper.at(fine)[:, 0, :3], axis=0), axis=1) / 0.02
        before = [speed[(fine[1:] > t - 1.0) & (fine[1:] <= t)] for t in time]
        still = [len(b) >= 49 and b.max() < 0.01 for b in before]
        seen = take.series.points[still]
        hanging = np.array([rotate(inverse(q[3:]), x - q[:3]) for q, x in zip(poses[still], seen, strict=True)])
        assert len(hanging) > 10
        means.append(np.nanmean(hanging, axis=0))
        within.append(np.nanmean((hanging - means[-1]) ** 2))
    shapes = np.array(means) - np.mean(means, axis=1, keepdims=True)  # the study takes a constant offset out
    spread = np.sqrt(np.mean(within) + np.mean(np.var(shapes, axis=0, ddof=1)))
    assert spread == pytest.approx(config.noise.sd, abs=0.001)


def test_real_clouds_are_in_metres_above_the_table() -> None:
    takes, _ = read("cloth-cloud", published("cloth_cloud"))
    assert len(takes) == 12 and len({t.motion for t in takes}) == 6
    for take in takes:
        assert not take.series.correspondence
        assert 0.04 < np.nanmin(take.series.points[..., 2]) < np.nanmax(take.series.points[..., 2]) < 0.45
