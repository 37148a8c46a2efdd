"""The unknown: the force that nobody has named, and the law it follows."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from unknown_study import Hidden, fitted_study

from muslin.core.body import cloth_grid, rope_line
from muslin.core.errors import InputError, MissingFileError
from muslin.core.parameters import Parameter, ParameterSpace
from muslin.core.registry import REGISTRY
from muslin.core.rollout import rollout
from muslin.core.study import Study
from muslin.core.testing.reference import ReferenceSimulator
from muslin.core.testing.samples import sample_material, sample_scenario
from muslin.inference.criticism.unknown import unknown as step
from muslin.inference.criticism.unknown.basis import make_basis, mesh_modes
from muslin.inference.criticism.unknown.decision import Case, decide
from muslin.inference.criticism.unknown.field import field_effect
from muslin.inference.criticism.unknown.law_file import add_law, law_effect, read_law
from muslin.inference.criticism.unknown.library import Piece
from muslin.inference.criticism.unknown.refit import RefittedLaw
from muslin.inference.criticism.unknown.result import law_table, law_text
from muslin.inference.polish import Polished
from muslin.plugins.effects.law import Law

SHEET = cloth_grid(0.3, 0.3, 7, 7)
TIMES = np.linspace(0.2, 1.2, 31)
BASIS = make_basis(SHEET, np.array([0, 6]), TIMES, 60, 20)


def test_modes_are_orthonormal_and_start_with_the_constant() -> None:
    for body in (SHEET, rope_line(np.array([[0.0, 0, 0], [1.0, 0, 0]]), 20)):
        waves, modes = mesh_modes(body, 6)
        share = body.vertex_measures / body.vertex_measures.sum()
        np.testing.assert_allclose(modes.T @ (share[:, None] * modes), np.eye(6), atol=1e-9)
        np.testing.assert_allclose(np.abs(modes[:, 0]), 1.0, atol=1e-9)
        assert waves[0] == pytest.approx(0.0, abs=1e-6)
        assert waves[1] == pytest.approx(1.0)
        assert (np.diff(waves) > -1e-9).all()


def test_modes_of_a_rope_are_cosines_along_it() -> None:
    body = rope_line(np.array([[0.0, 0, 0], [1.0, 0, 0]]), 40)
    waves, modes = mesh_modes(body, 4)
    np.testing.assert_allclose(waves, [0, 1, 2, 3], atol=0.02)
    expected = np.sqrt(2) * np.cos(np.pi * np.arange(40) / 39)
    assert abs(modes[:, 1] @ expected) / np.linalg.norm(modes[:, 1]) / np.linalg.norm(expected) > 0.999


def test_a_field_of_the_basis_is_found_again() -> None:
    coefficients = np.random.default_rng(0).normal(size=len(BASIS))
    again = BASIS.project(TIMES, BASIS.accelerations(TIMES, coefficients))
    np.testing.assert_allclose(again, coefficients, atol=1e-8)


def test_what_a_gripper_holds_does_not_matter_to_a_projection() -> None:
    field = BASIS.accelerations(TIMES, np.ones(len(BASIS)))
    field[:, [0, 6]] += 100.0
    np.testing.assert_allclose(BASIS.project(TIMES, field), 1.0, atol=1e-8)


def test_a_steady_field_is_the_same_acceleration_in_a_rollout() -> None:
    """The first function along an axis is a uniform acceleration, from before the recording on."""
    scenario = replace(sample_scenario("cloth"), settle=0.05)
    basis = make_basis(scenario.body, scenario.grasps[0], scenario.times, 12, 12)
    mean = basis.modes[0, 0]
    field = field_effect(basis, None)(**{"1": 0.8 / mean})
    pushed, told = (
        rollout(ReferenceSimulator(), scenario, sample_material("cloth"), [e]).series.points
        for e in (field, Hidden(lambda t, x, v: np.array([0.0, 0.8, 0.0]) + 0 * v))
    )
    np.testing.assert_allclose(pushed, told, atol=1e-9)


def check_json(result: dict[str, object]) -> None:
    json.loads(json.dumps(result, allow_nan=False))
    assert set(result) == {
        "version", "verdict", "law", "nearest", "alternatives", "force", "error", "simulations", "seconds", "seed",
    }  # fmt: skip


def test_without_a_misfit_nothing_is_sought(tmp_path: Path) -> None:
    study = fitted_study(tmp_path, None)
    found = step.unknown(study)
    check_json(found.result)
    assert (found.result["verdict"], found.result["law"], found.result["force"]) == ("no-misfit", None, None)
    assert found.result["simulations"] < 20  # seven a recording tell what is chance
    assert "no misfit" in found.text()


def test_a_misfit_is_told_by_squares_whatever_the_tails_of_a_fit(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A force that acts for a moment is what tails would leave to a logarithm."""
    seen = []

    def case(**told: float) -> None:
        seen.append(told["rss_plain"])
        raise InputError("that is enough")

    monkeypatch.setattr(step, "Case", case)
    for tails in (None, 3.0):
        (folder := tmp_path / str(tails)).mkdir()
        study = fitted_study(folder, None)
        fit = study.results("r+")["fit"]
        fit["estimate_unit"][0] = 0.9  # far from the best
        fit.attrs["noise"] = {**fit.attrs["noise"], "tails": tails}
        with pytest.raises(InputError, match="enough"):
            step.unknown(study)
    assert seen[0] == seen[1] > 1e4


@pytest.mark.slow
@pytest.mark.parametrize(
    ("push", "terms"),
    [
        (lambda t, x, v: -3.0 * v, {"linear_drag": 3.0}),
        (lambda t, x, v: np.array([0.0, 1.0, 0.0]) + 0 * v, {"acceleration_y": 1.0}),
    ],
    ids=["drag", "sideways"],
)
def test_a_hidden_law_is_found_and_added(tmp_path: Path, monkeypatch, push, terms) -> None:
    """The force explains the misfit, the law has the right terms and numbers, and a study carries it."""
    monkeypatch.setattr(step, "FUNCTIONS", 60)
    study, heard = fitted_study(tmp_path, push), []
    study.progress = lambda text, done, total: heard.append((text, total))
    found = step.unknown(study)
    result = found.result
    assert {("following recording 'near'", 12), ("asking what is chance", 0)} <= set(heard)
    assert max(total for text, total in heard if text == "estimating the missing force") > 20
    check_json(result)
    assert result["force"]["explained"] > 0.9
    assert result["verdict"] in ("law", "tied")
    laws = [law["terms"] for law in (result["law"], *result["alternatives"])]
    mine = [law for law in laws if set(law) == set(terms)]
    assert mine, f"the law is not among {laws}"
    for name, value in terms.items():
        assert abs(mine[0][name]["mean"] - value) < max(5 * mine[0][name]["sd"], 0.02 * value)
    assert result["law"]["explained_held_out"] > 0.9
    assert result["error"]["held_out_after"] < 1.15 * result["error"]["noise"]

    group = study.step_results("unknown")["near"]
    force, sd = np.asarray(group["force"][...]), np.asarray(group["force_sd"][...])  # type: ignore[index,call-overload]
    assert force.shape == sd.shape == (36, 9, 3)
    assert not force[:, [0, 2]].any()
    assert (sd[:, 4] > 0).all()

    (tmp_path / "law.json").write_text(json.dumps(result))
    added = add_law(study, tmp_path / "law.json", tmp_path / "study2.toml")
    inferred = {n.removeprefix("law.") for n in Study.load(added.path).problem.space.names} - {"stretch_stiffness"}
    assert inferred == set(result["law"]["terms"])


@pytest.mark.slow
def test_no_law_is_made_up_for_a_force_of_no_simple_kind(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr(step, "FUNCTIONS", 60)
    rng = np.random.default_rng(3)
    table = rng.normal(size=(40, 9, 3))

    def push(t: float, x: np.ndarray, v: np.ndarray) -> np.ndarray:
        seed = round(1e3 * abs(float(x[0, 1]))) % 7  # of the motion, so that no other motion has the same
        return 3.0 * np.roll(table, seed, axis=0)[int(np.clip(20 * t, 0, 39))]

    result = step.unknown(fitted_study(tmp_path, push)).result
    check_json(result)
    assert (result["verdict"], result["law"]) == ("none", None)
    assert result["force"]["explained"] > 0.3


def refitted(rss: float, **held_out: float) -> RefittedLaw:
    """A law that leaves so much [noise variances] of 300 numbers, and these errors on held-out recordings [m]."""
    space = ParameterSpace((Parameter("stiffness", "Pa", 0, 1), Parameter("law.linear_drag", "1/s", 0, 10)))
    fit = Polished(np.array([0.5, 0.3]), np.full(300, np.sqrt(rss / 300)), np.zeros((300, 2)), np.eye(2) * 1e-4, 300.0)
    return RefittedLaw((Piece("drag", ("linear_drag",)),), space, 1, fit, held_out)


def test_of_what_cannot_be_simulated_without_a_law_no_shares_are_told() -> None:
    case = Case(9 * 300.0, 300.0, {"other": np.inf}, 0.003, 0.01)
    law, torn = refitted(300.0, other=0.010), refitted(300.0, other=np.inf)
    assert case.explained_held_out(law) is None and case.holds_up(law) and not case.holds_up(torn)
    decision = decide(replace(case, laws=(law,)))
    assert decision.verdict == "law"
    told = law_table(case, law)
    force = {
        "recordings": {"near": {"over_weight": 0.1, "root_mean_square": 1e-3, "worst_time": 0.1}},
        "explained": 1.0,
    }
    error = {"held_out_before": np.inf, "held_out_after": 0.010, "noise": 0.003, "unit": "m"}
    text = " ".join(law_text({"verdict": "law", "law": told, "force": force, "error": error, "alternatives": []}))
    assert "cannot all be simulated without it; with it their error is 10.00 mm" in text
    assert "on held-out ones" not in text and "inf" not in text


def test_what_can_be_simulated_without_a_law_tells_what_it_explains() -> None:
    case = Case(9 * 300.0, 300.0, {"other": np.inf, "third": 0.010}, 0.003, 0.01)
    assert case.explained_held_out(refitted(300.0, other=0.5, third=0.010)) == 0.0
    assert not case.holds_up(refitted(300.0, other=0.004, third=0.010))
    assert case.holds_up(refitted(300.0, other=0.004, third=0.004))
    assert not case.holds_up(refitted(300.0, other=np.inf, third=0.004))


def law_file(folder: Path, **terms: object) -> Path:
    path = folder / "law.json"
    path.write_text(json.dumps({"version": 1, "verdict": "law", "law": {"terms": terms}}))
    return path


def test_a_law_file_becomes_priors_about_it_and_zero_for_the_rest(tmp_path: Path) -> None:
    path = law_file(tmp_path, linear_drag={"mean": 2.0, "sd": 0.1, "unit": "1/s"})
    assert read_law(path) == {"linear_drag": (2.0, 0.1)}
    table = law_effect(path)
    assert set(table) == {c.name for c in Law.coefficients}
    prior = table.pop("linear_drag")
    assert prior.low < 2.0 - 5 * 0.1 < 2.0 + 5 * 0.1 < prior.high  # type: ignore[union-attr]
    assert set(table.values()) == {0.0}


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("nothing", "not a JSON file"),
        ("[]", "no law file"),
        ('{"law": {}}', "version None"),
        ('{"version": 1, "law": null, "verdict": "none"}', "the verdict was 'none'"),
        ('{"version": 1, "law": {"terms": {}}}', "missing or empty"),
        ('{"version": 1, "law": {"terms": {"linear_drg": {}}}}', "Did you mean 'linear_drag'"),
        ('{"version": 1, "law": {"terms": {"linear_drag": {"mean": "x"}}}}', "needs numbers"),
        ('{"version": 1, "law": {"terms": {"linear_drag": {"mean": 1, "sd": 1, "unit": "m"}}}}', "convert it"),
        ('{"version": 1, "law": {"terms": {"linear_drag": {"mean": NaN, "sd": 1, "unit": "1/s"}}}}', "finite"),
        ('{"version": 1, "law": {"terms": {"linear_drag": {"mean": 99, "sd": 1, "unit": "1/s"}}}}', "outside of"),
    ],
)
def test_a_bad_law_file_is_refused(tmp_path: Path, content: str, message: str) -> None:
    path = tmp_path / "law.json"
    path.write_text(content)
    with pytest.raises(InputError, match=message):
        read_law(path)


def test_a_missing_law_file_says_how_to_make_one(tmp_path: Path) -> None:
    with pytest.raises(MissingFileError, match="muslin unknown"):
        read_law(tmp_path / "law.json")


def test_the_steps_are_installed() -> None:
    assert {"unknown", "add-law"} <= set(REGISTRY.names("step"))


def muslin(*arguments: object) -> str:
    """Run a command in this process; what it printed, or its error."""
    from typer.testing import CliRunner

    from muslin.cli.main import app

    result = CliRunner().invoke(app, [str(a) for a in arguments])
    return result.output if result.exception is None else str(result.exception)


def test_the_command_line_says_what_was_found_and_adds_a_law(tmp_path: Path) -> None:
    study = fitted_study(tmp_path, None)
    assert "no misfit" in muslin("unknown", study.path, "--json", tmp_path / "found.json")
    assert json.loads((tmp_path / "found.json").read_text())["verdict"] == "no-misfit"
    assert "holds no law" in muslin("add", "--law", tmp_path / "found.json", study.path)
    path = law_file(tmp_path, linear_drag={"mean": 2.0, "sd": 0.1, "unit": "1/s"})
    assert "wrote" in muslin("add", "--law", path, study.path, "-o", tmp_path / "study2.toml")
    assert "law.linear_drag" in Study.load(tmp_path / "study2.toml").problem.space.names
    assert "not both" in muslin("add", "air-drag", study.path, "--law", path)
    assert "alone" in muslin("add", "air-drag") and "--law FILE STUDY.toml" in muslin("add", "--law", path)
    assert "the law itself" in muslin("add", "--law", path, study.path, "-o", path, "--force")
    assert "has a law already" in muslin("add", "--law", path, tmp_path / "study2.toml", "-o", tmp_path / "3.toml")
    assert not (tmp_path / "3.toml").exists()


def test_what_a_law_left_unexplained_is_added_to_it(tmp_path: Path) -> None:
    """Muslin unknown looks beyond the terms that a study has, so what it finds is no law of its own."""
    study = fitted_study(tmp_path, None)
    add_law(study, law_file(tmp_path, linear_drag={"mean": 2.0, "sd": 0.1, "unit": "1/s"}), tmp_path / "study2.toml")
    path = law_file(tmp_path, acceleration_y={"mean": 1.0, "sd": 0.1, "unit": "m/s2"})
    assert "wrote" in muslin("add", "--law", path, tmp_path / "study2.toml", "-o", tmp_path / "3.toml")
    problem = Study.load(tmp_path / "3.toml").problem
    assert set(problem.space.names) == {"stretch_stiffness", "law.linear_drag", "law.acceleration_y"}
    assert problem.fixed["law.dry_drag"] == 0.0
    assert set(Study.load(tmp_path / "study2.toml").problem.space.names) == {"stretch_stiffness", "law.linear_drag"}


def test_the_force_is_drawn() -> None:
    pytest.importorskip("matplotlib")
    from muslin.cli.report.figures_force import force_figure

    force = np.random.default_rng(0).normal(size=SHEET.vertices.shape)
    for triangles in (SHEET.triangles, np.zeros((0, 3), np.int64)):
        picture = force_figure(SHEET.vertices, triangles, force, np.abs(force) / 2)
        assert picture.startswith("data:image/png;base64,")
        assert picture != force_figure(SHEET.vertices, triangles, -force, np.abs(force) / 2)
    assert force_figure(SHEET.vertices, SHEET.triangles, 0 * force)
