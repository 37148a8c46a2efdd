"""Information adds up: the posterior given several measurements, from the posteriors given each."""

from collections.abc import Sequence
from pathlib import Path
from typing import ClassVar

import numpy as np
from scipy.special import logsumexp

from ...core.arrays import FloatArray
from ...core.errors import InputError
from ...core.estimator import Posterior
from .archive import open_archive, parts_as_arrays, parts_in, write_archive
from .mixture import MixturePosterior, to_latent

#: Draws of a step towards the product, kernels of a proposal, and draws that measure the normaliser.
_DRAWS, _KERNELS, _MEASURED = 4000, 50, 10_000
#: Share of the draws that a step's weights must be worth.
_WORTH = 0.2
_STEPS = 60
#: Share of a proposal that is one Gaussian (the product of many parts nearly is one), and its width over the draws'.
_WIDE, _WIDER = 0.5, 1.3

#: Share of the fused draws outside a part above which the part is contradicted.
_RULED_OUT = 0.99
_APART = (
    "these posteriors leave no parameters in common: the measurements contradict each other, or a posterior is too "
    "narrow; compare their marginals, and check the calibration of the estimator"
)


class FusedPosterior(Posterior):
    """``p(u | x_1 .. x_R) ~ p(u) prod_r p(u | x_r) / p(u)``, for measurements independent given the parameters.

    The prior is one on the unit cube, so log densities add. What is wrong with the parts adds up too: a mean that is
    off by a tenth of a part's standard deviation is off by 0.4 of the fused one's where there are sixteen. Where
    recordings are simulated anyway, learning from all of them at once is more accurate.

    The product is found by tempered importance sampling (population Monte Carlo, Cappé et al. 2004) from a mixture of
    Gaussian kernels in probit coordinates, which also gives the normaliser; draws come from that mixture by
    rejection.

    Args:
        parts: posteriors over the same parameters, given one measurement each.
        seed: of the search.

    Raises:
        InputError: no parts, other parameters, or parts that leave no parameters in common.
    """

    format: ClassVar[str] = "muslin-fused-posterior-1"

    def __init__(self, parts: Sequence[Posterior], seed: int = 0) -> None:
        if len({p.dim for p in parts}) != 1:
            raise InputError(f"posteriors to fuse must have the same parameters, but have {[p.dim for p in parts]}")
        self.parts = list(parts)
        rng = np.random.default_rng(seed)
        self._proposal = self._search(rng)
        _, log_w = self._weighed(_MEASURED, rng)
        self._log_normaliser = float(logsumexp(log_w)) - np.log(_MEASURED)
        # every draw weighs at most this, but for the rare one whose weight is cut
        self._log_most = float(log_w.max())
        self._check_agreement(rng)

    @property
    def dim(self) -> int:
        return self.parts[0].dim

    def log_prob(self, unit: FloatArray) -> FloatArray:
        return np.asarray(self._product(unit) - self._log_normaliser)

    def sample(self, count: int, rng: np.random.Generator) -> FloatArray:
        kept: list[FloatArray] = []
        while sum(map(len, kept)) < count:
            draws, log_w = self._weighed(2 * count + 100, rng)
            kept.append(draws[np.log(rng.random(len(draws))) < log_w - self._log_most])
        return np.concatenate(kept)[:count]

    def _product(self, unit: FloatArray) -> FloatArray:
        return np.asarray(np.sum([p.log_prob(unit) for p in self.parts], axis=0))

    def _weighed(self, count: int, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
        draws = self._proposal.sample(count, rng)
        return draws, self._product(draws) - self._proposal.log_prob(draws)

    def _search(self, rng: np.random.Generator) -> MixturePosterior:
        each = -(-_DRAWS // len(self.parts))
        draws = np.concatenate([p.sample(each, rng) for p in self.parts])
        log_h = logsumexp([p.log_prob(draws) for p in self.parts], axis=0) - np.log(len(self.parts))
        log_w = self._product(draws) - log_h
        for _ in range(_STEPS):
            power = _power(log_w)
            proposal = _kernels(draws, power * log_w, rng)
            draws = proposal.sample(_DRAWS, rng)
            log_w = self._product(draws) - proposal.log_prob(draws)
            if power == 1.0 and _worth(log_w) > _WORTH:
                return proposal
        raise InputError(f"{_APART} (their product could not be found)")

    def _check_agreement(self, rng: np.random.Generator) -> None:
        """A product exists of any densities; it means something where none of them has ruled it out."""
        draws = self.sample(500, rng)
        for k, part in enumerate(self.parts):
            least = part.log_prob(part.sample(_DRAWS, rng)).min()
            if (part.log_prob(draws) < least).mean() > _RULED_OUT:
                raise InputError(f"{_APART} (the others rule out what number {k + 1} of {len(self.parts)} says)")

    def save(self, path: Path) -> None:
        p = self._proposal
        write_archive(
            path, self.format, weights=p.weights, means=p.means, cholesky=p.cholesky,
            numbers=np.array([self._log_normaliser, self._log_most]), **parts_as_arrays(self.parts),
        )  # fmt: skip

    @classmethod
    def load(cls, path: Path) -> "FusedPosterior":
        with open_archive(path, cls.format) as data:
            made = cls.__new__(cls)
            made._proposal = MixturePosterior(data["weights"], data["means"], data["cholesky"])
            made._log_normaliser, made._log_most = (float(v) for v in data["numbers"])
            made.parts = parts_in(data)
            return made


def _worth(log_w: FloatArray) -> float:
    """Share of equally weighted draws that weighted ones are worth."""
    w = np.exp(log_w - log_w.max())
    return float(w.sum() ** 2 / (w**2).sum() / len(w))


def _power(log_w: FloatArray) -> float:
    """The largest power of the weights, at most one, that leaves them worth a share of the draws."""
    if _worth(log_w) >= _WORTH:
        return 1.0
    low, high = 0.0, 1.0
    for _ in range(30):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _worth(middle * log_w) >= _WORTH else (low, middle)
    return low


def _kernels(draws: FloatArray, log_w: FloatArray, rng: np.random.Generator) -> MixturePosterior:
    """A kernel density estimate of weighted draws in probit coordinates, with one Gaussian beneath it."""
    z, w = to_latent(draws), np.exp(log_w - log_w.max())
    w /= w.sum()
    mean, dim = w @ z, z.shape[1]
    covariance = np.atleast_2d(np.cov(z.T, aweights=w)) + 1e-12 * np.eye(dim)
    factor = np.linalg.cholesky(covariance)
    width = (4.0 / (dim + 2) / _KERNELS) ** (1.0 / (dim + 4))  # Silverman's
    centres = z[rng.choice(len(z), _KERNELS, p=w)]
    return MixturePosterior(
        np.append(np.full(_KERNELS, (1 - _WIDE) / _KERNELS), _WIDE),
        np.concatenate([centres, mean[None]]),
        np.concatenate([np.repeat(width * factor[None], _KERNELS, axis=0), _WIDER * factor[None]]),
    )
