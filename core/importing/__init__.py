"""Importers: files of other programs to recordings in metres or pixels, seconds, z up."""

from .dispatch import FORMATS, import_file, import_together
from .options import ImportOptions

__all__ = ["FORMATS", "ImportOptions", "import_file", "import_together"]
