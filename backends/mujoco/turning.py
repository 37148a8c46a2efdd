"""A rope that turns is slowed down by steps that are linear in where its vertices go; this makes up for it."""

import numpy as np

from ...core.arrays import FloatArray, IntArray

#: Where a segment turns by more than that in a step [rad], or is stretched by more than that share, a step is left as
#: it is: it does not resolve the motion, and damps it.
MOST_TURN, MOST_STRAIN = 0.3, 0.005


class Turning:
    r"""What a step that looks back (:class:`~.gliding.TwoStep`) gets wrong of the pull of segments that turn.

    A segment d of length l has the energy :math:`M e^2 / 4` with :math:`e = d \cdot d - l^2`, so it pulls with
    :math:`M e d`. A step begins at d and is linear in the change :math:`\delta` of d: at its end MuJoCo pulls with
    :math:`M (e + 2 d \cdot \delta) d + M e \delta`. A segment that turns by :math:`\Delta` from step to step is to end
    as long as it was, but

    - where the step begins, a of a step further on along the tangent, it is too long: e is more by
      :math:`a (1 + a) \Delta \cdot \Delta`, and :math:`M e \delta` pulls against the turn. Of a stick of 0.4 m with
      0.05 kg/m and E A = 5 kN that spins at 20 rad/s, more than half of the energy was gone after a second of steps of
      1.25 ms. So its length at rest is taken to be longer by as much, which leaves e as it is.
    - where the step ends, e is more by :math:`\delta \cdot \delta = (1 - a)^2 \Delta \cdot \Delta`, of which the step
      does not know, so segments get longer as they turn. A force pulls with M d times this and what was taken off of e.
    - damping of the time :math:`\beta` resists the rate :math:`2 d \cdot \delta / h`, of which minus both of these
      comes of the turn alone. A force pulls as much the other way.

    :math:`\Delta` is across d, and :math:`\Delta \cdot \Delta` the product of the last two, so that what goes to and
    fro from step to step does not count, nor what makes a segment longer.

    Args:
        rest: vertices of the rope at rest ``(V, 3)`` [m].
        forms: view of the stretch stiffness of its segments in the model ``(V - 1, 21)``, M first.
        lengths: view of the lengths at rest in the model ``(N,)`` [m], which are changed.
        where: which of them are of the segments ``(V - 1,)``.
    """

    def __init__(self, rest: FloatArray, forms: FloatArray, lengths: FloatArray, where: IntArray) -> None:
        self._rest, self._stiffness = np.diff(rest, axis=0), forms[:, 0]
        self._lengths, self._where, self._plain = lengths, where, lengths[where]
        self._squared = self._plain**2
        self._out = np.zeros_like(rest)
        self._edge: FloatArray | None = None
        self._turn: FloatArray | None = None

    def forget(self) -> None:
        """The next step does not look back."""
        self._lengths[self._where] = self._plain
        self._edge = self._turn = None

    def force(self, moved: FloatArray, back: float, damped: float) -> FloatArray | None:
        """Nodal force ``(3 V,)`` [N] for the step that begins now, and lengths for it; to be asked for once a step.

        Args:
            moved: displacements from the rest shape ``(3 V,)`` [m], after the last step.
            back: how far it looks back, a.
            damped: damping time of the stretch, in steps of MuJoCo.
        """
        moved = moved.reshape(-1, 3)
        edge = moved[1:] - moved[:-1]
        edge += self._rest
        before, self._edge = self._edge, edge
        if before is None:
            return None
        change, size = edge - before, np.einsum("ax,ax->a", edge, edge)
        turn = change - (np.einsum("ax,ax->a", change, edge) / size)[:, None] * edge
        squared = np.maximum(np.einsum("ax,ax->a", turn, turn if self._turn is None else self._turn), 0.0)
        self._turn = turn
        strain = (size / self._squared - 1.0) / (2.0 * MOST_STRAIN)
        angle = squared / (MOST_TURN**2 * self._squared)
        squared /= (1.0 + angle * angle) * (1.0 + strain * strain)
        at_start, at_end = back * (1.0 + back), (1.0 - back) ** 2
        self._lengths[self._where] = np.sqrt(self._squared + at_start * squared)
        squared *= (1.0 + damped) * (at_start + at_end)
        squared *= self._stiffness
        pull = squared[:, None] * (edge + back * change)
        self._out[:-1] = pull
        self._out[-1] = 0.0
        self._out[1:] -= pull
        return self._out.ravel()
