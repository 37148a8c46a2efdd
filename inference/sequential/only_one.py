"""One process at a time writes the results of a study."""

import contextlib
from collections.abc import Iterator
from pathlib import Path

from filelock import FileLock, Timeout

from ...core.errors import MuslinError
from ...core.store import storage_errors


@contextlib.contextmanager
def only_one(results: Path) -> Iterator[None]:
    """Hold the lock of a results store; the system lets go of it when the process ends, however it ends.

    Raises:
        MuslinError: another process holds it.
    """
    lock = FileLock(results.with_name(f".{results.name}.lock"))
    with storage_errors(results):
        try:
            lock.acquire(timeout=0)
        except Timeout as error:  # an OSError as well, but not one of the disk
            raise MuslinError(
                f"another fit is writing {results}; wait for it, or name other results in [study]"
            ) from error
    try:
        yield
    finally:
        lock.release()
