"""Files that commands write."""

import json
from pathlib import Path

import pytest

pytest.importorskip("typer")

from muslin.cli.output import write_json


def test_json_has_no_nan_and_no_infinity(tmp_path: Path) -> None:
    path = tmp_path / "figures.json"
    write_json(path, {"a": float("nan"), "b": [1.5, float("-inf"), None], "c": ("é", {"d": 2})})

    def refuse(word: str) -> None:
        raise AssertionError(word)

    found = json.loads(path.read_text(encoding="utf-8"), parse_constant=refuse)
    assert found == {"a": None, "b": [1.5, None, None], "c": ["é", {"d": 2}]}
    assert [f.name for f in tmp_path.iterdir()] == ["figures.json"]
