"""Boards as a known camera, distorted or not, sees them."""

from functools import lru_cache

import cv2
import numpy as np

from muslin.core.camera import Camera
from muslin.core.chessboard import Board
from muslin.core.lens import Lens
from muslin.core.motion import multiply, rotate
from muslin.core.picture import Image

CAMERA = Camera(320, 240, 310.0, 314.0, 163.0, 117.0)
DISTORTIONS = {"plain": np.zeros(5), "barrel": np.array([-0.25, 0.06, 0.001, -0.002, 0.0])}
CHESS = Board(7, 5, 0.03)
CHARUCO = Board(8, 6, 0.03, "DICT_4X4_50", 0.022)
_DOTS = 20  # pixels of the drawn board a square


def drawn(board: Board) -> tuple[Image, np.ndarray]:
    """The board from above with a white edge, and the matrix from places on it [m, y up] to its pixels."""
    per = _DOTS / board.square
    edge = 2.0 * _DOTS
    if board.dictionary:
        markers = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, board.dictionary))
        made = cv2.aruco.CharucoBoard((board.columns, board.rows), board.square, board.marker, markers)
        size = (board.columns * _DOTS, board.rows * _DOTS)
        picture, first = made.generateImage(size, marginSize=0), 0.0
    else:
        row, column = np.mgrid[: (board.rows + 1) * _DOTS, : (board.columns + 1) * _DOTS] // _DOTS
        picture, first = (255 * ((row + column) % 2)).astype(np.uint8), float(_DOTS)
    framed = cv2.copyMakeBorder(picture, *[int(edge)] * 4, cv2.BORDER_CONSTANT, value=255)
    return framed, np.array([[per, 0, edge + first - 0.5], [0, -per, edge + first - 0.5], [0, 0, 1.0]])


@lru_cache
def local_rays(distortion: tuple[float, ...], fine: int) -> np.ndarray:
    """Directions through the samples of every pixel, in the camera's frame."""
    steps = (np.arange(fine) + 0.5) / fine - 0.5
    u = (np.arange(CAMERA.width)[:, None] + steps).ravel()
    v = (np.arange(CAMERA.height)[:, None] + steps).ravel()
    pixels = Lens(CAMERA, np.array(distortion)).undistorted_points(np.stack(np.meshgrid(u, v), axis=-1))
    local = (pixels - [CAMERA.cx, CAMERA.cy]) / [CAMERA.fx, CAMERA.fy]
    return np.concatenate([local, np.ones((*local.shape[:2], 1))], axis=2)


def seen(board: Board, lens: Lens, pose: np.ndarray) -> Image:
    """What a camera at ``pose`` sees of the board in the plane z = 0: rays through its pixels, undistorted."""
    picture, to_dots = drawn(board)
    c = Camera(320, 240, CAMERA.fx, CAMERA.fy, CAMERA.cx, CAMERA.cy, pose)
    fine = 2  # samples a pixel and axis, as a sensor averages
    rays = rotate(pose[3:], local_rays(tuple(lens.distortion), fine))
    places = pose[:2] + rays[..., :2] * (-pose[2] / rays[..., 2:])
    dots = (places @ to_dots[:2, :2].T + to_dots[:2, 2]).astype(np.float32)
    big = cv2.remap(
        picture, dots[..., 0], dots[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=200
    )
    small = big.reshape(c.height, fine, c.width, fine).mean(axis=(1, 3))
    return np.repeat(np.round(small).astype(np.uint8)[..., None], 3, axis=2)


def poses(count: int = 9) -> list[np.ndarray]:
    """Views from all sides and tilts, the camera turned about its axis, too: upright ones leave cy open."""
    rng = np.random.default_rng(3)
    middle = np.array([0.09, -0.06, 0.0])
    made = []
    for k in range(count):
        side = (0.1 + 0.05 * (k % 4)) * np.array([np.cos(2.4 * k), np.sin(2.4 * k)])
        target = middle + np.append(rng.uniform(-0.03, 0.03, 2), 0.0)
        pose = Camera.look_at(middle + np.array([*side, 0.28 - 0.02 * (k % 4)]), target).pose
        roll = np.pi / 2 * (k % 3)
        turn = multiply(pose[3:], np.array([np.cos(roll / 2), 0.0, 0.0, np.sin(roll / 2)]))
        made.append(np.concatenate([pose[:3], turn]))
    return made
