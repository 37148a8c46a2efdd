"""Trained weights on disk: tensors as safetensors, which run no code when read, and a JSON description of them."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ..core.errors import InputError, MissingFileError

Arrays = dict[str, npt.NDArray[Any]]
_KEY = "muslin"


def save_weights(path: Path, extractor: str, arrays: Mapping[str, npt.NDArray[Any]], about: Mapping[str, Any]) -> None:
    """Write one ``.safetensors`` file.

    Args:
        path: of the file, replaced if it is there.
        extractor: name of what they belong to.
        arrays: by name.
        about: everything else that is needed to use them, as JSON has it.
    """
    from safetensors.numpy import save_file

    if not path.absolute().parent.is_dir():
        raise MissingFileError(f"there is no folder {path.absolute().parent} for {path.name}; make it first")
    text = json.dumps({"extractor": extractor, **about})
    partial = path.with_name(f".{path.name}.partial")
    try:
        save_file({k: np.ascontiguousarray(v) for k, v in arrays.items()}, partial, metadata={_KEY: text})
        partial.replace(path)
    finally:
        partial.unlink(missing_ok=True)


def load_weights(path: Path, extractor: str) -> tuple[Arrays, dict[str, Any]]:
    """The arrays and the description of a file of :func:`save_weights`.

    Raises:
        MissingFileError: there is none.
        InputError: it is damaged, or belongs to another extractor.
    """
    from safetensors import SafetensorError, safe_open

    if not path.is_file():
        raise MissingFileError(f"there is no file of weights {path}; make one with: muslin train {extractor}")
    try:
        with safe_open(path, framework="numpy") as file:
            about = json.loads((file.metadata() or {}).get(_KEY, "{}"))
            arrays = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118 - not a mapping
    except (SafetensorError, OSError, ValueError) as error:
        raise InputError(f"{path} cannot be read as weights: {error}; train the extractor again") from error
    owner = about.pop("extractor", None)
    if owner != extractor:
        raise InputError(f"{path} holds weights of {owner or 'another program'}, not of extractor {extractor!r}")
    return arrays, about
