"""Shapes that objects start in where it is not the rest shape. All of them keep the length of every segment."""

from dataclasses import dataclass

import numpy as np

from ..arrays import FloatArray, IntArray
from ..body import Body
from ..errors import InputError
from ..interpolation import interpolate
from ..motion import rotate
from ..obstacles import Cylinder, Obstacle


@dataclass(frozen=True, eq=False)
class GivenShape:
    """A shape that is known beforehand, carried by the first gripper.

    Args:
        vertices: ``(V, 3)`` [m] in the frame of the first gripper at its first pose. Of a rope any number, at even
            distances along it.
        measure: length of the object at rest [m]; if it is scaled, so is the shape.
        about: the point of the same frame that scaling leaves where it is ``(3,)`` [m].
    """

    vertices: FloatArray
    measure: float
    about: FloatArray

    def __call__(
        self,
        body: Body,
        poses: FloatArray,
        grasps: tuple[IntArray, ...],
        obstacles: tuple[Obstacle, ...],
        clearance: float,
    ) -> FloatArray:
        scale = float(body.measures.sum()) / self.measure
        local = self.about + scale * (self.vertices - self.about)
        if len(local) != len(body.vertices):  # a rope, on another mesh
            wanted = np.linspace(0, len(local) - 1, len(body.vertices))
            local = interpolate(wanted, np.arange(float(len(local))), local)
        return np.asarray(rotate(poses[0, 3:], local) + poses[0, :3])


def sagging(
    body: Body, poses: FloatArray, grasps: tuple[IntArray, ...], obstacles: tuple[Obstacle, ...], clearance: float
) -> FloatArray:
    """A rope that hangs from the first gripper to the second, at rest under its weight but for bending.

    What of it is beyond a gripper hangs straight down.

    Raises:
        InputError: there is no second gripper.
    """
    if len(poses) < 2:
        raise InputError(
            "[scenario]: a rope that hangs between two grippers needs poses of both, but the recording has those of "
            f"{len(poses)}; a rope with one end free is scenario 'swing' or 'hang', or another that takes a rope"
        )
    count = len(body.vertices)
    link = float(body.measures.sum()) / (count - 1)
    first, last = 0, count - 1
    if len(grasps) > 1:
        rising = grasps[0].mean() <= grasps[1].mean()
        first, last = (int(g.min() if low else g.max()) for g, low in zip(grasps, (rising, not rising), strict=False))
    start = hanging_chain(poses[0, :3], poses[1, :3], abs(last - first) + 1, link)
    start = start if first <= last else start[::-1]
    before = min(first, last)
    after = count - before - len(start)
    return np.concatenate([_down(start[0], before, link)[::-1], start, _down(start[-1], after, link)])


def draped(
    body: Body, poses: FloatArray, grasps: tuple[IntArray, ...], obstacles: tuple[Obstacle, ...], clearance: float
) -> FloatArray:
    """A rope from the first gripper straight to a lying cylinder, over its top and down on the other side.

    That is the longer end of it; what is beyond the gripper hangs straight down.

    Raises:
        InputError: there is no such cylinder, or the gripper is in it or beside it.
    """
    spool = next((o for o in obstacles if isinstance(o, Cylinder)), None)
    if spool is None:
        raise InputError("[scenario.obstacles]: a rope that is wound needs a cylinder, but there is none")
    up = np.array([0.0, 0.0, 1.0]) - spool.direction[2] * spool.direction
    if np.linalg.norm(up) < 0.1:
        raise InputError(f"[scenario.obstacles]: a rope cannot hang over a cylinder that stands (axis {spool.axis})")
    up = up / np.linalg.norm(up)
    out = np.cross(spool.direction, up)
    apart = poses[0, :3] - spool.center
    out = out if apart @ out >= 0 else -out
    along, p, q = float(apart @ spool.direction), float(apart @ out), float(apart @ up)
    link = float(body.measures.mean())
    # the middles of the segments touch the cylinder, so the vertices are a little further out
    radius = float(np.hypot(spool.radius + clearance, link / 2))
    if np.hypot(p, q) <= radius or abs(along) > spool.length / 2:
        raise InputError(
            f"the first gripper starts at {np.round(poses[0, :3], 4).tolist()} m, in or beside the cylinder of radius "
            f"{spool.radius:g} m and length {spool.length:g} m at {np.round(spool.center, 4).tolist()} m, so no rope "
            "goes from it over the cylinder; check the obstacles and the gripper poses"
        )
    leaves = np.arctan2(q, p) + np.arccos(radius / np.hypot(p, q))
    angles = np.linspace(leaves, max(leaves, np.pi), 4000)
    flat = radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    flat = np.concatenate([[[p, q]], flat, [flat[-1] - [0.0, float(body.measures.sum())]]])
    curve = spool.center + along * spool.direction + flat[:, :1] * out + flat[:, 1:] * up
    count = len(body.vertices)
    backward = bool(grasps) and float(grasps[0].mean()) > (count - 1) / 2
    beyond = 0 if not grasps else int(count - 1 - grasps[0].max() if backward else grasps[0].min())
    over = chain_along(curve, count - beyond, link)
    start = np.concatenate([_down(over[0], beyond, link)[::-1], over])
    return start[::-1] if backward else start


def _down(point: FloatArray, count: int, link: float) -> FloatArray:
    """Vertices ``(count, 3)`` below ``point (3,)``, each ``link`` [m] from the last."""
    return np.asarray(point - link * np.outer(np.arange(1, count + 1), [0.0, 0.0, 1.0]))


def chain_along(curve: FloatArray, count: int, link: float) -> FloatArray:
    """Vertices ``(count, 3)`` on a finely sampled ``curve (P, 3)``, each ``link`` [m] from the last in a straight line.

    Beyond the end of the curve they go straight on.
    """
    last = curve[-1] - curve[-2]
    curve = np.concatenate([curve, [curve[-1] + last / np.linalg.norm(last) * link * (count + 1)]])
    out, at = [curve[0]], 0
    for _ in range(count - 1):
        here = out[-1]
        at += int(np.argmax(np.linalg.norm(curve[at + 1 :] - here, axis=1) >= link))
        a, b = curve[at] - here, curve[at + 1] - curve[at]
        # the root of |a + s b| = link in [0, 1], where the curve leaves the ball around the last vertex
        bb, ab, aa = float(b @ b), float(a @ b), float(a @ a)
        out.append(curve[at] + (-ab + np.sqrt(max(ab * ab - bb * (aa - link * link), 0.0))) / bb * b)
    return np.array(out)


def hanging_chain(a: FloatArray, b: FloatArray, count: int, link: float) -> FloatArray:
    """A chain of equal rigid links at rest between two points: the discrete catenary.

    Link i carries the tension (H, V + i), in weights of a link, and points along it. H and V follow from
    where the chain must end: they are the minimum of a convex function (the sum of all tensions less the
    work of the end), which Newton's method finds. Where the points are further apart than the chain is long
    it is straight and its links are longer than they should be; where they are above one another, it hangs as
    a loop one link wide.

    Args:
        a: first end ``(3,)`` [m].
        b: last end ``(3,)`` [m].
        count: vertices; one more than links.
        link: length of a link [m].

    Returns:
        ``(count, 3)`` [m].
    """
    links = count - 1
    apart = b - a
    wide = float(np.hypot(apart[0], apart[1]))
    level = apart[:2] / wide if wide > 1e-9 else np.array([1.0, 0.0])
    share = np.linspace(0.0, 1.0, count)[:, None]
    if np.linalg.norm(apart) >= links * link * (1 - 1e-6):
        return np.asarray(a + share * apart)
    end = np.array([max(wide, 1.05 * link), float(apart[2])]) / link
    end *= min(1.0, links * (1 - 1e-6) / float(np.linalg.norm(end)))
    weights = np.arange(links, dtype=np.float64)

    def tensions(x: FloatArray) -> FloatArray:
        return np.stack([np.full(links, x[0]), x[1] + weights], axis=1)

    def cost(x: FloatArray) -> float:
        return float(np.linalg.norm(tensions(x), axis=1).sum() - x @ end)

    x = np.array([max(0.3 * links, 1.0), -0.5 * (links - 1)])
    for _ in range(200):
        t = tensions(x)
        size = np.linalg.norm(t, axis=1, keepdims=True)
        toward = t / size
        slope = toward.sum(axis=0) - end
        if np.linalg.norm(slope) < 1e-12 * links:
            break
        bend = np.einsum("k,kij->ij", 1 / size[:, 0], np.eye(2) - toward[:, :, None] * toward[:, None, :])
        step = -np.linalg.solve(bend + 1e-14 * np.eye(2), slope)
        pace, here = 1.0, cost(x)
        while (x[0] + pace * step[0] <= 0 or cost(x + pace * step) > here + 1e-4 * pace * (slope @ step)) and (
            pace > 1e-12
        ):
            pace /= 2
        x = x + pace * step
    t = tensions(x)
    flat = link * np.concatenate([[[0.0, 0.0]], np.cumsum(t / np.linalg.norm(t, axis=1, keepdims=True), axis=0)])
    points = a + np.concatenate([flat[:, :1] * level, flat[:, 1:]], axis=1)
    return np.asarray(points + share * (b - points[-1]))
