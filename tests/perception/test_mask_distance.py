"""``muslin mask-distance``: two sets of videos, one distance in pixels."""

import json
from pathlib import Path

import numpy as np
import pytest

from muslin.cli.main import run
from muslin.core.errors import InputError
from muslin.core.frames import Frames, Video
from muslin.core.video_store import save_videos
from muslin.perception.mask_distance import mask_distance

RED = (196, 72, 50)


def video(name: str, shift: int = 0, count: int = 5, rate: float = 10.0, size: int = 64) -> Video:
    frames = np.full((count, 48, size, 3), 200, np.uint8)
    for k in range(count):
        left = 5 + round(10 * k / rate) + shift
        frames[k, 10:30, left : left + 20] = RED
    return Video(name, np.arange(count) / rate, Frames(frames))


def apart(shift: int) -> float:
    """Of a square of 20 pixels moved by less: that many columns at 1, 2, ... pixels."""
    return sum(range(1, shift + 1)) / 20


def test_takes_of_a_name_are_compared() -> None:
    found = mask_distance([video("a"), video("b")], [video("b", 4), video("a", 2), video("c")])
    assert [(t.one, t.other) for t in found.takes] == [("a", "a"), ("b", "b")]
    np.testing.assert_allclose([t.mean for t in found.takes], [apart(2), apart(4)])
    assert found.mean == pytest.approx(np.mean([apart(2), apart(4)]))
    assert found.deviation == pytest.approx(np.std([apart(2), apart(4)]))


def test_one_take_is_compared_with_each() -> None:
    found = mask_distance([video("real")], [video("draw-1", 2), video("draw-2", 4)])
    assert [t.other for t in found.takes] == ["draw-1", "draw-2"]


def test_frames_of_the_same_time_are_compared() -> None:
    found = mask_distance([video("a")], [video("a", count=9, rate=20.0)])
    assert found.takes[0].time.tolist() == [0.0, 0.1, 0.2, 0.3, 0.4]
    assert found.mean == 0.0


def test_what_does_not_go_together_is_refused() -> None:
    with pytest.raises(InputError, match="64 x 48 and 'a' has 80 x 48"):
        mask_distance([video("a")], [video("a", size=80)])
    with pytest.raises(InputError, match="no take of one store has the name"):
        mask_distance([video("a"), video("b")], [video("c"), video("d")])
    late = Video("a", 10.0 + np.arange(5) / 10.0, video("a").frames)
    with pytest.raises(InputError, match="no frames are of the same time: 'a' runs from 0 to"):
        mask_distance([video("a")], [late])
    with pytest.raises(InputError, match="video 'a': no frame has a patch"):
        mask_distance([video("a")], [video("a")], hue=(100, 120))


def test_the_command_prints_and_writes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    blank = video("a", 4)
    blank.frames.rgb[4] = 200
    save_videos([video("a")], tmp_path / "one.zarr")
    save_videos([blank], tmp_path / "other.zarr")
    given = [str(tmp_path / "one.zarr"), str(tmp_path / "other.zarr"), "--hue", "350,30", "--saturation", "0.3,1"]
    with pytest.raises(SystemExit) as done:
        run(["mask-distance", *given, "--json", str(tmp_path / "d.json")])
    said = capsys.readouterr().out
    assert not done.value.code, said
    curve = [apart(4)] * 4 + [float(np.hypot(48, 64))]
    assert f"{np.mean(curve):.2f} ± 0.00 px over 1 take" in said and "1 without the object" in said
    found = json.loads((tmp_path / "d.json").read_text())
    np.testing.assert_allclose(found["takes"][0]["distance_px"], curve)
    with pytest.raises(SystemExit) as done:
        run(["mask-distance", *given[:2], "--hue", "red"])
    assert done.value.code == 2 and "--hue must be two numbers" in capsys.readouterr().err
