"""Recordings that others published and that are not in the repository: where those lie who have them."""

import os
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
#: The folder that the environment variable MUSLIN_DATA names.
DATA = Path(os.environ.get("MUSLIN_DATA", ROOT / "data"))


def published(place: str) -> Path:
    """A file or folder in :data:`DATA`; skips the test that asks for it where it is not there."""
    import pytest

    path = DATA / place
    if not path.exists():
        pytest.skip(f"there is no {place} in {DATA}; set MUSLIN_DATA to the folder of the recordings")
    return path
