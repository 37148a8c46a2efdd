"""Whether quaternions of a file are x y z w where w x y z is read: a point at a gripper tells, as it goes along."""

import numpy as np

from ..arrays import FloatArray
from ..dataset import note
from ..motion import Motion, inverse, rotate

#: A point is taken to be at a gripper if it stays where it is in its frame, to this share of how far it is from it.
_GOES_ALONG = 0.15
#: … and so many times better read the one way than the other.
_CLEARLY = 3.0


def doubt_order(time: FloatArray, points: FloatArray, gripper: Motion, where: str) -> None:
    """Say so with a warning if the nearest point to a gripper goes along with it only in the other order.

    Args:
        time: of the frames ``(T,)`` [s].
        points: ``(T, P, 3)`` [m], the same in all frames, in the axes of the file.
        gripper: poses in the same axes, read as w x y z.
        where: the file, for messages.
    """
    during = (time >= gripper.times[0]) & (time <= gripper.times[-1])
    if not during.any():
        return
    points = points[during]
    as_read = gripper.at(time[during])
    other = Motion(gripper.times, gripper.poses[..., [0, 1, 2, 6, 3, 4, 5]]).at(time[during])
    for g in range(gripper.grippers):
        away = np.linalg.norm(points - as_read[:, g, None, :3], axis=2)
        seen = np.isfinite(away).sum(axis=0) > len(away) // 2
        if not seen.any():
            continue
        nearest = int(np.argmin(np.where(seen, np.nanmean(np.where(seen, away, 0.0), axis=0), np.inf)))
        reach = float(np.nanmean(away[:, nearest]))
        read, turned = (_scatter(points[:, nearest], poses[:, g]) for poses in (as_read, other))
        if turned < _GOES_ALONG * reach and read > max(_CLEARLY * turned, _GOES_ALONG * reach):
            note(
                f"{where}: the quaternions of gripper {g} are read as w x y z, but look like x y z w: read so, point "
                f"{nearest}, the nearest to it, stays within {1e3 * turned:.2g} mm of one place in its frame, and "
                f"{1e3 * read:.2g} mm otherwise; reorder gripper_pose to x, y, z, w, qx, qy, qz if that is so"
            )
            return


def _scatter(points: FloatArray, poses: FloatArray) -> float:
    """How far a point ``(T, 3)`` is from the middle of its places in the frame of a gripper, root mean square [m]."""
    local = rotate(inverse(poses[:, 3:]), points - poses[:, :3])
    return float(np.sqrt(np.nanmean(np.sum((local - np.nanmean(local, axis=0)) ** 2, axis=1))))
