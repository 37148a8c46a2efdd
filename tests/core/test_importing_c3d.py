import warnings
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from published import published

from muslin.core.errors import InputError
from muslin.core.importing import ImportOptions, import_file, import_together

ezc3d = pytest.importorskip("ezc3d", reason="C3D needs ezc3d: pip install 'muslin[mocap]'")


def write_c3d(
    path: Path, points: np.ndarray, unit: str = "mm", rate: float = 50.0, labels: Sequence[str] | None = None
) -> Path:
    frames, count = points.shape[:2]
    file = ezc3d.c3d()
    file["parameters"]["POINT"]["RATE"]["value"] = [rate]
    file["parameters"]["POINT"]["LABELS"]["value"] = list(labels or [f"M{k}" for k in range(count)])
    file["parameters"]["POINT"]["UNITS"]["value"] = [unit]
    data = np.ones((4, count, frames))
    data[:3] = np.moveaxis(points, (0, 1, 2), (2, 1, 0))
    file["data"]["points"] = data
    residuals = np.where(np.isnan(points[..., 0]), -1.0, 0.0).T[None]
    file["data"]["meta_points"]["residuals"] = residuals
    file.write(str(path))
    return path


def sample() -> np.ndarray:
    return np.random.default_rng(0).uniform(-200, 200, (20, 3, 3)).astype(np.float32).astype(float)


def test_units_rate_and_gaps(tmp_path: Path) -> None:
    points = sample()
    points[5, 1] = np.nan
    [r] = import_file(write_c3d(tmp_path / "a.c3d", points))
    np.testing.assert_allclose(r.series.points, points / 1000, atol=1e-7)
    assert np.isnan(r.series.points[5, 1]).all()
    np.testing.assert_allclose(r.series.time, np.arange(20) / 50.0)
    [r] = import_file(tmp_path / "a.c3d", ImportOptions(unit="cm", name="x"))
    np.testing.assert_allclose(r.series.points, points / 100, atol=1e-6)


def test_a_unit_that_is_not_known(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="unit 'furlong' is not known; units are m, cm, mm, px"):
        import_file(write_c3d(tmp_path / "a.c3d", sample(), unit="furlong"))


def test_markers_are_the_same_in_all_files_by_their_names(tmp_path: Path) -> None:
    points = sample()
    first = write_c3d(tmp_path / "a.c3d", points, labels=["tip", "middle", "clamp"])
    other = write_c3d(tmp_path / "b.c3d", points[:, [2, 0, 1]], labels=["clamp", "tip", "middle"])
    with pytest.warns(UserWarning, match=r"b\.c3d: its points, by their names, are put in the order of .*a\.c3d"):
        a, b = import_together([(path, ImportOptions()) for path in (first, other)])
    np.testing.assert_array_equal(a.series.points, b.series.points)
    np.testing.assert_allclose(a.series.points, points / 1000, atol=1e-7)
    twice = write_c3d(tmp_path / "d.c3d", points, labels=["tip", "tip", "clamp"])
    again = write_c3d(tmp_path / "e.c3d", points, labels=["clamp", "tip", "tip"])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        c, d = import_together([(path, ImportOptions()) for path in (twice, again)])
    np.testing.assert_array_equal(c.series.points, d.series.points)  # nothing tells the two apart


def test_markers_of_other_names_are_told(tmp_path: Path) -> None:
    first = write_c3d(tmp_path / "a.c3d", sample(), labels=["tip", "middle", "clamp"])
    other = write_c3d(tmp_path / "b.c3d", sample(), labels=["tip", "elbow", "clamp"])
    told = r"b\.c3d: its points elbow are not in .*a\.c3d, which has middle; they are taken for the same by the order"
    with pytest.warns(UserWarning, match=told):
        import_together([(path, ImportOptions()) for path in (first, other)])


def test_a_file_cut_short(tmp_path: Path) -> None:
    whole = write_c3d(tmp_path / "a.c3d", sample()).read_bytes()
    (tmp_path / "b.c3d").write_bytes(whole[: len(whole) - 48 * 8])
    with pytest.raises(InputError, match="cut short: it announces 20 frames"):
        import_file(tmp_path / "b.c3d")


def test_damage_that_takes_the_library_down_is_told(tmp_path: Path) -> None:
    whole = write_c3d(tmp_path / "a.c3d", sample()).read_bytes()
    rng = np.random.default_rng(2)
    cases = [b"", b"C3D?", whole[:512], bytes(4096), whole[512:]]
    for _ in range(8):
        damaged = bytearray(whole)
        for _ in range(20):
            damaged[rng.integers(1024)] = rng.integers(256)
        cases.append(bytes(damaged))
    told = 0
    for content in cases:
        (tmp_path / "z.c3d").write_bytes(content)
        try:
            import_file(tmp_path / "z.c3d")
        except InputError as error:
            told += 1
            assert "z.c3d" in str(error) and "\n" not in str(error)
    assert told >= 8


def test_the_beam_recordings_agree_with_their_conversion() -> None:
    files = sorted(published("beam").glob("*.c3d"))
    assert len(files) == 6
    for file in files:
        [r] = import_file(file, ImportOptions(up="x"))
        with np.load(file.with_suffix(".npz"), allow_pickle=False) as other:
            expected = other["markers"][..., [1, 2, 0]]
            np.testing.assert_allclose(r.series.points, expected, atol=1e-6)
            np.testing.assert_allclose(np.diff(r.series.time), 1.0 / float(other["fps"]))
