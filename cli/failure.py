"""What a person is told when a command fails: one line, and the exit status."""

import errno
from collections.abc import Iterator

from ..core.errors import MuslinError

#: Something that the person gave, or a limit of the machine; as for usage errors.
BAD_INPUT = 2
#: A fault of muslin or of a plugin.
INTERNAL = 70
INTERRUPTED = 130


def describe(error: BaseException) -> tuple[str, int]:
    """The message, without prefix, and the exit status."""
    for cause in _causes(error):
        if isinstance(cause, MuslinError):
            return str(cause), BAD_INPUT
    if isinstance(error, OSError):
        return _operating_system(error), BAD_INPUT
    if isinstance(error, MemoryError):
        return "not enough memory; use fewer --workers, fewer points or a coarser mesh", BAD_INPUT
    text = str(error).splitlines()
    what = f"{type(error).__name__}: {text[0]}" if text else type(error).__name__
    return f"unexpected {what} (a fault of muslin or of a plugin; --debug shows where)", INTERNAL


def usage_text(error: BaseException) -> str | None:
    """The message of a usage error of the command-line parser, None for any other error."""
    tell = getattr(error, "format_message", None)
    if tell is None:
        return None
    context = getattr(error, "ctx", None)
    command = getattr(context, "command_path", None) or "muslin"
    return f"{str(tell()).rstrip('.')}. See: {command} --help"


def _causes(error: BaseException) -> Iterator[BaseException]:
    seen: list[BaseException] = []
    while error not in seen:
        yield error
        seen.append(error)
        if error.__cause__ is None:
            return
        error = error.__cause__


def _operating_system(error: OSError) -> str:
    place = f" ({error.filename})" if error.filename else ""
    if error.errno in (errno.ENOSPC, errno.EDQUOT):
        return f"the disk is full{place}; free some space and run the same command again"
    return f"{error.strerror or error}{place}"
