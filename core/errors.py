"""Errors that a user may see. Each says what was wrong, where, what would be right, and what to do next.

They inherit the built-in that fits, so that code which knows nothing of muslin can still catch them.
"""


class MuslinError(Exception):
    """Base of every error that muslin raises on purpose; the command line prints it and exits with 2."""


class InputError(MuslinError, ValueError):
    """A file, a table entry or an argument holds something that cannot be right."""


class MissingFileError(MuslinError, FileNotFoundError):
    """A file or folder that was named does not exist."""

    def __str__(self) -> str:  # FileNotFoundError would print only its errno pair
        return str(self.args[0]) if self.args else ""


class UnknownPluginError(MuslinError, LookupError):
    """No plugin of that name is installed."""


class BrokenPluginError(MuslinError, ImportError):
    """A plugin is installed but could not be loaded."""


class StoreError(MuslinError, OSError):
    """A Zarr store could not be read or written."""

    def __str__(self) -> str:
        return str(self.args[0]) if self.args else ""


class StepMissingError(MuslinError, RuntimeError):
    """A step was asked for before the step that it needs, such as compare before fit."""


class RolloutFailed(MuslinError, RuntimeError):
    """One simulated draw did not end well. Recorded with its reason; never ends a batch."""
