"""Whether the gripper poses of a recording last as long as its points."""

import numpy as np

from .measurement import Recording
from .motion import Motion
from .series import seconds

#: Poses that are missing for so many frames, or for no longer than they are apart, are just those to come.
_FRAMES = 3.0
#: A gripper that stays within this of where it is last seen, for so long before, stands still [s, m, rad].
_WHILE, _MOVED, _TURNED = 0.25, 1e-3, 0.01


def uncovered(recording: Recording) -> list[str]:
    """Remarks where a gripper is in motion as its poses begin or end, and points are measured before or after.

    Poses are held there. A robot that has come to rest may well have stopped to tell so; of that nothing is said.
    """
    time, gripper = recording.series.time, recording.gripper
    if gripper is None or len(gripper.times) < 2:
        return []
    first, last = float(gripper.times[0]), float(gripper.times[-1])
    few = max(_FRAMES * float(np.median(np.diff(time))), float(np.median(np.diff(gripper.times))))
    out = []
    if first - time[0] > few and _moves(gripper, first, first + _WHILE):
        out.append(
            f"the gripper poses begin at {seconds(first)} s, the points at {seconds(time[0])} s; the gripper is taken "
            f"to stand still until then; if it did not, import from --start {seconds(first)}"
        )
    if time[-1] - last > few and _moves(gripper, last, last - _WHILE):
        out.append(
            f"the gripper poses end at {seconds(last)} s, the points go on to {seconds(time[-1])} s; the gripper is "
            f"taken to stand still from there; if it did not, import up to --stop {seconds(last)}"
        )
    return out


def _moves(gripper: Motion, since: float, until: float) -> bool:
    """Whether a gripper is anywhere else between two times [s] than at the first, which may be the later one."""
    between = gripper.times[(gripper.times - since) * (gripper.times - until) < 0]
    poses = gripper.at(np.array([since, *between, until]))
    away = np.linalg.norm(poses[..., :3] - poses[0, :, :3], axis=2)
    cosine = np.abs(np.sum(poses[..., 3:] * poses[0, :, 3:], axis=2))
    return bool(away.max() > _MOVED or 2.0 * np.arccos(min(cosine.min(), 1.0)) > _TURNED)
