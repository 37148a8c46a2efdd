"""``muslin compare-simulators``."""

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import ClassVar

import pytest
from running import Muslin

from muslin.core.comparison import compare_simulators
from muslin.core.parameters import Parameter
from muslin.core.scenarios import preset
from muslin.core.testing.reference import ReferenceSimulator


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


@pytest.mark.parametrize(("draws", "shots"), [(1, ["The only draw"]), (2, ["The median draw", "disagree on most"])])
def test_a_page_about_few_draws_shows_each_once_and_no_number_that_is_none(
    draws: int, shots: list[str], tmp_path: Path
) -> None:
    pytest.importorskip("jinja2")
    from muslin.cli.report.simulators import write_simulator_report

    class Twin(ReferenceSimulator):
        name: ClassVar[str] = "twin"

    scenario = preset("hang").scenario(vertices=(3, 3))
    scenario = replace(scenario, times=scenario.times[:4])
    prior = [Parameter("stretch_stiffness", "N/m", 10.0, 40.0)]
    found = compare_simulators(scenario, [ReferenceSimulator(), Twin()], draws, parameters=prior, workers=0)
    page = write_simulator_report(found, scenario.body.edges, tmp_path / "page.html").read_text()
    assert "nan" not in re.sub(r"<style>.*?</style>|data:[^\"]*", "", page, flags=re.S)
    assert page.count("data:image/png") == len(shots) and all(s in page for s in shots)
    assert "too few draws ended well to tell; 8 or more would do" in page


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
