"""The README against the code: its commands exist, its figures are those that the benchmarks wrote."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def test_the_table_of_hidden_effects_is_what_the_benchmark_wrote() -> None:
    rows = {r["figure"]: r["value"] for r in json.loads((ROOT / "results/hidden-small.json").read_text())["rows"]}
    lines = re.findall(r"^\| `?([a-z-]+)`? \| (\S+)(?:: `([a-z-]+)`)? \| ([\d.]+) → ([\d.]+) \|$", README, re.MULTILINE)
    assert len(lines) == 7
    for hidden, verdict, named, before, after in lines:
        assert rows[f"hidden {hidden}: verdict"] == f"{verdict}: {named or '-'}"
        assert f"{rows[f'hidden {hidden}: held-out error before']:.1f}" == before
        assert f"{rows[f'hidden {hidden}: held-out error after']:.1f}" == after


def test_the_table_of_materials_is_what_the_bench_wrote() -> None:
    """Recounted here: the worst error on the finest mesh and the goals met, for every group and simulator."""
    lines = re.findall(r"^\| ([a-z]+) \| (.*(?:met|claimed)) \| (.*(?:met|claimed)) \|$", README, re.MULTILINE)
    assert len(lines) >= 7
    for column, name in enumerate(("mujoco", "pybullet"), start=1):
        rows = json.loads((ROOT / f"results/material-{name}.json").read_text())["rows"]
        for line in lines:
            judged = [r for r in rows if r["group"] == line[0] and r["goal"] is not None and r["claimed"]]
            if not judged:
                assert line[column] == "not claimed"
                continue
            met = sum(r["status"] == "met" for r in judged)
            assert line[column].endswith(f"{met} of {len(judged)} met")
            errors = [abs(r["error"]) for r in judged if r["error"] is not None and r["asked"]]
            if errors:
                assert line[column].startswith(f"{100 * max(errors):.1f} %")


def test_the_table_of_posteriors_is_what_the_benchmark_wrote() -> None:
    table = json.loads((ROOT / "results/inference.json").read_text())["table"]
    header = re.search(r"^\| task, simulations \| (.*) \|$", README, re.MULTILINE)
    assert header
    methods = [m.strip("`") for m in header[1].split(" | ")]
    lines = re.findall(r"^\| ([\w ()]+), (\d+) \| (.*) \|$", README, re.MULTILINE)
    assert {(task, int(n)) for task, n, _ in lines} == {(r["task"], r["simulations"]) for r in table}
    for task, simulations, cells in lines:
        for method, cell in zip(methods, cells.split(" | "), strict=True):
            found = next(
                r for r in table if [r["task"], r["simulations"], r["method"]] == [task, int(simulations), method]
            )
            wanted = "–" if found["c2st"] is None else f"{found['c2st']:.3f}, {found['train_cpu_s']:.0f} s"
            assert cell == wanted


@pytest.mark.parametrize("first", ["| 139 cases of the batches", "| held-out error [mm] | carried along"])
def test_a_table_that_the_benchmarks_print_is_in_the_readme(first: str) -> None:
    done = subprocess.run(
        [sys.executable, ROOT / "tests/benchmarks/readme_table.py"], capture_output=True, text=True, check=True
    )
    table = next(part for part in done.stdout.split("\n\n") if part.startswith(first)).rstrip()
    assert table.count("\n") > 8 and table in README


@pytest.mark.parametrize("script, page", [("perception_table", "perception"), ("effects_batches", "hidden-effects")])
def test_the_tables_of_a_page_are_what_the_benchmark_wrote(script: str, page: str) -> None:
    done = subprocess.run(
        [sys.executable, ROOT / f"tests/benchmarks/{script}.py"], capture_output=True, text=True, check=True
    )
    printed = [line for line in done.stdout.splitlines() if line]
    told = (ROOT / f"docs/{page}.md").read_text(encoding="utf-8").splitlines()
    assert len(printed) > 6 and [line for line in told if line.startswith("|")] == printed


@pytest.mark.parametrize("command", sorted(set(re.findall(r"muslin ([a-z]+(?:-[a-z]+)?) ", README)) & {
    "import", "new", "fit", "compare", "diagnose", "add", "report", "plugins", "check",
    "bench-material", "compare-simulators", "render", "calibrate", "export"}))  # fmt: skip
def test_the_commands_of_the_readme_exist(command: str) -> None:
    done = subprocess.run([sys.executable, "-m", "muslin.cli", command, "--help"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_every_file_that_the_readme_names_is_there() -> None:
    for name in re.findall(r"`((?:examples|docs|results|tests)/[\w/.-]+)`|\]\(([\w/.-]+)\)", README):
        path = name[0] or name[1]
        assert (ROOT / path).exists(), path
