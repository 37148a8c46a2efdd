"""``muslin combine`` on made-up studies: the table, the file, and what is refused."""

import json
from pathlib import Path

import pytest
from made_up_study import make_study

pytest.importorskip("torch")

from test_calibrate import fitted
from test_commands import status

from muslin.cli.failure import BAD_INPUT
from muslin.core.study import Study


@pytest.fixture
def studies(tmp_path: Path) -> list[str]:
    """Two cloths of one material, each with recordings and results of its own."""
    folders = [tmp_path / "one", tmp_path / "two"]
    for folder in folders:
        folder.mkdir()
    return [str(fitted(folder).path) for folder in folders]


def test_a_shared_stiffness_is_told_of_both_and_of_both_together(
    studies: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "shared.json"
    assert status("combine", *studies, "-p", "stretch_stiffness", "--json", str(file)) == 0
    out = capsys.readouterr().out
    assert out.startswith("stretch_stiffness [N/m]") and "together" in out and f"wrote {file}" in out
    (row,) = json.loads(file.read_text())["parameters"]
    (low, _, high), (left, _, right) = row["studies"][studies[0]], row["together"]
    assert list(row["studies"]) == studies and low < left < right < high  # two know more than one
    assert not row["best_fit_outside_posterior"] and "warning" not in out


def test_a_fit_that_is_not_to_be_trusted_is_named(studies: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    fit = Study.load(Path(studies[1])).results("r+")["fit"]
    fit["estimate"][0] = 4900.0
    assert status("combine", *studies, "-p", "stretch_stiffness", "-p", "bending_rigidity") == 0
    of_stiffness, of_bending = capsys.readouterr().out.split("\n\n")
    assert f"warning: the best fit lies outside the posterior in {studies[1]};" in of_stiffness
    assert "warning" not in of_bending


def test_what_cannot_be_combined_is_refused(
    studies: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    def refused(*arguments: str) -> str:
        assert status("combine", *arguments) == BAD_INPUT
        return capsys.readouterr().err

    assert "--parameter NAME; they all infer stretch_stiffness, bending_rigidity, areal_density" in refused(*studies)
    assert "name two studies or more" in refused(studies[0], "-p", "stretch_stiffness")
    assert "both fitted on recording 'fling'" in refused(studies[0], studies[0], "-p", "stretch_stiffness")
    assert "does not infer 'stretch_stifness'. Did you mean" in refused(*studies, "-p", "stretch_stifness")
    (tmp_path / "new").mkdir()
    unfitted = str(make_study(tmp_path / "new").path)
    assert "run: muslin fit" in refused(studies[0], unfitted, "-p", "stretch_stiffness")
    assert "is the study itself" in refused(*studies, "-p", "stretch_stiffness", "--json", studies[1])
