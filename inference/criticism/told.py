"""What a step of criticism found: JSON for machines, paragraphs for people."""

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, eq=False)
class Told:
    """Findings of a step.

    Args:
        result: plain values.
        paragraphs: the same for people.
    """

    result: dict[str, Any]
    paragraphs: tuple[str, ...]

    def to_json(self) -> dict[str, Any]:
        return self.result

    def text(self) -> str:
        return "\n".join(self.paragraphs)
