"""Points at exactly zero: not seen where they cannot be there, real where they can."""

from pathlib import Path

import numpy as np
import pytest

from muslin.core.dataset import DatasetNote
from muslin.core.importing import ImportOptions, import_file
from muslin.core.importing.zeros import unseen_zeros

TIME = np.linspace(0.0, 1.0, 101)


def swinging() -> np.ndarray:
    """Three markers half a metre from the origin that swing, with noise."""
    phase = 3.0 * TIME[:, None] + np.arange(3)
    points = np.stack([0.5 + 0.1 * np.sin(phase), 0.1 * np.cos(phase), 0.4 + 0.0 * phase], axis=2)
    return np.asarray(points + 1e-4 * np.random.default_rng(0).normal(size=points.shape))


def test_a_marker_that_jumps_to_zero_was_not_seen() -> None:
    points, lost = swinging(), np.zeros((101, 3), bool)
    lost[:4, 0] = lost[30:50, 1] = lost[60, 2] = lost[-2:, 2] = True
    points[lost] = 0.0
    points[40, 1] = np.nan
    lost[40, 1] = False
    assert np.array_equal(unseen_zeros(points, True), lost)


def test_a_marker_that_is_at_the_origin_stays() -> None:
    away = np.maximum(TIME - 0.5, 0.0) ** 2
    points = np.zeros((101, 3, 3))
    points[:, 0, 0] = 0.5 + away
    points[:, 1, 0] = away  # rests there, and leaves as things do
    assert not unseen_zeros(points, True).any()  # and the last one is held there
    points[:, 2, 0] = TIME - 0.5  # comes by
    assert (points[50, 2] == 0.0).all() and not unseen_zeros(points, True).any()
    assert not unseen_zeros(np.zeros((4, 2, 3)), True).any()


def test_places_that_a_cloud_leaves_empty() -> None:
    points = np.random.default_rng(0).normal(size=(5, 6, 3))
    points[2, 3:] = 0.0
    points[4, 0] = 0.0
    lost = unseen_zeros(points, False)
    assert lost[2, 3:].all() and lost.sum() == 3


@pytest.mark.parametrize("suffix", ["npz", "csv"])
def test_an_import_says_what_it_takes_as_not_seen(tmp_path: Path, suffix: str) -> None:
    points, file = swinging(), tmp_path / f"take.{suffix}"
    points[30:50, 1] = 0.0
    if suffix == "npz":
        np.savez(file, time=TIME, points=1e3 * points)
    else:
        rows = [f"{t},{p},{','.join(map(str, 1e3 * points[k, p]))}" for k, t in enumerate(TIME) for p in range(3)]
        file.write_text("\n".join(["time,point,x,y,z", *rows]))
    said = r"20 observations at exactly 0, 0, 0, .* are taken as not seen \(NaN\)"
    with pytest.warns(DatasetNote, match=said):
        [r] = import_file(file, ImportOptions(unit="mm", start=0.35))
    assert np.isnan(r.series.points[:15, 1]).all() and np.isfinite(r.series.points[15:]).all()
