"""One take as a reader found it, before units and axes are put right."""

from dataclasses import dataclass

from ..arrays import FloatArray


@dataclass(frozen=True, eq=False)
class RawGripper:
    """Gripper poses of a file.

    Args:
        times: ``(K,)`` [s].
        poses: ``(K, G, 3 or 7)``: position [unit of the points; m where those are pixels], then
            optionally the quaternion w x y z.
    """

    times: FloatArray
    poses: FloatArray


@dataclass(frozen=True, eq=False)
class RawTake:
    """A take in the file's own unit and axes.

    Args:
        time: ``(T,)`` [s].
        points: ``(T, P, 2 or 3)`` [unit]; NaN where a point was not seen.
        unit, correspondence, name, motion, load: what the file says, None if it says nothing.
        gripper: poses that the file holds, if any.
        labels: the name of every point; none where the file does not name them.
    """

    time: FloatArray
    points: FloatArray
    unit: str | None = None
    correspondence: bool | None = None
    name: str | None = None
    motion: str | None = None
    load: float | None = None
    gripper: RawGripper | None = None
    labels: tuple[str, ...] = ()
