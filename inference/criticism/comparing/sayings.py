"""Groups of numbers and fractions in words."""

_WHERE = {
    "held still": "while it is held still",
    "slow": "while it moves slowly",
    "fast": "while it moves fast",
    "free flight": "in free flight",
    "in contact": "where it touches something",
    "free of contact": "away from contact",
    "free corners": "at the free corners",
    "held corners": "at the held corners",
    "free edge": "along the free edge",
    "held edge": "along the edge by the grasp",
    "middle": "in its middle",
    "ends": "at the ends",
    "faces": "on its faces",
    "inside": "inside it",
}
_FRACTIONS = (
    (0.95, "nearly all"), (0.86, "nine tenths"), (0.78, "four fifths"), (0.71, "three quarters"),
    (0.63, "two thirds"), (0.56, "three fifths"), (0.45, "half"), (0.36, "two fifths"), (0.29, "a third"),
    (0.0, "less than a third"),
)  # fmt: skip


def where(name: str) -> str:
    """A group as the end of a sentence: ``while it moves fast``."""
    return _WHERE.get(name, name)


def fraction(share: float) -> str:
    """A share as people say it: ``three quarters``."""
    return next(words for least, words in _FRACTIONS if share >= least)
