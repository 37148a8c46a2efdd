"""Steps whose results cannot be written say so before they simulate anything."""

import resource
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

pytest.importorskip("scipy")
pytest.importorskip("torch")

from next_world import put_diagnosis, register, rope_study

from muslin.core.errors import StoreError
from muslin.core.registry import REGISTRY
from muslin.core.study import Study


@contextmanager
def no_room() -> Iterator[None]:
    """Files cannot grow, for whoever runs the tests."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (0, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


@pytest.mark.parametrize("step", ["compare", "diagnose", "next", "unknown", "calibrate"])
def test_what_cannot_be_written_is_told_before_the_work(
    step: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    register(monkeypatch)
    study = rope_study(tmp_path)
    put_diagnosis(study, "tied", ["linear-drag", "quadratic-drag"])
    before = sorted(tmp_path.rglob("*"))

    def simulated(study: Study, problem: object = None) -> None:
        raise AssertionError("work that would be lost")

    monkeypatch.setattr(Study, "pool", simulated)
    run = REGISTRY.get("step", step)
    with no_room(), pytest.raises(StoreError, match=r"cannot write .*study\.results\.zarr"):
        run(study)
    study.check_writable()
    assert sorted(tmp_path.rglob("*")) == before
