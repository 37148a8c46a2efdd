"""From refitted candidates to one of five verdicts."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy import stats

from .candidate import Candidate, root_mean_square, z_value
from .misfit import chance, is_misfit

Verdict = Literal["named", "tied", "none", "cannot-tell", "no-misfit"]

#: An effect is named only if it explains at least this share of the excess misfit: the right one, fitted to the end,
#: leaves next to nothing, and one that stands in for what is in no list explains half to three quarters ...
EXPLAINS = 0.8
#: ... with at least this significance [standard deviations] ...
SIGNIFICANT = 4.0
#: ... and rivals are worse by more than this in -2 log likelihood (a Bayes factor of about 150) ...
MARGIN = 10.0
#: ... and by more than this share of what the best one leaves unexplained.
SHARE_LEFT = 0.5
#: It must take away this share of the excess variance on held-out motions ...
HELD_OUT_SHARE = 0.2
#: ... where there is more of it than this share of the noise variance.
HELD_OUT_SLACK = 0.02
#: That nothing is missing is said only if these data would show this share of the candidates.
MOST_VISIBLE = 2 / 3


@dataclass(frozen=True)
class Evidence:
    """What decides.

    Args:
        rss_plain: residual sum of squares of the model as it is [noise variances].
        count: degrees of freedom: independent residuals less parameters.
        held_out_plain: root mean square error on held-out recordings [unit]; NaN if there are none, infinite if
            they cannot be simulated.
        held_out_white: mean square of the same, whitened by noise and numerics [noise variances].
        noise_sd: [unit].
        noise_error: relative standard error of ``noise_sd``.
        candidates: refitted.
        unsure: what else may be left or not, as the model cannot be repeated [noise variances].
    """

    rss_plain: float
    count: float
    held_out_plain: float
    held_out_white: float
    noise_sd: float
    noise_error: float
    candidates: tuple[Candidate, ...]
    unsure: float = 0.0

    @property
    def chance(self) -> float:
        """What noise may leave beyond :attr:`count`, and what cannot be repeated [noise variances]."""
        return chance(self.count, self.noise_error) + self.unsure

    @property
    def floor(self) -> float:
        """The residual sum of squares that noise may leave, or the best candidate if that is less."""
        return min([self.count + self.chance, *(c.rss for c in self.candidates)])

    @property
    def nearest(self) -> Candidate:
        """The candidate that leaves least."""
        return min(self.candidates, key=lambda c: c.rank)

    @property
    def excess(self) -> float:
        """Misfit to be explained; no less than two margins, below which there is nothing to share out."""
        return max(self.rss_plain - self.floor, 2 * MARGIN)

    def explained(self, candidate: Candidate) -> float:
        """Share of the excess misfit that goes away with the candidate, 0 to 1."""
        return float(np.clip((self.rss_plain - candidate.rss) / self.excess, 0.0, 1.0))

    def z(self, candidate: Candidate) -> float:
        return z_value(self.rss_plain, candidate, len(self.candidates))

    def held_out(self, candidate: Candidate) -> float:
        return root_mean_square(list(candidate.held_out.values()))

    def better_held_out(self, candidate: Candidate) -> bool:
        """The excess error on motions it was not fitted to falls; true if there are none to ask.

        Where the plain model has no excess there to speak of, it must not rise; where it cannot be simulated, it is
        enough that it can be with the effect. Motions that do not show the effect, as strong as it was found, say
        nothing of it.
        """
        if np.isnan(self.held_out_white) or not candidate.shown_held_out:
            return True
        before, after = self.held_out_white, candidate.held_out_white
        if np.isinf(before):
            return bool(np.isfinite(after))
        if before - 1.0 < HELD_OUT_SLACK:
            return bool(after < before + HELD_OUT_SLACK)
        return bool(after < before - HELD_OUT_SHARE * (before - 1.0))

    def behind(self, candidate: Candidate, best: Candidate) -> float:
        """How much less probable the candidate makes the residuals than the ``best`` one, in -2 log likelihood.

        The noise is known to :attr:`noise_error` only, and averaged over: the likelihood is Student's t, of as many
        degrees of freedom as the estimate of the noise is worth (Gelman et al., Bayesian Data Analysis, 3.2). Where
        noise is known well, and is all that the best leaves, it is the difference of their residual sums of squares.
        """
        freedom = 0.5 / max(self.noise_error, 1e-6) ** 2
        return float((freedom + self.count) * np.log((freedom + candidate.rss) / (freedom + best.rss)))

    def left(self, candidate: Candidate) -> float:
        """What a candidate leaves beyond what noise may [noise variances]."""
        return max(0.0, candidate.rss - self.count - self.chance)

    def level(self, candidate: Candidate, best: Candidate) -> bool:
        """Is a candidate so near to the ``best`` one that the data cannot tell them?

        By the likelihood of noise, or by what the best leaves beyond noise, in squares as that is: the model's own
        errors may be as much of it as the difference is.
        """
        left = self.left(best)
        within = left > 0.0 and candidate.rss - best.rss < MARGIN + SHARE_LEFT * left
        return within or self.behind(candidate, best) < MARGIN


@dataclass(frozen=True)
class Decision:
    """A verdict and the effects that it is about, best first; unfinished if what promises most was not refitted."""

    verdict: Verdict
    effects: tuple[str, ...]
    unfinished: bool = False


def has_misfit(e: Evidence) -> bool:
    """Is there more misfit than the noise, and its own uncertainty, explain?"""
    return is_misfit(e.rss_plain, e.count, e.noise_error, e.unsure)


#: Why a candidate is not the answer: what was asked of it and not met, in the order in which it is asked.
Objection = Literal["invisible", "chance", "zero", "little", "held-out"]


def objection(e: Evidence, candidate: Candidate) -> Objection | None:
    """What speaks against a candidate by itself; None where nothing does."""
    by_chance = e.z(candidate) < SIGNIFICANT
    if not by_chance and _moved(candidate):
        return short_of_a_name(e, candidate)
    if not candidate.visible:
        return "invisible"
    return "chance" if by_chance else "zero"


def short_of_a_name(e: Evidence, candidate: Candidate) -> Objection | None:
    """What a candidate that is there for sure lacks to be the answer; None where it lacks nothing."""
    if e.explained(candidate) < EXPLAINS:
        return "little"
    return None if e.better_held_out(candidate) else "held-out"


def nothing_named(e: Evidence) -> Verdict:
    """What is said where no candidate is the answer."""
    if has_misfit(e):
        return "none"
    seen = sum(c.visible for c in e.candidates)
    return "no-misfit" if seen >= MOST_VISIBLE * len(e.candidates) else "cannot-tell"


def decide(e: Evidence) -> Decision:
    """The five verdicts, in the order in which they are ruled out."""
    passing = sorted((c for c in e.candidates if objection(e, c) is None), key=lambda c: c.rank)
    if not has_misfit(e) and not any(_clear_gain(e, c) for c in passing):
        return Decision(nothing_named(e), ())
    if not any(c.refitted for c in (passing[:1] or e.candidates)):  # nothing is named nor ruled out unfitted
        return Decision("cannot-tell", (), unfinished=True)
    if not passing:
        return Decision("none", ())
    best = passing[0]
    rivals = [c for c in sorted(e.candidates, key=lambda c: c.rank) if c is not best and _rivals(e, c, best)]
    if rivals:
        return Decision("tied", (best.name, *(c.name for c in rivals)))
    return Decision("named", (best.name,))


def _rivals(e: Evidence, candidate: Candidate, best: Candidate) -> bool:
    """Is it so near to the best that the data cannot tell them, though it may explain a little less than asked?"""
    why = objection(e, candidate)
    stands = why is None or (why == "little" and e.better_held_out(candidate))
    return stands and e.level(candidate, best)


def _moved(candidate: Candidate) -> bool:
    """The coefficients are away from zero by more than their joint uncertainty allows (three standard deviations)."""
    return bool(candidate.wald > stats.chi2.isf(0.0027, len(candidate.space) - candidate.base))


def _clear_gain(e: Evidence, candidate: Candidate) -> bool:
    """A gain that is a misfit, though the total is within what the noise may be.

    It is one where it is significant enough by itself, or where motions that were not fitted bear it out by as much as
    a rival is held off by. Either is a difference of two sums, which how large the noise is changes by little.
    """
    beyond_doubt = e.z(candidate) > 2 * SIGNIFICANT or candidate.held_out_gain > MARGIN
    return beyond_doubt and not np.isnan(e.held_out_plain)
