"""Importers of videos: files, folders of pictures, LeRobot data sets and bags to takes in pictures."""

from .dispatch import import_video, is_video
from .options import VideoOptions

__all__ = ["VideoOptions", "import_video", "is_video"]
