"""How many threads a command takes."""

import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from muslin.cli import main


def test_a_command_takes_one_thread_of_linear_algebra(monkeypatch: pytest.MonkeyPatch) -> None:
    seen = []

    def app(**_: object) -> int:
        seen.extend(i["num_threads"] for i in threadpool_info() if i["user_api"] == "blas")
        return 0

    monkeypatch.setattr(main, "app", app)
    with threadpool_limits(2, user_api="blas"):
        before = threadpool_info()
        with pytest.raises(SystemExit):
            main.run(["plugins"])
        assert threadpool_info() == before
    assert set(seen) == {1}
