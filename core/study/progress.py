"""How a study tells how far it is."""

from collections.abc import Callable

#: ``(text, done, total)``: a line of progress; where the total is not known it is 0, and what is done are rollouts.
Progress = Callable[[str, int, int], None]


def silent(text: str, done: int, total: int) -> None:
    """The progress of a study that nobody watches."""


class Counted:
    """A progress that counts rollouts while a line with no total stands, so that a long search does not look stuck.

    Args:
        show: where lines go.
    """

    def __init__(self, show: Progress) -> None:
        self._show = show
        self._open, self._rollouts = "", 0

    def __call__(self, text: str, done: int, total: int) -> None:
        self._open, self._rollouts = "" if total else text, done
        self._show(text, done, total)

    def rollout(self, told_as: Callable[[int], int]) -> None:
        """One more has run, or a piece of one; so many count as ``told_as`` of them."""
        if self._open:
            self._rollouts += 1
            self._show(self._open, told_as(self._rollouts), 0)
