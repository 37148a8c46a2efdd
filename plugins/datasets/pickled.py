"""Arrays out of pickles, which may run any code when they are read otherwise."""

import pickle
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from ...core.errors import InputError


class _Forbidden(Exception):
    """A pickle asks for more than arrays."""


class _Arrays(pickle.Unpickler):
    """Knows what NumPy arrays are made of, and nothing else."""

    #: By their names in all versions of NumPy; where they are in this one it says itself.
    KNOWN: ClassVar[dict[str, Any]] = {
        "ndarray": np.ndarray,
        "dtype": np.dtype,
        "_reconstruct": np.zeros(1).__reduce__()[0],
        "scalar": np.float64(0.0).__reduce__()[0],
        "_frombuffer": np.zeros(1).__reduce_ex__(5)[0],
    }

    def find_class(self, module: str, name: str) -> Any:
        if module.split(".")[0] == "numpy" and name in self.KNOWN:
            return self.KNOWN[name]
        if (module, name) == ("_codecs", "encode"):  # bytes, in the oldest protocols
            return _old_bytes
        raise _Forbidden(f"{module}.{name}")


def pickled_array(path: Path) -> npt.NDArray[Any]:
    """The array in a pickle, or that of a list of arrays of one shape, of whatever type; nothing in the file is run.

    Raises:
        InputError: it holds something else, or is damaged.
    """
    try:
        with path.open("rb") as file:
            held = _Arrays(file).load()
        return np.asarray(held)
    except _Forbidden as error:
        raise InputError(
            f"{path} holds {error}, which is not read because it may run code; save it as NumPy arrays of numbers"
        ) from error
    except Exception as error:  # a damaged pickle fails in many ways, none of them the caller's to know
        raise InputError(
            f"{path} is not a pickle of arrays of one shape, or damaged ({type(error).__name__}); copy it again"
        ) from error


def _old_bytes(text: str, encoding: str) -> bytes:
    if encoding != "latin1":
        raise _Forbidden(f"text in {encoding}")
    return text.encode("latin1")
