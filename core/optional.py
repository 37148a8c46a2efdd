"""Libraries that an extra brings, loaded when something needs them."""

import importlib
from typing import Any

from .errors import BrokenPluginError


def library(module: str, purpose: str, extra: str) -> Any:
    """A module of a library that need not be installed.

    Args:
        module: its name, as ``"cv2"``.
        purpose: what needs it, the start of the message.
        extra: of muslin, that brings it.

    Raises:
        BrokenPluginError: it cannot be loaded; the message says what to install.
    """
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise BrokenPluginError(
            f"{purpose} need the library {module.split('.')[0]}, which cannot be loaded ({error}); install it with: "
            f"pip install 'muslin[{extra}]'"
        ) from error
