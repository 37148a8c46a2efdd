"""Kernel ridge regression with leave-one-out predictions in closed form."""

import torch
from torch import Tensor

_WIDTHS = (0.0, 1.0, 2.0, 4.0, 8.0)  # in median distances; 0 stands for the linear kernel
_RIDGES = tuple(10.0**e for e in range(-6, 3))
# Kernels are chosen on at most this many draws, evenly spread; a decomposition of all is then made for those chosen.
_CHOOSING_DRAWS = 400


class KernelRidge:
    """Weighted kernel ridge regression, one kernel and ridge a target, chosen by leave-one-out error.

    Regression of parameters on embedded distributions is kernel "distribution regression" (Szabo et al. 2016); its
    prediction, an estimate of the posterior mean, is the summary statistic that loses least (Fearnhead and Prangle
    2012). :attr:`left_out` holds each draw's prediction by the regression that never saw it, in closed form
    (``y_i - alpha_i / (B^-1)_ii``), so that what is trained on it meets the errors that new data will have.

    Args:
        features: ``(N, F)``, standardised, float64.
        targets: ``(N, D)``.
        weights: ``(N,)`` above zero.
    """

    def __init__(self, features: Tensor, targets: Tensor, weights: Tensor) -> None:
        self.features = features
        self.offset = (weights[:, None] * targets).sum(0) / weights.sum()
        root = (weights / weights.mean()).sqrt()
        aim = (targets - self.offset) * root[:, None]
        step = -(-len(features) // _CHOOSING_DRAWS)
        part = features[::step]
        self.width = float(torch.cdist(part, part).median().clamp(min=1e-6))
        dim = targets.shape[1]
        self.kernels = [0.0] * dim
        best = torch.full((dim,), torch.inf, dtype=torch.float64)
        for width in _WIDTHS:
            score, _, _ = _left_out(self._kernel(part, part, width), aim[::step], root[::step])
            for j in torch.nonzero(score < best).flatten().tolist():
                best[j], self.kernels[j] = score[j], width
        self.score, self.dual, self.left_out = best, torch.zeros_like(targets), torch.zeros_like(targets)
        for width in set(self.kernels):
            columns = [j for j in range(dim) if self.kernels[j] == width]
            score, dual, error = _left_out(self._kernel(features, features, width), aim[:, columns], root)
            self.score[columns] = score
            self.dual[:, columns] = dual * root[:, None]
            self.left_out[:, columns] = targets[:, columns] - error / root[:, None]

    def _kernel(self, a: Tensor, b: Tensor, width: float) -> Tensor:
        if width == 0.0:
            return 1.0 + a @ b.T / max(b.shape[1], 1)
        squared = torch.cdist(a, b) ** 2 / (width * self.width) ** 2
        return torch.exp(-0.5 * squared)

    def predict(self, features: Tensor) -> Tensor:
        """``(B, F)`` features to ``(B, D)`` predictions."""
        columns = [self._kernel(features, self.features, w) @ self.dual[:, j] for j, w in enumerate(self.kernels)]
        return self.offset + torch.stack(columns, dim=1)


def _left_out(kernel: Tensor, aim: Tensor, root: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """Of the ridge with the smallest leave-one-out error, target by target: that error, dual weights, errors.

    Args:
        kernel: ``(N, N)``.
        aim: ``(N, d)`` targets times ``root``.
        root: ``(N,)`` square roots of the weights.
    """
    values, vectors = torch.linalg.eigh(root[:, None] * kernel * root[None, :])
    turned = vectors.T @ aim
    squared = vectors**2
    score = torch.full((aim.shape[1],), torch.inf, dtype=torch.float64)
    dual, error = torch.zeros_like(aim), torch.zeros_like(aim)
    for ridge in _RIDGES:
        inverse = 1.0 / (values.clamp(min=0.0) + ridge)
        alpha = vectors @ (inverse[:, None] * turned)
        missed = alpha / (squared @ inverse)[:, None]
        found = (missed**2).mean(0)
        better = found < score
        score = torch.where(better, found, score)
        dual, error = torch.where(better, alpha, dual), torch.where(better, missed, error)
    return score, dual, error
