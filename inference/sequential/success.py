"""How likely a draw is to be simulated, learned from those that were and those that were not."""

import numpy as np
from scipy.optimize import minimize
from scipy.special import expit

from ...core.arrays import BoolArray, FloatArray

#: So many failures, and so many whole draws, before anything is learned from them.
FEW = 5
#: No draw is proposed more rarely than with this probability: what failed by accident is tried again.
LEAST = 0.1
#: Precision of the coefficients' prior: pulls towards "everything can be simulated equally well".
_RIDGE = 0.05


class Success:
    """Logistic regression of success on the parameters, their squares and their products.

    What cannot be simulated lies behind a bound on one parameter, or on a product of some (stiffness over mass),
    which is a plane where they are on log scales.

    Args:
        theta: of all draws that were tried ``(N, D)``, in the unit cube.
        failed: which of them failed ``(N,)``.
    """

    def __init__(self, theta: FloatArray, failed: BoolArray) -> None:
        features, whole = self._features(theta), (~failed).astype(float)

        def loss(c: FloatArray) -> tuple[float, FloatArray]:
            logit = features @ c
            # log(1 + e^t) - y t, and a Gaussian prior on all coefficients but the constant
            value = float(np.sum(np.logaddexp(0.0, logit) - whole * logit) + 0.5 * _RIDGE * np.sum(c[1:] ** 2))
            slope = features.T @ (expit(logit) - whole)
            slope[1:] += _RIDGE * c[1:]
            return value, slope

        self._c = np.asarray(minimize(loss, np.zeros(features.shape[1]), jac=True, method="L-BFGS-B").x)

    @classmethod
    def learned(cls, theta: FloatArray, failed: BoolArray) -> "Success | None":
        """None where there is too little to learn from."""
        return cls(theta, failed) if min(failed.sum(), (~failed).sum()) >= FEW else None

    def probability(self, unit: FloatArray) -> FloatArray:
        """``(N,)`` at least :data:`LEAST`, at most one."""
        return np.asarray(np.maximum(LEAST, expit(self._features(unit) @ self._c)))

    @staticmethod
    def _features(unit: FloatArray) -> FloatArray:
        x = 2.0 * np.asarray(unit) - 1.0
        first, second = np.triu_indices(x.shape[1])
        return np.concatenate([np.ones((len(x), 1)), x, x[:, first] * x[:, second]], axis=1)
