"""How many threads a command or a step takes."""

from pathlib import Path

import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from muslin.cli import main
from muslin.core.registry import REGISTRY
from muslin.core.study import Study


def blas_threads() -> set[int]:
    return {i["num_threads"] for i in threadpool_info() if i["user_api"] == "blas"}


def test_a_command_takes_one_thread_of_linear_algebra(monkeypatch: pytest.MonkeyPatch) -> None:
    seen: set[int] = set()

    def app(**_: object) -> int:
        seen.update(blas_threads())
        return 0

    monkeypatch.setattr(main, "app", app)
    with threadpool_limits(2, user_api="blas"):
        before = threadpool_info()
        with pytest.raises(SystemExit):
            main.run(["plugins"])
        assert threadpool_info() == before
    assert seen == {1}


def test_a_study_is_loaded_by_one_thread_of_linear_algebra(study: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("muslin.core.study.study.build_problem", lambda *_: blas_threads())
    with threadpool_limits(2, user_api="blas"):
        assert Study.load(study).problem == {1}


def test_a_step_takes_one_thread_of_linear_algebra(study: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(REGISTRY._objects, ("step", "fit"), lambda study: blas_threads())
    with threadpool_limits(2, user_api="blas"):
        assert blas_threads() == {2}
        assert Study.load(study).fit() == {1}
        assert blas_threads() == {2}
