"""Rope: what MuJoCo's arrays must hold so that a discrete elastic rod is the rope that was asked for.

MuJoCo's rods bend and twist but do not stretch. The stretch is that of a second flex on the same vertices: a
triangle for every segment, from its two ends to one common fixed point, of which only the edge along the
segment is elastic. So it has the implicit treatment, the geometric stiffness and the damping of a membrane.
"""

import numpy as np

from ...core.arrays import FloatArray, IntArray, cross, dot
from ...core.bending import RopeBending, rope_rigidities
from ...core.body import Body
from ...core.clamps import clamped_segments
from ...core.material import RopeMaterial
from ...core.scenario import STANDARD_GRAVITY

#: Stiffnesses of exactly zero make MuJoCo's compiler leave parts out.
_SMALLEST = 1e-12
#: A rope that turns by less at rest is straight [rad].
_STRAIGHT = 1e-6
#: A segment lies as at rest if the cosine of its turn is that near one.
_UNMOVED = 1e-12
#: How much twist there is to reckon with in limp ropes, as a part of the bending rigidity.
_LIMP = 0.2
#: How much the coupling grows by a damping time of one step.
_BY_DAMPING = 0.3
#: How far back it is of use to look, and the share of how far back a rope can look without shaking that it does.
_FURTHEST_BACK, _OF_THE_WAY_BACK = 1.0 / 3.0, 0.7
#: How stretch is damped that cannot be seen, as a part of what is critical.
_STRETCH_DAMPING = 0.1
#: Share of its length that a rope must stretch by under its own weight for the way in which it does so to be seen.
_SEEN_STRETCH = 0.01


def stretch_forms(body: Body, material: RopeMaterial) -> FloatArray:
    """``mjModel.flex_stiffness`` of every triangle ``(E, 21)``, of which the first edge is the segment.

    MuJoCo's energy is M e^2 / 4 with e = L^2 - l^2; the Saint Venant-Kirchhoff rod E A l G^2 / 2 with Green's
    strain G = e / (2 l^2) asks for M = E A / (2 l^3).
    """
    out = np.zeros((len(body.elements), 21))
    out[:, 0] = material.stretch_stiffness / (2.0 * body.measures**3)
    return out


def hinge_stiffnesses(body: Body, material: RopeMaterial, held: IntArray) -> tuple[FloatArray, FloatArray]:
    """Bending and torsional stiffness ``(V - 2,)`` [N m] of every inner vertex, between segments of lengths a and b.

    MuJoCo's energies are k |curvature binormal|^2 and k_t twist^2 with k = E I / (a + b) and k_t = G J / (a + b): the
    stiffness of the rod from one segment's middle to the other's. A segment whose two ends are held is
    rigid; the rod beside it is clamped at the very vertex, and of the length between both middles only
    the free half is left: k = E I / b, k_t = G J / b.
    """
    lengths = np.where(clamped_segments(body, held), 0.0, body.measures)
    flexible = lengths[:-1] + lengths[1:]
    flexible = np.where(flexible > 0, flexible, body.measures[:-1] + body.measures[1:])
    bend = np.maximum(rope_rigidities(body, material), _SMALLEST)
    return bend / flexible, max(material.twist_rigidity, _SMALLEST) / flexible


def stretch_damping(body: Body, material: RopeMaterial, masses: FloatArray, held: IntArray) -> float:
    """Damping time [s] of the stretch, which is that of the material unless stretch cannot be seen.

    A step is linear in where vertices go, so that a segment that turns gets longer by the square of the angle, and the
    more it is damped the longer it stays so. :class:`~.turning.Turning` takes most of that off: a swung rope damped for
    0.2 s is 5.1 mm off at 2.5 ms, and 1.3 mm with a tenth of what is critical for the slowest mode (``make
    bench-sim``). How stretch comes to rest nobody sees of a rope that its own weight stretches by less than 1 %.

    Args:
        body: the rope.
        material: its material.
        masses: of the vertices ``(V,)`` [kg], loads included.
        held: vertices ``(H,)``.
    """
    mass, place = float(masses.sum()), np.concatenate([[0.0], np.cumsum(body.measures)])
    if mass * STANDARD_GRAVITY > _SEEN_STRETCH * material.stretch_stiffness:
        return material.damping_time
    nodes = place[held] if len(held) else place[[-1]] / 2  # where the slowest mode does not move
    quarter = float(np.abs(place[:, None] - nodes).min(axis=1).max())  # of its wave length
    slowest = np.pi / (2.0 * quarter) * np.sqrt(material.stretch_stiffness * place[-1] / mass) if quarter else np.inf
    return float(min(material.damping_time, 2.0 * _STRETCH_DAMPING / slowest))


def looking_back(body: Body, material: RopeMaterial, held: IntArray, time_step: float) -> float:
    r"""How far back the steps of a rope may look, ``a`` of :class:`~.gliding.TwoStep`: 1/3 if it is straight at rest.

    Bending a bend out of its plane twists a rope. MuJoCo's implicit matrix leaves that coupling out, which makes it too
    soft by a factor of up to :math:`1 + \rho`, and a rope too stiff for the step shakes where that is more than
    1 + 1 / (1 + 2 a). At rest turned by the angle :math:`\Phi` in all, :math:`\rho^2 = c / (1 + c)` with
    :math:`c = (GJ / EI) (\Phi / \pi)^2`. Damping of the time :math:`\beta` makes more of it, limp ropes have more than
    their GJ says: with :math:`c = (GJ / EI + 0.2) (\Phi / \pi)^2 (1 + 0.3 \beta / h)` and seven tenths of the a that
    this allows, a rope comes to rest (``test_mujoco_gliding.py``: GJ / EI from 0.01 to 100, up to 9 rad).
    """
    bending = RopeBending(body, held)
    path = np.cumsum(np.concatenate([np.zeros((1, 2)), bending.rest * bending.measures[:, None]]), axis=0)
    turn = float(np.linalg.norm(np.ptp(path, axis=0)))
    if turn < _STRAIGHT:
        return _FURTHEST_BACK
    bend = float(rope_rigidities(body, material).min())
    twist = material.twist_rigidity + _LIMP * bend
    coupling = twist * (turn / np.pi) ** 2 * (1.0 + _BY_DAMPING * material.damping_time / time_step)
    most = (np.sqrt(1.0 + bend / max(coupling, _SMALLEST)) - 1.0) / 2.0
    return float(min(_FURTHEST_BACK, _OF_THE_WAY_BACK * most))


def aside(body: Body) -> FloatArray:
    """A point ``(3,)`` on the line through no segment: of many directions that with the largest smallest triangle."""
    middle, size = body.vertices.mean(axis=0), float(np.linalg.norm(np.ptp(body.vertices, axis=0)))
    turn = np.arange(32) * np.pi * (3.0 - np.sqrt(5.0))  # Fibonacci's sphere
    z = 1.0 - (2.0 * np.arange(32) + 1.0) / 32
    sphere = np.stack([np.sqrt(1 - z * z) * np.cos(turn), np.sqrt(1 - z * z) * np.sin(turn), z], axis=1)
    candidates = middle + size * sphere
    a, b = body.vertices[:-1], body.vertices[1:]
    areas = np.linalg.norm(np.cross(b - a, candidates[:, None] - a), axis=2).min(axis=1)
    return np.asarray(candidates[np.argmax(areas)])


def start_turn(body: Body, start: FloatArray, held: IntArray) -> float:
    """Angle [rad] by which all segments of a curved rope are turned about themselves at ``start (V, 3)``.

    MuJoCo starts with material frames that go from the first segment's rest direction to its present one by the
    shortest turn, and on from there without twist. A rope moved rigidly is at rest only if its frames turn
    along; of all common turns this is the one that leaves the least bending energy. A first segment that a gripper
    holds as it lies at rest is not turned.
    """
    axis = np.eye(3)[np.argmin(np.abs(body.vertices[1] - body.vertices[0]))]
    rest, now = np.diff(body.vertices, axis=0), np.diff(start, axis=0)
    rest, now = (d / np.linalg.norm(d, axis=1, keepdims=True) for d in (rest, now))
    if clamped_segments(body, held)[0] and rest[0] @ now[0] > 1.0 - _UNMOVED:
        return 0.0
    u = np.cross(rest[0], axis)
    u /= np.linalg.norm(u)
    at_rest = _curvatures(rest, u)
    present = _curvatures(now, _carried(u, rest[0], now[0]))
    cross = np.sum(at_rest[:, 0] * present[:, 1] - at_rest[:, 1] * present[:, 0])
    return float(np.arctan2(cross, np.sum(at_rest * present))) if np.abs(at_rest).max(initial=0.0) > 1e-4 else 0.0


def start_twists(body: Body, held: IntArray, twist: float) -> FloatArray:
    """Angles of the segments ``(V - 1,)`` [rad], of a rope that is twisted by ``twist`` from its first to its last.

    A uniform rope whose twist has settled is twisted evenly, but where it is clamped.
    """
    free = np.where(clamped_segments(body, held), 0.0, body.measures)
    so_far = np.cumsum(0.5 * (free[:-1] + free[1:]))
    return twist * np.concatenate([[0.0], so_far]) / max(float(so_far[-1]), _SMALLEST) if len(so_far) else np.zeros(1)


def _curvatures(tangents: FloatArray, u: FloatArray) -> FloatArray:
    """Curvature binormals ``(V - 2, 2)`` in a frame that goes along without twist from ``u (3,)``."""
    before, behind = tangents[:-1], tangents[1:]
    turned, steep = cross(before, behind), 1.0 + dot(before, behind)
    across = np.empty_like(before)
    for k, (both, share) in enumerate(zip(before + behind, steep.tolist(), strict=True)):
        across[k] = u
        u = u - (behind[k] @ u) / share * both
    binormals = 2.0 * turned / steep[:, None]
    return np.stack([dot(binormals, across), dot(binormals, cross(before, across))], axis=1)


def _carried(u: FloatArray, a: FloatArray, b: FloatArray) -> FloatArray:
    """``u``, across ``a``, after the shortest turn from direction ``a`` to ``b``."""
    return np.asarray(u - (b @ u) / (1.0 + a @ b) * (a + b))
