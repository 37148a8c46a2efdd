"""``python -m muslin.cli``, the same as ``muslin``."""

from .main import run

if __name__ == "__main__":
    run()
