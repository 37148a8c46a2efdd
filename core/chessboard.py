"""Boards of squares that calibrate cameras: chessboard and ChArUco, found by OpenCV."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from .arrays import FloatArray
from .errors import InputError
from .optional import library
from .picture import Image

#: Fewer corners of a ChArUco board do not tell where it is.
_FEWEST = 6


@dataclass(frozen=True, eq=False)
class Corners:
    """Corners of a board in one picture: on the board ``(N, 3)`` [m], x and y along it, z up; and ``(N, 2)`` [px]."""

    board: FloatArray
    pixels: FloatArray


@dataclass(frozen=True)
class Board:
    """A board.

    Args:
        columns, rows: inner corners of a chessboard; squares of a ChArUco board.
        square: edge of a square [m].
        dictionary: of the markers of a ChArUco board, as ``"DICT_5X5_100"``; empty for a chessboard.
        marker: edge of a marker [m].

    References:
        OpenCV, ``findChessboardCornersSB`` (Duda and Frese 2018) and ``CharucoDetector``.
    """

    columns: int
    rows: int
    square: float
    dictionary: str = ""
    marker: float = 0.0

    def __post_init__(self) -> None:
        if not (3 <= self.columns <= 100 and 3 <= self.rows <= 100):
            raise InputError(f"a board needs 3 to 100 columns and rows, but --board is {self.columns}x{self.rows}")
        if not 0 < self.square < 10:
            raise InputError(
                f"--square must be the edge of a square in m, above 0 and below 10, but is {self.square:g}"
            )
        if self.dictionary and not 0 < self.marker < self.square:
            raise InputError(
                f"--marker must be the edge of a marker in m, above 0 and below --square {self.square:g}, but is "
                f"{self.marker:g}"
            )

    def find(self, picture: Image) -> Corners | None:
        """Its corners in ``picture (H, W, 3)``; None where it is not seen (a chessboard: not seen whole)."""
        cv2 = library("cv2", "boards", "perception")
        grey = cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY)
        return self._charuco(cv2, grey) if self.dictionary else self._chessboard(cv2, grey)

    def _chessboard(self, cv2: Any, grey: Any) -> Corners | None:
        flags = cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_EXHAUSTIVE | cv2.CALIB_CB_ACCURACY
        found, pixels = cv2.findChessboardCornersSB(grey, (self.columns, self.rows), flags)
        if not found:
            return None
        row, column = np.divmod(np.arange(self.columns * self.rows), self.columns)
        return Corners(_upwards(np.stack([column, row], axis=1) * self.square), _pixels(pixels))

    def _charuco(self, cv2: Any, grey: Any) -> Corners | None:
        kind = getattr(cv2.aruco, self.dictionary, None) if self.dictionary.startswith("DICT_") else None
        if kind is None:
            known = ", ".join(n for n in dir(cv2.aruco) if n.startswith("DICT_"))
            raise InputError(f"there is no dictionary {self.dictionary!r}; OpenCV has {known}")
        markers = cv2.aruco.getPredefinedDictionary(kind)
        board = cv2.aruco.CharucoBoard((self.columns, self.rows), self.square, self.marker, markers)
        pixels, ids, _, _ = cv2.aruco.CharucoDetector(board).detectBoard(grey)
        if ids is None or len(ids) < _FEWEST:
            return None
        places = np.asarray(board.getChessboardCorners(), float)[np.asarray(ids).reshape(-1)]
        return Corners(_upwards(places[:, :2]), _pixels(pixels))


def _upwards(plane: FloatArray) -> FloatArray:
    """Places on the board ``(N, 3)``: OpenCV counts rows downwards, then z would point into the table."""
    return np.stack([plane[:, 0], -plane[:, 1], np.zeros(len(plane))], axis=1)


def _pixels(found: Any) -> FloatArray:
    return np.asarray(found, float).reshape(-1, 2)
