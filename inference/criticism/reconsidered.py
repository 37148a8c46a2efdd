"""Candidates that only held-out motions speak against, held against these by the numerics as they are where they fit.

How far a finer mesh or another engine is from the model depends on where the model is. Without the effect that is
missing it is bent far off, and what its numbers may be wrong by there says little of where the right model is: a sheet
that slides on a table parts elsewhere.
"""

from dataclasses import replace

from .candidate import Candidate
from .stage import Stage
from .verdict import Decision, objection, short_of_a_name
from .work import Work

#: So many candidates at most are looked at; that is some twenty simulations each.
MOST = 3


def reconsidered(work: Work, stage: Stage) -> Stage:
    """The stage as it is, or with a name for what explains the misfit and stands by the numerics where it fits.

    Those that are level with the nearest candidate, and like it lack nothing else, may be tied with it.
    """
    if stage.decision.verdict != "none" or not _only_held_out(stage, stage.evidence.nearest):
        return stage
    e = stage.evidence
    near = [c for c in sorted(e.candidates, key=lambda c: c.rank) if e.level(c, e.nearest) and _only_held_out(stage, c)]
    standing = []
    for c in near[:MOST]:
        work.study.progress(f"looking at {c.name} where it fits", 0, 0)
        joint = work.where_it_fits(c, stage.plain)
        if short_of_a_name(joint, joint.nearest) is None:
            standing.append(c.name)
    if not standing:
        return stage
    return replace(stage, decision=Decision("named" if len(standing) == 1 else "tied", tuple(standing)))


def _only_held_out(stage: Stage, candidate: Candidate) -> bool:
    return candidate.refitted and objection(stage.evidence, candidate) == "held-out"
