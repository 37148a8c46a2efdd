"""Widths of mixtures, one factor a parameter, and the mass in their tails, found on draws that were left out."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from .mixture_head import mixture_log_prob

#: A part of the mass lies in a copy of the mixture this much wider, so that the few draws in its tail do not widen
#: it all.
TAIL_WIDTH = 3.0
_TAILS = (0.001, 0.01, 0.03, 0.06, 0.1, 0.2)
# Factors on standard deviations, of which those that suit the left-out draws best are taken.
_WIDENINGS = (0.7, 0.8, 0.9, 1.0, 1.1, 1.2, 1.35, 1.5, 1.75, 2.0, 2.5, 3.0)
# Times that every parameter is looked at.
_SWEEPS = 3


@dataclass(frozen=True, eq=False)
class LeftOut:
    """What a network says of draws that it left out.

    Args:
        rows: ``(n,)`` their numbers.
        target: ``(n, D)``.
        outputs: of :class:`~.mixture_head.MixtureHead`.
    """

    rows: Tensor
    target: Tensor
    outputs: tuple[Tensor, Tensor, Tensor]

    def log_prob(self, widening: Tensor, tail: float) -> Tensor:
        """``(n,)`` with standard deviations times ``(D,)`` and a part of the mass in the tail."""
        logits, means, factors = self.outputs
        narrow = mixture_log_prob(self.target, logits, means, factors / widening)
        wide = mixture_log_prob(self.target, logits, means, factors / (TAIL_WIDTH * widening))
        return torch.logaddexp(narrow + math.log(1.0 - tail), wide + math.log(tail))


def fitted_width(said: Sequence[LeftOut], weights: Tensor) -> tuple[Tensor, float]:
    """Factors ``(D,)`` and the part in the tail under which left-out draws are likeliest.

    Draws that several networks left out are judged by the mean of their densities. Common factors are tried first, then
    one parameter at a time.

    Args:
        said: one a network.
        weights: ``(N,)`` of all draws.
    """
    times = torch.zeros(len(weights))
    for part in said:
        times[part.rows] += 1.0
    scored = times > 0

    def score(widening: Tensor, tail: float) -> float:
        total = torch.full_like(weights, -torch.inf)
        for part in said:
            total[part.rows] = torch.logaddexp(total[part.rows], part.log_prob(widening, tail))
        return float(weights[scored] @ (total - times.log())[scored])

    dim = said[0].target.shape[1]
    best, factor, tail = max((score(torch.full((dim,), f), t), f, t) for f in _WIDENINGS for t in _TAILS)
    widening = torch.full((dim,), factor)
    for _ in range(_SWEEPS if dim > 1 else 0):
        before = best
        for j in range(dim):
            tried = [torch.where(torch.arange(dim) == j, f, widening) for f in _WIDENINGS]
            scores = [score(w, tail) for w in tried]
            if max(scores) > best:
                best, widening = max(scores), tried[scores.index(max(scores))]
        best, tail = max((score(widening, t), t) for t in _TAILS)
        if best <= before:
            break
    return widening, tail
