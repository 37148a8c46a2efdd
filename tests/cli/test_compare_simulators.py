"""``muslin compare-simulators``."""

import json
from pathlib import Path

import pytest
from running import Muslin


@pytest.mark.slow
def test_one_command_writes_report_and_figures(muslin: Muslin, tmp_path: Path) -> None:
    """Both engines on the same draws, one page without links to elsewhere."""
    pytest.importorskip("mujoco")
    pytest.importorskip("pybullet")
    prior = ("--parameter", "stretch_stiffness=100:200:log", "--parameter", "areal_density=0.1:0.3")
    done = muslin("compare-simulators", "lift", "--draws", "5", *prior, "--json", "figures.json", "-o", "page.html")
    assert done.returncode == 0, done.stderr
    assert "mujoco and pybullet are" in done.stdout and "areal_density" in done.stdout
    figures = json.loads((tmp_path / "figures.json").read_text())
    assert set(figures["simulators"]) == {"mujoco", "pybullet"}
    assert figures["pairs"][0]["median_difference_m"] < 0.02
    page = (tmp_path / "page.html").read_text()
    assert page.count("<svg") >= 3 and page.count("data:image/png") == 2
    assert "built-in method" not in page and page.count("stretch_stiffness 1") == 2  # the values of both draws shown
    assert "http" not in page.replace("http://www.w3.org", "")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["flings"], "Did you mean 'fling'"),
        (["fling", "--simulators", "mujoco"], "at least two different simulators"),
        (["fling", "--simulators", "mujoco,bullet"], "bullet"),
        (["fling", "--parameter", "friction"], "NAME=LOW:HIGH"),
        (["fling", "--parameter", "twist_rigidity=1:2"], "a cloth has no 'twist_rigidity'"),
        (["fling", "-o", "nowhere/page.html"], "nowhere"),
    ],
)
def test_what_is_wrong_is_said_before_anything_is_simulated(muslin: Muslin, arguments: list[str], words: str) -> None:
    done = muslin("compare-simulators", *arguments)
    assert done.returncode == 2
    assert words in done.stderr and "Traceback" not in done.stderr
