"""How a rope that is bent at rest twists between two grippers."""

import numpy as np

from .arrays import FloatArray

#: Torsional over bending rigidity of a round solid rod, 1 / (1 + nu), at a Poisson's ratio of 1/3.
ROUND = 0.75
#: Newton's steps at most, the largest change of an angle in one, and that at which they end [rad].
_STEPS, _LARGEST, _NEAR = 30, 0.5, 1e-3


def settled_twist(curvatures: FloatArray, natural: FloatArray, lengths: FloatArray, ends: FloatArray) -> FloatArray:
    r"""Angles of the material about the rope ``(T, V)`` [rad], from axes that are carried along without twist.

    Twist has next to no inertia, so it is in balance with the bending at all times: of all angles :math:`\theta` the
    energy :math:`\int GJ \theta'^2 / 2 + EI |\kappa - R(\theta) \kappa_0|^2 / 2` is smallest. Without natural curvature
    :math:`\kappa_0` twist is spread evenly; a rope that keeps a bend turns it into the plane in which it is bent, and
    what the grippers turn it by is left near them. With GJ / EI of a round solid rod; Newton's method from an even
    twist.

    Args:
        curvatures: of the rope at its inner vertices, along the untwisted axes ``(T, V - 2, 2)`` [1/m].
        natural: along the material's axes ``(V - 2, 2)`` [1/m].
        lengths: of the segments ``(T, V - 1)`` [m].
        ends: angles of the material at both ends ``(T, 2)`` [rad].

    References:
        Bergou, Wardetzky, Robinson, Audoly and Grinspun, *Discrete elastic rods*, 2008: quasi-static material frames.
    """
    so_far = np.concatenate([np.zeros((len(lengths), 1)), np.cumsum(lengths, axis=1)], axis=1)
    angles = ends[:, :1] + (ends[:, 1:] - ends[:, :1]) * so_far / so_far[:, -1:]
    stiff = ROUND / lengths
    for _ in range(_STEPS):
        bend, moment = _resistance(curvatures, natural, lengths, angles)
        twisted = stiff * np.diff(angles, axis=1)
        # a bend turned the wrong way round has a negative stiffness, from which Newton's method would go uphill
        diagonal = np.maximum(bend, 0.0) + stiff[:, :-1] + stiff[:, 1:]
        step = _tridiagonal(diagonal, -stiff[:, 1:-1], twisted[:, 1:] - twisted[:, :-1] - moment)
        step = np.clip(step, -_LARGEST, _LARGEST)
        angles[:, 1:-1] += step
        if np.abs(step).max(initial=0.0) < _NEAR:
            break
    return np.asarray(angles)


def twist_by_ends(curvatures: FloatArray, natural: FloatArray, lengths: FloatArray, angles: FloatArray) -> FloatArray:
    """By how much :func:`settled_twist` changes with the angles of both ends ``(T, V, 2)`` [1]; arguments as there.

    Args:
        curvatures, natural, lengths: as there.
        angles: what it gave ``(T, V)`` [rad].
    """
    stiff = ROUND / lengths
    bend, _ = _resistance(curvatures, natural, lengths, angles)
    out = np.zeros((*angles.shape, 2))
    for end, place, held in ((0, 0, stiff[:, 0]), (1, -1, stiff[:, -1])):
        pull = np.zeros_like(bend)
        if pull.shape[1]:
            pull[:, place] = held
        diagonal = np.maximum(bend, 0.0) + stiff[:, :-1] + stiff[:, 1:]
        out[:, 1:-1, end] = _tridiagonal(diagonal, -stiff[:, 1:-1], pull)
        out[:, place, end] = 1.0
    return out


def _resistance(
    curvatures: FloatArray, natural: FloatArray, lengths: FloatArray, angles: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Of the bending, over EI: stiffness against turns of the material, and its moment ``(T, V - 2)`` each."""
    inner = angles[:, 1:-1, None]
    kept = np.cos(inner) * natural + np.sin(inner) * np.stack([-natural[:, 1], natural[:, 0]], axis=1)
    across = 0.5 * (lengths[:, 1:] + lengths[:, :-1])
    moment = across * (curvatures[..., 0] * kept[..., 1] - curvatures[..., 1] * kept[..., 0])
    return across * np.sum(curvatures * kept, axis=2), moment


def _tridiagonal(diagonal: FloatArray, beside: FloatArray, right: FloatArray) -> FloatArray:
    """Solutions ``(T, N)`` of T symmetric systems: ``diagonal (T, N)``, ``beside (T, N - 1)`` it, ``right (T, N)``."""
    d, r = diagonal.T.copy(), right.T.copy()
    b = beside.T
    for k in range(1, len(d)):
        share = b[k - 1] / d[k - 1]
        d[k] -= share * b[k - 1]
        r[k] -= share * r[k - 1]
    for k in range(len(d) - 1, -1, -1):
        if k + 1 < len(d):
            r[k] -= b[k] * r[k + 1]
        r[k] /= d[k]
    return np.asarray(r.T)
