"""Is there a misfit, and which of the refitted laws stands, if any?"""

from dataclasses import dataclass

import numpy as np

from ..candidate import drop_z
from ..misfit import chance, is_misfit
from ..verdict import MARGIN, SHARE_LEFT, SIGNIFICANT
from .refit import RefittedLaw

#: A law must explain this share of the excess misfit: less than an effect must, as it is made of simple terms. ...
EXPLAINS = 0.5
#: ... As it had so many to choose from, it must explain this share of the excess variance on held-out recordings, too,
#: where there is any to speak of [noise variances].
HELD_OUT_SHARE, HELD_OUT_EXCESS = 0.5, 0.05


@dataclass(frozen=True)
class Case:
    """What decides.

    Args:
        rss_plain: residual sum of squares of the model as it is, on fitted recordings [noise variances].
        count: degrees of freedom.
        held_out_plain: root mean square error on each held-out recording [unit]; infinite where it cannot be simulated.
        noise_sd: [unit].
        noise_error: relative standard error of ``noise_sd``.
        unsure: what else may be left or not, as the model cannot be repeated [noise variances].
        tried: laws that were looked at, for the significance.
        laws: those that were refitted.
    """

    rss_plain: float
    count: float
    held_out_plain: dict[str, float]
    noise_sd: float
    noise_error: float
    unsure: float = 0.0
    tried: int = 1
    laws: tuple[RefittedLaw, ...] = ()

    @property
    def has_misfit(self) -> bool:
        """More than the noise, and what is not known of it, explain."""
        return is_misfit(self.rss_plain, self.count, self.noise_error, self.unsure)

    def explained(self, law: RefittedLaw) -> float:
        """Share of the excess misfit on fitted recordings that goes away with a law, 0 to 1."""
        allowed = chance(self.count, self.noise_error) + self.unsure
        floor = min([self.count + allowed, *(c.rss for c in self.laws)])
        return float(np.clip((self.rss_plain - law.rss) / max(self.rss_plain - floor, 2 * MARGIN), 0.0, 1.0))

    def explained_held_out(self, law: RefittedLaw) -> float | None:
        """The same on held-out recordings, of the variance; negative if a law does harm; None without any excess.

        It is of those that can be simulated without the law: of an error that nobody knows there are no shares.
        """
        told = [name for name, error in self.held_out_plain.items() if np.isfinite(error)]
        if not told:
            return None
        before, after = (float(np.mean([h[n] ** 2 for n in told])) for h in (self.held_out_plain, law.held_out))
        excess = before - self.noise_sd**2
        if not excess > HELD_OUT_EXCESS * self.noise_sd**2:
            return None
        return float(min(1.0, (before - after) / excess))

    def penalised(self, law: RefittedLaw) -> float:
        """The Bayesian information criterion, its noise scaled to what the best law leaves."""
        scale = max(1.0, min(c.rss for c in self.laws) / self.count)
        return law.rss / scale + len(law.terms) * float(np.log(self.count))

    def significant(self, law: RefittedLaw) -> bool:
        """Is the drop of the misfit beyond what the best of so many laws gains by chance?"""
        drop = max(0.0, self.rss_plain - law.rss) / max(1.0, law.rss / self.count)
        return drop_z(drop, len(law.terms), self.tried) >= SIGNIFICANT

    def holds_up(self, law: RefittedLaw) -> bool:
        """A law must explain what is held out; where nothing is to be explained, it must do no harm.

        With it every held-out recording can be simulated, which is all that is asked of one that cannot without it.
        """
        if not np.isfinite(list(law.held_out.values())).all():
            return False
        share = self.explained_held_out(law)
        if share is not None:
            return share >= HELD_OUT_SHARE
        slack = HELD_OUT_EXCESS * self.noise_sd**2
        return all(law.held_out[n] ** 2 < before**2 + slack for n, before in self.held_out_plain.items())


@dataclass(frozen=True)
class LawDecision:
    """What holds.

    Args:
        verdict: ``"law"``, ``"tied"``, ``"unchecked"`` (no recording is held out) or ``"none"``.
        best: the law that explains most for its size, standing or not.
        rivals: those that the data cannot tell from it.
    """

    verdict: str
    best: RefittedLaw
    rivals: tuple[RefittedLaw, ...]


def decide(case: Case) -> LawDecision:
    """A law stands if it is significant, explains half of the excess misfit, and half of that on held-out motions."""
    ranked = sorted(case.laws, key=case.penalised)
    standing = [c for c in ranked if case.significant(c) and case.explained(c) >= EXPLAINS and case.holds_up(c)]
    if not standing:
        return LawDecision("none", ranked[0], ())
    best = standing[0]
    allowed = MARGIN + SHARE_LEFT * max(0.0, best.rss - case.count) / max(1.0, best.rss / case.count)
    rivals = tuple(
        c
        for c in standing[1:]
        if case.penalised(c) - case.penalised(best) < allowed and not set(best.terms) < set(c.terms)
    )
    if not case.held_out_plain:
        return LawDecision("unchecked", best, rivals)
    return LawDecision("tied" if rivals else "law", best, rivals)
