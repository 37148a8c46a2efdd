"""Contact with curved obstacles, at the level of velocities."""

from collections.abc import Callable
from functools import cache
from typing import NamedTuple

import numpy as np

from ...core.arrays import BoolArray, FloatArray, IntArray
from ...core.obstacles import Cylinder, Obstacle, StaticMesh, Table
from .compiled import compiled

#: A vertex this near, besides its own radius, is looked at [m].
_WATCH = 0.005
#: Distances to a surface are taken anew when a vertex has moved so far [m]; between, the surface is flat.
_FLAT = 0.0003
#: Share of a penetration that is taken back in a substep.
_RECOVERY = 0.2


class Surfaces(NamedTuple):
    """Cylinders and meshes, and what every vertex knows about the surface beside it.

    Args:
        friction: Coulomb coefficients ``(O,)``.
        radius: how far vertices stay away [m].
        bounds: low and high corner of where vertices are looked at ``(O, 2, 3)`` [m].
        cylinders: centre, direction, radius and half length ``(O, 8)``.
        first: obstacle o has the triangles ``first[o]`` to ``first[o + 1]`` ``(O + 1,)``; none: it is a cylinder.
        triangles: corners ``(F, 3, 3)`` [m].
        places: where vertices were when distances were taken ``(O, V, 3)`` [m].
        planes: there, the outward normal and the distance ``(O, V, 4)``.
    """

    friction: FloatArray
    radius: float
    bounds: FloatArray
    cylinders: FloatArray
    first: IntArray
    triangles: FloatArray
    places: FloatArray
    planes: FloatArray


def surfaces(obstacles: tuple[Obstacle, ...], friction: float, radius: float, count: int) -> Surfaces:
    """Of all obstacles but tables, for ``count`` vertices that stay ``radius`` [m] away."""
    curved = [o for o in obstacles if not isinstance(o, Table)]
    cylinders, bounds, first, triangles = np.zeros((len(curved), 8)), [], [0], [np.zeros((0, 3, 3))]
    for k, obstacle in enumerate(curved):
        if isinstance(obstacle, Cylinder):
            axis = obstacle.direction
            cylinders[k] = [*obstacle.center, *axis, obstacle.radius, obstacle.length / 2]
            across = np.sqrt(np.maximum(1.0 - axis**2, 0.0))
            reach = np.abs(axis) * obstacle.length / 2 + obstacle.radius * across
            bounds.append([obstacle.center - reach, obstacle.center + reach])
        else:
            assert isinstance(obstacle, StaticMesh)
            triangles.append(obstacle.vertices[obstacle.triangles])
            bounds.append([obstacle.vertices.min(axis=0), obstacle.vertices.max(axis=0)])
        first.append(sum(map(len, triangles)))
    margin = np.array([[-1.0], [1.0]]) * (radius + _WATCH)
    return Surfaces(
        friction * np.array([o.friction for o in curved], np.float64),
        float(radius),
        np.ascontiguousarray(np.reshape(np.array(bounds, np.float64), (-1, 2, 3)) + margin),
        cylinders,
        np.array(first, np.int64),
        np.ascontiguousarray(np.concatenate(triangles), np.float64),
        np.full((len(curved), count, 3), np.inf),
        np.zeros((len(curved), count, 4)),
    )


@cache
def contact() -> Callable[..., None]:
    """:func:`touch`, compiled."""
    mesh = compiled(
        mesh_plane, "surface", nearest=compiled(nearest, "surface"), solid_angle=compiled(solid_angle, "surface")
    )
    return compiled(touch, "surface", cylinder_plane=compiled(cylinder_plane, "surface"), mesh_plane=mesh)


def touch(surfaces: Surfaces, free: BoolArray, time: float, x: FloatArray, v: FloatArray, shift: FloatArray) -> None:
    r"""Change velocities ``v (V, 3)`` [m/s] so that no vertex ends the substep inside.

    A vertex that would is given the normal velocity that ends it on the surface,
    and Coulomb's law takes away of its tangential velocity what the friction of that push can:
    :math:`\Delta v_t = -\min(\mu\, \Delta v_n, |v_t|)\, v_t / |v_t|`. The obstacle does not move, so masses do not
    matter. Penetration that is there already is taken back slowly and without velocity, by adding to ``shift (V, 3)``.

    Bullet's own contact is not used for these: it keeps vertices off a cylinder by a share of the radius and pushes
    them sideways, and of a mesh that is not convex it makes triangles 0.12 m thick.
    """
    moved, sliding = np.empty(3), np.empty(3)
    for o in range(len(surfaces.friction)):
        low, high = surfaces.bounds[o, 0], surfaces.bounds[o, 1]
        for i in range(len(x)):
            near = free[i]
            for k in range(3):
                moved[k] = x[i, k] + time * v[i, k]
                near = near and low[k] < moved[k] < high[k]
            if not near:
                continue
            place, plane = surfaces.places[o, i], surfaces.planes[o, i]
            apart = 0.0
            for k in range(3):
                apart += (moved[k] - place[k]) ** 2
            if not apart < _FLAT**2:
                place[:] = moved
                if surfaces.first[o + 1] > surfaces.first[o]:
                    mesh_plane(surfaces.triangles[surfaces.first[o] : surfaces.first[o + 1]], moved, plane)
                else:
                    cylinder_plane(surfaces.cylinders[o], moved, plane)
            after, speed = plane[3] - surfaces.radius, 0.0
            for k in range(3):
                after += plane[k] * (moved[k] - place[k])
                speed += plane[k] * v[i, k]
            if not after < 0:
                continue
            before, rate = after - time * speed, 0.0
            push = max(min(0.0, -before / time) - speed, 0.0)
            for k in range(3):
                sliding[k] = v[i, k] - speed * plane[k]
                rate += sliding[k] * sliding[k]
            rate = np.sqrt(rate)
            brake = min(surfaces.friction[o] * push, rate) / rate if rate > 0 else 0.0
            for k in range(3):
                v[i, k] += push * plane[k] - brake * sliding[k]
                shift[i, k] += _RECOVERY * max(-before, 0.0) * plane[k]


def cylinder_plane(cylinder: FloatArray, point: FloatArray, plane: FloatArray) -> None:
    """Outward normal and signed distance ``plane (4,)`` of ``point (3,)``, as :class:`Cylinder` says."""
    along, radial = 0.0, 0.0
    for k in range(3):
        along += (point[k] - cylinder[k]) * cylinder[3 + k]
    for k in range(3):
        plane[k] = point[k] - cylinder[k] - along * cylinder[3 + k]
        radial += plane[k] * plane[k]
    radial = np.sqrt(radial)
    wall, cap = radial - cylinder[6], abs(along) - cylinder[7]
    beyond = np.hypot(max(wall, 0.0), max(cap, 0.0))
    outward, end = (1.0, 0.0) if wall > cap else (0.0, 1.0)
    if beyond > 0:
        outward, end = max(wall, 0.0) / beyond, max(cap, 0.0) / beyond
    if radial > 0:
        outward /= radial
    for k in range(3):
        plane[k] = outward * plane[k] + end * np.sign(along) * cylinder[3 + k]
    plane[3] = beyond + min(max(wall, cap), 0.0)


def mesh_plane(triangles: FloatArray, point: FloatArray, plane: FloatArray) -> None:
    """The same for a closed mesh ``(F, 3, 3)``: inside is where solid angles add up to more than 2 pi."""
    best, angle = np.inf, 0.0
    found, offset = np.empty(3), np.empty(3)
    for t in range(len(triangles)):
        square = nearest(triangles[t], point, offset)
        if square < best:
            best = square
            found[:] = offset
        angle += solid_angle(triangles[t], point)
    distance = np.sqrt(best) if angle <= 2.0 * np.pi else -np.sqrt(best)
    for k in range(3):
        plane[k] = found[k] / distance if distance != 0 else 0.0
    plane[3] = distance


def nearest(triangle: FloatArray, point: FloatArray, offset: FloatArray) -> float:
    """Square of the distance of ``point (3,)``; ``offset (3,)`` is set to the way from the nearest point to it."""
    a, ab, ac = triangle[0], triangle[1] - triangle[0], triangle[2] - triangle[0]
    g11 = g12 = g22 = d1 = d2 = 0.0
    for k in range(3):
        g11 += ab[k] * ab[k]
        g12 += ab[k] * ac[k]
        g22 += ac[k] * ac[k]
        d1 += ab[k] * (point[k] - a[k])
        d2 += ac[k] * (point[k] - a[k])
    det = max(g11 * g22 - g12 * g12, 1e-300)
    u, w = (g22 * d1 - g12 * d2) / det, (g11 * d2 - g12 * d1) / det
    best = 0.0
    if u >= 0 and w >= 0 and u + w <= 1:
        for k in range(3):
            offset[k] = point[k] - a[k] - u * ab[k] - w * ac[k]
            best += offset[k] * offset[k]
        return best
    best = np.inf
    for side in range(3):
        start, end = triangle[side], triangle[(side + 1) % 3]
        dot = length = square = 0.0
        for k in range(3):
            dot += (point[k] - start[k]) * (end[k] - start[k])
            length += (end[k] - start[k]) ** 2
        share = min(max(dot / max(length, 1e-300), 0.0), 1.0)
        for k in range(3):
            square += (point[k] - start[k] - share * (end[k] - start[k])) ** 2
        if square < best:
            best = square
            for k in range(3):
                offset[k] = point[k] - start[k] - share * (end[k] - start[k])
    return best


def solid_angle(triangle: FloatArray, point: FloatArray) -> float:
    """Under which ``triangle (3, 3)`` is seen from ``point (3,)``, negative from its outside (Van Oosterom 1983)."""
    a, b, c = triangle[0] - point, triangle[1] - point, triangle[2] - point
    la, lb, lc = np.sqrt(np.sum(a * a)), np.sqrt(np.sum(b * b)), np.sqrt(np.sum(c * c))
    above = a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0])
    below = la * lb * lc + np.sum(a * b) * lc + np.sum(b * c) * la + np.sum(c * a) * lb
    return float(2.0 * np.arctan2(above, below))
