"""Calibration of a camera from pictures of a board: focal lengths, distortion, and where it stands."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from .arrays import FloatArray
from .camera import Camera
from .chessboard import Corners
from .errors import InputError
from .lens import Lens
from .motion import quaternion_of
from .optional import library

#: Fewer pictures leave the focal length open.
FEWEST = 3
#: No lens has a longer focal length [widths of the picture]; pictures that leave it open give such.
LONGEST = 50.0
#: A reprojection error above this is not that of a board held still [px].
WORST = 5.0


@dataclass(frozen=True, eq=False)
class Calibration:
    """A lens, its reprojection error over all corners [px, root mean square], and that of each picture ``(N,)``."""

    lens: Lens
    error: float
    each: FloatArray
    #: One standard deviation of fx, fy, cx and cy ``(4,)`` [px].
    spread: FloatArray


def calibrated(views: Sequence[Corners], width: int, height: int) -> Calibration:
    """Focal lengths, principal point and five coefficients of distortion, in the least-squares sense.

    Args:
        views: corners of the board in pictures of one camera, the board tilted in several ways.
        width, height: of the pictures [px].

    Raises:
        InputError: fewer than 3 views, or views that do not tell the focal length.

    References:
        Zhang (2000), A flexible new technique for camera calibration; OpenCV ``calibrateCamera``.
    """
    if len(views) < FEWEST:
        raise InputError(
            f"the board was found in {len(views)} picture(s), at least {FEWEST} are needed, better 10 to 20 with the "
            "board tilted in several ways and near every edge of the picture"
        )
    cv2 = library("cv2", "calibration", "perception")
    try:
        error, matrix, distortion, *_, spread, _, each = cv2.calibrateCameraExtended(
            [v.board.astype(np.float32) for v in views],
            [v.pixels.astype(np.float32) for v in views],
            (width, height),
            None,
            None,
        )
        fx, fy, cx, cy = (float(matrix[i]) for i in ((0, 0), (1, 1), (0, 2), (1, 2)))
        camera = Camera(width, height, fx, fy, cx, cy)
    except (cv2.error, InputError) as reason:
        raise InputError(f"{_UNTOLD} ({str(reason).splitlines()[0]})") from reason
    inside = 0 < cx < width and 0 < cy < height
    if not (np.isfinite(error) and inside and fx < LONGEST * width and np.reshape(spread, -1)[:2].max() < 0.2 * fx):
        raise InputError(_UNTOLD)
    lens = Lens(camera, np.asarray(distortion, float).reshape(-1))
    return Calibration(lens, float(error), np.reshape(each, -1), np.reshape(spread, -1)[:4])


_UNTOLD = (
    "these pictures do not tell the focal length; tilt the board by 20 to 50 degrees in several directions, flat ones "
    "all look alike"
)


def placed(lens: Lens, views: Sequence[Corners]) -> tuple[Lens, float]:
    """The lens with its pose in a world whose origin, x and y a board has that lies still, z up; and the error [px].

    Args:
        lens: calibrated.
        views: corners of the board in one or several pictures of it there.

    Raises:
        InputError: the board is not in one place, or it is seen from below.
    """
    cv2 = library("cv2", "calibration", "perception")
    board, pixels = np.concatenate([v.board for v in views]), np.concatenate([v.pixels for v in views])
    found, turn, shift = cv2.solvePnP(board, pixels, lens.matrix, lens.distortion)
    if not found:
        raise InputError("the pose of the camera cannot be told from the picture of the board; take another picture")
    back, _ = cv2.projectPoints(board, turn, shift, lens.matrix, lens.distortion)
    error = float(np.sqrt(np.mean(np.sum((back.reshape(-1, 2) - pixels) ** 2, axis=1))))
    if error > WORST:
        raise InputError(
            f"the board does not lie in one place in the {len(views)} picture(s) of --world: corners are {error:.1f} "
            "px off; give pictures of the board lying still, taken by the calibrated camera"
        )
    rotation = cv2.Rodrigues(turn)[0].T
    pose = np.concatenate([-rotation @ np.reshape(shift, -1), quaternion_of(rotation)])
    if pose[2] <= 0:
        raise InputError("the camera would be below the board; is the picture of --world mirrored?")
    return Lens(replace(lens.camera, pose=pose), lens.distortion), error
