"""Kernel ridge regression with leave-one-out predictions in closed form."""

import torch
from torch import Tensor

_WIDTHS = (0.0, 1.0, 2.0, 4.0, 8.0)  # in median distances; 0 stands for the linear kernel
_RIDGES = tuple(10.0**e for e in range(-6, 3))


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
        distance = torch.cdist(features, features)
        self.width = float(distance.median().clamp(min=1e-6))
        self.score = torch.full((targets.shape[1],), torch.inf, dtype=torch.float64)
        self.kernels = [0.0] * targets.shape[1]
        self.dual = torch.zeros_like(targets)
        self.left_out = torch.zeros_like(targets)
        for width in _WIDTHS:
            kernel = self._kernel(features, width)
            values, vectors = torch.linalg.eigh(root[:, None] * kernel * root[None, :])
            turned = vectors.T @ aim
            for ridge in _RIDGES:
                inverse = 1.0 / (values.clamp(min=0.0) + ridge)
                dual = vectors @ (inverse[:, None] * turned)
                error = dual / ((vectors**2) @ inverse)[:, None]
                score = (error**2).mean(0)
                for j in range(targets.shape[1]):
                    if score[j] < self.score[j]:
                        self.score[j], self.kernels[j] = score[j], width
                        self.dual[:, j] = dual[:, j] * root
                        self.left_out[:, j] = targets[:, j] - error[:, j] / root

    def _kernel(self, a: Tensor, width: float) -> Tensor:
        if width == 0.0:
            return 1.0 + a @ self.features.T / max(self.features.shape[1], 1)
        squared = torch.cdist(a, self.features) ** 2 / (width * self.width) ** 2
        return torch.exp(-0.5 * squared)

    def predict(self, features: Tensor) -> Tensor:
        """``(B, F)`` features to ``(B, D)`` predictions."""
        columns = [self._kernel(features, w) @ self.dual[:, j] for j, w in enumerate(self.kernels)]
        return self.offset + torch.stack(columns, dim=1)
