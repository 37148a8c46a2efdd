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


@pytest.mark.parametrize("command", sorted(set(re.findall(r"muslin (import|[a-z]+) ", README)) & {
    "import", "new", "fit", "compare", "diagnose", "add", "report", "plugins", "check"}))  # fmt: skip
def test_the_commands_of_the_readme_exist(command: str) -> None:
    done = subprocess.run([sys.executable, "-m", "muslin.cli", command, "--help"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_every_file_that_the_readme_names_is_there() -> None:
    for name in re.findall(r"`((?:examples|docs|results|tests)/[\w/.-]+)`|\]\(([\w/.-]+)\)", README):
        path = name[0] or name[1]
        assert (ROOT / path).exists(), path
