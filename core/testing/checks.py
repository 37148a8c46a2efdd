"""A check, and how checks are run."""

import pickle
import random
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Check:
    """One promise.

    Args:
        title: what is promised, as a short sentence.
        run: raises AssertionError with a sentence if it is broken.
    """

    title: str
    run: Callable[[], None]


def run_all(checks: Iterable[Check]) -> Iterator[tuple[str, str | None]]:
    """Title and complaint of every check, the complaint None where it passed; none stops the others."""
    for check in checks:
        try:
            check.run()
        except AssertionError as error:
            yield check.title, str(error) or "an assertion failed"
        except Exception as error:
            yield check.title, f"{type(error).__name__}: {error}"
        else:
            yield check.title, None


def raise_failures(what: str, checks: Iterable[Check]) -> None:
    """Run every check.

    Raises:
        AssertionError: one or more failed; the message lists them.
    """
    failures = [f"  {title}: {error}" for title, error in run_all(checks) if error is not None]
    if failures:
        raise AssertionError(f"{what} breaks {len(failures)} promise(s):\n" + "\n".join(failures))


def must(condition: object, complaint: str) -> None:
    """Assert that also holds under ``python -O``."""
    if not condition:
        raise AssertionError(complaint)


def must_raise(error: type[Exception], call: Callable[[], object], complaint: str) -> None:
    """``call`` must raise ``error``; any other exception passes through."""
    try:
        call()
    except error:
        return
    raise AssertionError(complaint)


def check_pickles(thing: Any, what: str) -> Any:
    """``thing`` after a round trip through pickle, as it travels to worker processes."""
    try:
        return pickle.loads(pickle.dumps(thing))
    except Exception as error:
        raise AssertionError(
            f"{what} cannot be pickled, so it cannot travel to worker processes ({type(error).__name__}: {error}); "
            "define its class at the top of a module and keep engine objects out of it"
        ) from error


def check_leaves_random_state(call: Callable[[], object]) -> None:
    """``call`` must leave the global random generators of Python and NumPy alone."""
    python, legacy = random.getstate(), pickle.dumps(np.random.get_state())  # noqa: NPY002 - the global one is meant
    call()
    must(random.getstate() == python, "it draws from Python's global random generator; use a seed of its own")
    same = pickle.dumps(np.random.get_state()) == legacy  # noqa: NPY002
    must(same, "it draws from NumPy's global random generator; use numpy.random.default_rng(seed)")
