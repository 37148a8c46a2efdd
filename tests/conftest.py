"""In which order tests run, and that they may take their time."""

from itertools import chain

import pytest
from hypothesis import settings

# what is slow on a machine with other work is no fault
settings.register_profile("muslin", deadline=None)
settings.load_profile("muslin")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Files with slow tests first, for two workers: a long test at the end would leave one of them without work.

    pytest-xdist gives each of two workers a half, from its beginning.
    """
    files: dict[str, list[pytest.Item]] = {}
    for item in items:
        files.setdefault(str(item.path), []).append(item)
    slow = [f for f in files.values() if any(i.get_closest_marker("slow") for i in f)]
    fast = [f for f in files.values() if f not in slow]
    one, other = slow[::2], slow[1::2]
    while fast and sum(map(len, one)) + len(fast[0]) <= len(items) // 2:
        one.append(fast.pop(0))
    items[:] = chain.from_iterable([*one, *other, *fast])
