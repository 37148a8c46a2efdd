"""Plain functions over arrays made machine code by numba, and kept on disk for the next process."""

import hashlib
import importlib
from collections.abc import Callable
from functools import cache
from pathlib import Path
from types import FunctionType
from typing import Any, TypeVar, cast

from ...core.errors import BrokenPluginError

_F = TypeVar("_F", bound=Callable[..., Any])


@cache
def _numba() -> Any:
    """The package numba, imported only where a world is opened.

    Raises:
        BrokenPluginError: it is not installed.
    """
    try:
        return importlib.import_module("numba")
    except ImportError as problem:
        raise BrokenPluginError(
            f"simulator 'pybullet' needs the package numba, which cannot be imported ({problem}); install it with "
            "`pip install muslin[pybullet]`"
        ) from problem


@cache
def _version() -> str:
    """Of every source file here, and of the processor."""
    binding = importlib.import_module("llvmlite.binding")
    digest = hashlib.sha256(binding.get_host_cpu_name().encode())
    for path in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:12]


def compiled(function: _F, kind: str, **parts: Callable[..., Any]) -> _F:
    """``function`` as machine code, with ``parts`` in place of the globals of those names.

    One function can so be compiled for bodies of every kind. Always call the result with the same types: its name,
    and so its file in numba's cache, has ``kind`` and a hash of all sources here in it and holds one version only.
    Numba itself would not see a change in another file than the function's own, and two processes that write
    different versions to one file can mix them up. Arithmetic is done as written, in that order (no
    ``fastmath``), so that results repeat bit for bit.

    Args:
        function: over arrays, numbers and named tuples of them.
        kind: of what it is compiled for.
        parts: compiled functions that it calls.
    """
    numba = _numba()
    plain = FunctionType(function.__code__, {**function.__globals__, **parts}, function.__name__)
    plain.__qualname__ = f"{function.__name__}_{kind}_{_version()}"
    try:
        return cast(_F, numba.njit(plain, cache=True))
    except RuntimeError:  # no folder to write to: compiled anew in every process
        return cast(_F, numba.njit(plain))
