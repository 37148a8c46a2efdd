"""How noisy the measurement is: told, from repeats, or from its roughness in time."""

from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from ..core.arrays import FloatArray
from ..core.differences import fourth_differences, robust_sd
from ..core.errors import InputError
from ..core.measurement import repeats
from ..core.study import Problem
from .noise_draws import ar1_noise, smooth_noise
from .patches import patch_noise
from .repeated_noise import SLOWEST, noise_of_repeats

#: Where the noise of clouds is from, and what that does not tell.
_CLOUDS = "how patches of the clouds scatter; if cameras do not agree, which that does not show, give [noise] sd"


@dataclass(frozen=True)
class SharedNoise:
    """The part of the noise that points near each other have in common, as depth cameras that do not agree make it.

    Args:
        share: of the variance; by the rest every point is off by itself.
        reach: two points at the distance d are correlated by exp(-d^2 / (2 reach^2)) [unit].
        ar1: correlation between successive frames of what stays in one place.
        together: how many numbers of the measurement are worth an independent one.
    """

    share: float
    reach: float
    ar1: float
    together: float


@dataclass(frozen=True)
class Noise:
    """Noise of one coordinate of one point.

    Args:
        sd: standard deviation [unit].
        ar1: correlation between successive frames, of an AR(1) process.
        source: how it was found.
        unit: "m" or "px".
        relative_error: of ``sd``, one standard deviation.
        tails: a fit counts frames that are off by much more than so many ``sd`` by a logarithm only; None: by squares.
        shared: what neighbours have in common; None if each is off by itself.
    """

    sd: float
    ar1: float
    source: str
    unit: str
    relative_error: float
    tails: float | None = None
    shared: SharedNoise | None = None

    @classmethod
    def from_dict(cls, kept: dict[str, Any]) -> "Noise":
        """The one that :meth:`as_dict` gave."""
        shared = kept.get("shared")
        return cls(**{**kept, "shared": SharedNoise(**shared) if shared else None})

    @property
    def information(self) -> float:
        """How many independent numbers one number is worth, for what many have in common."""
        if self.shared is not None:
            return 1.0 / self.shared.together
        return (1 - self.ar1) / (1 + self.ar1)

    @property
    def normal(self) -> "Noise":
        """The same without tails: what is drawn as noise, and what a misfit is held against."""
        return replace(self, tails=None)

    def as_dict(self) -> dict[str, Any]:
        return asdict(self)

    def draw(self, places: FloatArray, rng: np.random.Generator) -> FloatArray:
        """Noise of what is at ``places (T, P, A)``, in units of ``sd``."""
        if self.shared is None:
            return ar1_noise(places.shape, self.ar1, rng)
        own = np.sqrt(1.0 - self.shared.share) * rng.normal(size=places.shape)
        field = smooth_noise(places, self.shared.reach, self.shared.ar1, rng)
        return np.asarray(own + np.sqrt(self.shared.share) * field)


def estimate_noise(problem: Problem, told: float | None, tails: float | None = None) -> Noise:
    """The noise of a study's recordings, with ``tails`` as the study says.

    Told by the study, else from repeats of the same motion, held-out takes among them (their difference
    is pure noise, take to take variation of the object included) that grippers did move alike, else from
    the fourth difference in time, to which a smooth motion gives next to nothing; of clouds from how their
    patches scatter.

    Raises:
        InputError: recordings too short or too sparse for an estimate.
    """
    recordings = list(problem.recordings.values())
    unit = recordings[0].series.unit
    if told is not None:
        return Noise(told, 0.0, "given in the study", unit, 0.02, tails)
    pairs = repeats(recordings)
    estimates = {(a.name, b.name): noise_of_repeats(a, b) for a, b in pairs}
    found = {names: e for names, e in estimates.items() if e is not None and e.moved_alike}
    if found:
        variance, ar1, count = (np.array([getattr(e, k) for e in found.values()]) for k in ("variance", "ar1", "count"))
        sd = float(np.sqrt(np.average(variance, weights=count)))
        correlation = float(np.clip(np.average(ar1, weights=count), 0.0, SLOWEST))
        takes = len({name for names in found for name in names})
        independent = count.sum() * min(1.0, takes / 2 / len(found)) * (1 - correlation) / (1 + correlation)
        source = f"{takes} takes that are repeats"
        error = float(1 / np.sqrt(2 * max(independent, 1.0)))
    elif len(problem.clouds) == len(recordings) and (sd := patch_noise([r.series.points for r in recordings])) > 0:
        correlation, source, error = 0.0, _CLOUDS, 0.1
    else:
        corresponding = [r.series.points for r in recordings if r.series.correspondence]
        rough = np.concatenate([fourth_differences(p) for p in corresponding] or [np.zeros(0)])
        if len(rough) < 20:
            why = "so few frames" if any(r.series.correspondence for r in recordings) else "unordered points"
            example = "0.003 (in metres)" if recordings[0].series.unit == "m" else "1.0 (in pixels)"
            raise InputError(f"the noise cannot be estimated from {why}; give it in the study: [noise] sd = {example}")
        sd, correlation, source = robust_sd(rough), 0.0, "roughness in time"
        if apart := [names for names, e in estimates.items() if e is not None]:
            a, b = apart[0]
            source += f"; {a} and {b} are of one motion by their names, but were moved differently"
        error = float(1.2 / np.sqrt(len(rough) / 2))
    if sd <= 0:
        raise InputError("the measurement has no noise at all; give a standard deviation: [noise] sd = 0.001")
    return Noise(sd, correlation, source, unit, error, tails)
