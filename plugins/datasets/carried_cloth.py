"""A square cloth whose top edge a robot carries through the air, tracked as a grid."""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...core.arrays import FloatArray
from ...core.dataset import about, archives, arrays, chosen, note, shaped
from ...core.errors import InputError
from ...core.importing.zeros import unseen_zeros
from ...core.interpolation import interpolate
from ...core.measurement import Recording
from ...core.motion import Motion, inverse, multiply, rotate
from ...core.series import PointSeries
from .carried_csv import exported, exported_takes, is_exported
from .carried_turns import carried_turns
from .grid_faults import lost_cloth
from .metres import check_metres

#: Orientation of the hand, w x y z, in which the cloth hangs in the x-z plane, its columns from low to high x.
HOME = np.array([0.0, 0.5**0.5, 0.5**0.5, 0.0])
#: Where the held edge of a cloth points that hangs so.
X = np.array([1.0, 0.0, 0.0])
#: Lags of the camera behind the gripper that are tried [s]: beyond what was found, both ways.
LAGS = np.arange(-0.6, 0.6001, 0.01)
#: Hand and cloth must correlate this much at some lag [1].
ALIKE = 0.8
#: An edge that leans more than this is worth a word [degrees].
LEANS = 1.0
#: Frames are stamped late if that leaves so much of what hand and edge are unlike in.
CLEARLY = 0.99
#: What goes no farther than this about its middle, root mean square, rests [m].
RESTS = 0.005


def read_carried_cloth(path: Path, takes: Sequence[str]) -> list[Recording]:
    """Takes of a session in a clone of the source, or from a folder of NPZ files, or one file of either.

    In a clone, the folder of a session holds what ROS exported to CSV (:mod:`.carried_csv`). NPZ files have
    ``mesh (T, n, n, 3)`` [m], ``t (T,)`` [s], and where the robot was recorded ``tcp (K, 7)`` and ``tcp_t (K,)``.

    Points are in the order of the vertices of a hanging cloth: row by row from the held top edge, which is the last
    index of axis 2 in the file, along x. The gripper is the middle of the top edge and turns with the hand: where it is
    in the hand and which way the edge points are medians over the recording, in which a constant offset and turn
    between camera and robot go, too. The camera's clock lags the robot's; the lag is the one at which the top edge
    moves most like the hand, and points are given on the robot's clock; where the hand rests, the lag is taken for 0.
    A tracker may stamp a frame as it is done with it, so that a frame that took long was seen long before its stamp:
    where the top edge moves more like the hand with the stamps of the frames before, those are taken.
    Without ``tcp`` the tracked top edge itself is the gripper. Frames in which the tracker lost the cloth
    (:mod:`.grid_faults`) are left out.

    Takes with names alike are not marked as repeats: the robot did not start them at one moment, nor on one path.

    References:
        Luque, Parent, Colomé, Ocampo-Martinez and Torras, *Model predictive control for dynamic cloth manipulation:
        parameter learning and experimental validation* (2022); github.com/Alados5/tfm_matlab.
    """
    files = exported_takes(path) or archives(path, ("mesh", "t"))
    made = []
    for name in chosen(takes, list(files), path):
        with about(files[name]):
            made.append(_recording(files[name], name))
    return made


def _recording(path: Path, name: str) -> Recording:
    data = exported(path) if is_exported(path) else arrays(path, ("mesh", "t"), ("tcp", "tcp_t"))
    mesh = shaped(data["mesh"], (None, None, None, 3), "mesh", path)
    time = shaped(data["t"], (len(mesh),), "t", path)
    if mesh.shape[1] != mesh.shape[2] or mesh.shape[1] < 2:
        raise InputError(f"{path}: mesh must be (T, n, n, 3) with n from 2 up, but is {mesh.shape}")
    check_metres(mesh, "the nodes of mesh", path)
    grid = np.where(np.isfinite(mesh), mesh, np.nan)[:, :, ::-1].transpose(0, 2, 1, 3)
    nodes = grid.reshape(len(grid), grid.shape[1] * grid.shape[2], 3)
    PointSeries(time, nodes)  # a clock that cannot be must not look as if hand and cloth were of two takes
    if (zeros := unseen_zeros(nodes, correspondence=True)).any():
        note(f"{name}: {int(zeros.sum())} nodes that jump to exactly 0, 0, 0 are taken as not seen")
        grid[zeros.reshape(grid.shape[:3])] = np.nan
    begun = _begun(time)
    lost = lost_cloth(grid)
    if lost.any():
        note(
            f"{name}: {int(lost.sum())} of {len(lost)} frames left out, in which the grid is too short to be the cloth"
        )
    time, begun, points = time[~lost], begun[~lost], grid[~lost].reshape(int(np.sum(~lost)), -1, 3)
    top = points[:, : mesh.shape[1]]
    whole = np.isfinite(top).all(axis=(1, 2))
    if whole.sum() < 10:
        raise InputError(f"{path}: the whole top edge is seen in {int(whole.sum())} frames; at least 10 are needed")
    middle = top[whole].mean(axis=1)
    if "tcp" not in data:
        note(f"{name}: no poses of the robot; the tracked top edge is taken for the gripper")
        turns = carried_turns(_along(top[whole]), X)
        motion = Motion(time[whole], np.concatenate([middle, turns], axis=1)[:, None])
        return Recording(name, PointSeries(time, points), motion)
    if "tcp_t" not in data:
        raise InputError(f"{path} has tcp but no tcp_t (K,), the times of its poses [s]; add it, or leave tcp out")
    hand = shaped(data["tcp"], (None, 7), "tcp", path)
    check_metres(hand[:, :3], "the positions of tcp", path)
    clock, hand = _rising(shaped(data["tcp_t"], (len(hand),), "tcp_t", path), hand, path)
    done = camera_lag(time[whole], middle, clock, hand[:, :3])
    if done is None:
        taken = time
        note(f"{name}: the hand rests, so how much the camera lags does not show; it is taken for 0 s")
    else:
        early = _lag_or_none(begun[whole], middle, clock, hand[:, :3])
        late = early is not None and 1 - early.alike < CLEARLY * (1 - done.alike)
        taken = begun - early.lag if early is not None and late else time - done.lag
        behind = f"{np.median(time - taken):.2f} s{', more after a pause' if late else ''}"
        note(f"{name}: the camera lags the robot by {behind}; points are on the robot's clock")
    turns = multiply(hand[:, [6, 3, 4, 5]], inverse(HOME))
    turns /= np.linalg.norm(turns, axis=1, keepdims=True)
    then = Motion(clock, np.concatenate([hand[:, :3], turns], axis=1)[:, None]).at(taken[whole])[:, 0]
    in_hand = inverse(then[:, 3:])
    held = np.median(rotate(in_hand, middle - then[:, :3]), axis=0)
    along = np.median(rotate(in_hand, _along(top[whole])), axis=0)
    leaning = carried_turns(along[None], X)[0]
    degrees = float(np.degrees(np.arctan2(np.linalg.norm(along[1:]), along[0])))
    if degrees > LEANS:
        note(f"{name}: the held edge leans by {degrees:.1f} degrees in the hand; the gripper is turned so, too")
    poses = np.concatenate([hand[:, :3] + rotate(turns, held), multiply(turns, leaning)], axis=1)
    return Recording(name, PointSeries(taken, points), Motion(clock, poses[:, None]))


def _begun(stamps: FloatArray) -> FloatArray:
    """When work on each frame began, if each is stamped as it is done and the next is begun: at the stamp before."""
    return np.concatenate([stamps[:1] - np.median(np.diff(stamps)), stamps[:-1]])


class Lag(NamedTuple):
    """How much later a camera stamps what a hand does.

    Args:
        lag: [s].
        alike: correlation of their displacements there [1].
    """

    lag: float
    alike: float


def camera_lag(seen: FloatArray, edge: FloatArray, clock: FloatArray, hand: FloatArray) -> Lag | None:
    """How much later the camera stamps what the hand does: where their displacements correlate most.

    None where both rest and nothing tells.

    Args:
        seen: ``(T,)`` [s], of the camera.
        edge: ``(T, 3)`` [m], what the hand carries.
        clock: ``(K,)`` [s], of the robot.
        hand: ``(K, 3)`` [m].

    Raises:
        InputError: at no lag that is tried do they move alike, so that hand and cloth are not of one take.
    """
    moved = edge - edge.mean(axis=0)
    if max(_spread(edge), _spread(hand)) < RESTS:
        return None
    score = np.empty(len(LAGS))
    for k, lag in enumerate(LAGS):
        then = interpolate(seen - lag, clock, hand)
        then = then - then.mean(axis=0)
        score[k] = np.sum(moved * then) / max(float(np.sqrt(np.sum(moved**2) * np.sum(then**2))), 1e-12)
    best = int(np.argmax(score))
    if not 0 < best < len(LAGS) - 1 or score[best] < ALIKE:
        raise InputError(
            f"the cloth does not move as the robot's hand does (correlation {score[best]:.2f} at best, at a lag of "
            f"{LAGS[best]:.2f} s of {LAGS[0]:.1f} to {LAGS[-1]:.1f} s); check that tcp and tcp_t are of this take, or "
            "leave them out, and the tracked top edge is the gripper"
        )
    below, at, above = score[best - 1 : best + 2]
    top = 0.5 * (below - above) / min(below - 2 * at + above, -1e-12)
    return Lag(float(LAGS[best] + (LAGS[1] - LAGS[0]) * top), float(at))


def _lag_or_none(seen: FloatArray, edge: FloatArray, clock: FloatArray, hand: FloatArray) -> Lag | None:
    """:func:`camera_lag` of stamps that need not be right."""
    try:
        return camera_lag(seen, edge, clock, hand)
    except InputError:
        return None


def _spread(path: FloatArray) -> float:
    """Root mean square distance of ``path (T, 3)`` from its middle [m]."""
    return float(np.sqrt(np.mean(np.sum((path - path.mean(axis=0)) ** 2, axis=1))))


def _along(top: FloatArray) -> FloatArray:
    """Direction of the top edge, unit vectors ``(T, 3)``: the slope of its nodes over their number."""
    share = np.arange(top.shape[1]) - (top.shape[1] - 1) / 2
    slope = np.einsum("p,tpx->tx", share, top)
    return np.asarray(slope / np.linalg.norm(slope, axis=1, keepdims=True))


def _rising(clock: FloatArray, poses: FloatArray, path: Path) -> tuple[FloatArray, FloatArray]:
    """Without messages that came twice or late, or hold no pose."""
    whole = np.isfinite(clock) & np.isfinite(poses).all(axis=1) & (np.linalg.norm(poses[:, 3:], axis=1) > 0)
    if whole.sum() < 2:
        raise InputError(f"{path}: tcp holds {int(whole.sum())} whole poses; at least 2 are needed, or no tcp at all")
    clock, poses = clock[whole], poses[whole]
    keep = np.concatenate([[True], clock[1:] > np.maximum.accumulate(clock)[:-1]])
    return clock[keep], poses[keep]
