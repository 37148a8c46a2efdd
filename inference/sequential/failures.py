"""Draws that could not be simulated: how many, why, where in the prior, and what that does to the posterior.

That a draw fails is information about where draws fail, and later rounds keep away from there
(:mod:`.success`). Leaving failed draws out does not bias the posterior where draws succeed. If S is the set of
parameters that can be simulated, what is kept of round r follows its proposal q_r restricted to S, and the mixture
of all rounds is proportional to the sum of n_r q_r on S, with n_r the draws that were tried: the importance weights
stay as they are, up to a constant. The posterior is then the one under the prior restricted to S, so all that is
lost is what the measurement would have said about the rest.
"""

import re
from collections import Counter
from collections.abc import Sequence

import numpy as np

from ...core.arrays import BoolArray, FloatArray
from ...core.parameters import Parameter, ParameterSpace

#: A region of failures that holds more than this share of the whole draws says nothing.
TELLING = 0.5
#: Fewer failures than this have no region.
FEW = 5
#: Share of the posterior next to failed draws above which it is doubtful.
NEXT_TO_FAILED = 0.05


def reasons_text(reasons: Sequence[str], most: int = 3) -> str:
    """The commonest reasons with how often each was given; numbers in them are not told apart.

    Each is shown as it was given first.
    """
    first: dict[str, str] = {}
    for reason in reasons:
        first.setdefault(_kind(reason), reason)
    counted = Counter(_kind(r) for r in reasons).most_common()
    parts = [f"{count} times '{first[kind]}'" for kind, count in counted[:most]]
    left = sum(count for _, count in counted[most:])
    return "; ".join([*parts, f"{left} times something else"] if left else parts)


def _kind(reason: str) -> str:
    return re.sub(r"[-+]?\d[\d.e+-]*", "#", reason)


def region_text(space: ParameterSpace, theta: FloatArray, failed: BoolArray) -> str:
    """Where failures lie, as in ``all of them have stretch_stiffness above 2000 N/m``; empty if nowhere in particular.

    Of all bounds on one parameter beyond which all failures lie, or else nine in ten, the one beyond which the
    fewest whole draws lie.

    Args:
        space: of the parameters.
        theta: of all draws ``(N, D)``, in the unit cube.
        failed: which of them failed ``(N,)``.
    """
    if failed.sum() < FEW or failed.all():
        return ""
    for share, words in ((1.0, "all of them have"), (0.9, "nine in ten of them have")):
        best: tuple[float, str] = (TELLING, "")
        for k, p in enumerate(space):
            for side, sign in (("above", 1.0), ("below", -1.0)):
                along = sign * theta[:, k]
                bound = float(np.quantile(along[failed], 1.0 - share, method="lower"))
                inside = along >= bound
                among_whole = float(inside[~failed].mean())
                if among_whole < best[0]:
                    there = float(failed[inside].mean())
                    value = _value(space, k, sign * bound, p)
                    best = (among_whole, f"{words} {p.name} {side} {value}, where {there:.0%} of the draws fail")
        if best[1]:
            return best[1]
    return ""


def _value(space: ParameterSpace, k: int, unit: float, p: Parameter) -> str:
    at = np.full(len(space), 0.5)
    at[k] = unit
    value = f"{space.from_unit(at)[k]:.3g}"
    return value if p.unit == "1" else f"{value} {p.unit}"


def share_next_to_failed(samples: FloatArray, theta: FloatArray, failed: BoolArray) -> float:
    """Share of posterior ``samples (S, D)`` whose nearest draw of all ``theta (N, D)`` is one that failed."""
    if not failed.any():
        return 0.0
    nearest = [int(np.argmin(np.sum((theta - s) ** 2, axis=1))) for s in samples]
    return float(failed[nearest].mean())


def failure_notes(
    space: ParameterSpace, theta: FloatArray, failed: BoolArray, reasons: Sequence[str], samples: FloatArray
) -> list[str]:
    """Sentences for people; empty if nothing failed.

    Args:
        space: of the parameters.
        theta: of all draws ``(N, D)``, in the unit cube.
        failed: which of them failed ``(N,)``.
        reasons: of those.
        samples: of the posterior ``(S, D)``, in the unit cube.
    """
    if not failed.any():
        return []
    where = region_text(space, theta, failed)
    notes = [
        f"{int(failed.sum())} of {len(failed)} draws could not be simulated: {reasons_text(reasons)}"
        + (f"; {where}" if where else "")
        + ". The posterior speaks only of what can be simulated"
    ]
    share = share_next_to_failed(samples, theta, failed)
    if share > NEXT_TO_FAILED:
        notes.append(
            f"{share:.0%} of the posterior lies next to draws that could not be simulated, so it is cut off there; "
            "lower [simulator] time_step, raise [study] time_limit, or take another simulator"
        )
    return notes
