"""Random Fourier features of a whole trajectory."""

import math

import torch
from torch import Tensor

from ...core.arrays import FloatArray
from .components import PrincipalComponents
from .rows import Rows

# Draws from which the median distance is taken.
_MEDIAN_DRAWS = 500
# Degrees of freedom over two of the Matern kernel's spectral density, Student's t: Matern 5/2.
_SMOOTHNESS = 2.5


class FourierRows(Rows):
    """``phi(x) = sqrt(2/M) [cos(w_m^T y / s), sin(w_m^T y / s)]`` of M/2 frequencies, y what another kind reads of x.

    ``phi(x)^T phi(x')`` approximates a kernel of the distance between trajectories (Rahimi and Recht 2007): the RBF
    kernel for normal w; the Matern 5/2 kernel for Student's t with 5 degrees of freedom, its spectral density. The
    length s is ``bandwidth`` times the median distance between training draws, so it needs no units.

    Args:
        source: what the features are taken of; its rows are centred and projected on principal components first,
            which keeps distances and leaves noise out.
        blocks: its rows of the training draws.
        features: M, an even number is rounded down to.
        kernel: ``"rbf"`` or ``"matern"``.
        bandwidth: in median distances.
        principal: principal components kept; 0 for the rows as they are.
        generator: source of the frequencies.
    """

    def __init__(
        self,
        source: Rows,
        blocks: list[Tensor],
        features: int,
        kernel: str,
        bandwidth: float,
        principal: int,
        generator: torch.Generator,
    ) -> None:
        rows = torch.cat(blocks, dim=1)
        self.source, self.center = source, rows.mean(0)
        self.components = PrincipalComponents(rows - self.center, None, principal) if principal else None
        projected = self._projected(rows)
        part = projected[:: -(-len(rows) // _MEDIAN_DRAWS)]
        median = torch.pdist(part).median().clamp(min=1e-6)
        half = max(1, features // 2)
        frequencies = torch.randn(projected.shape[1], half, generator=generator, dtype=torch.float64)
        if kernel == "matern":
            # t = normal / sqrt(chi^2_k / k); chi^2_k as a sum of k squared normals, k = 2 nu.
            k = round(2 * _SMOOTHNESS)
            chi = torch.randn(k, half, generator=generator, dtype=torch.float64).square().sum(0)
            frequencies = frequencies / (chi / k).sqrt()
        self.frequencies = frequencies / (bandwidth * median)

    def _projected(self, rows: Tensor) -> Tensor:
        centred = rows - self.center
        return centred if self.components is None else self.components.scores(centred)

    def of(self, blocks: list[Tensor]) -> list[Tensor]:
        """Rows of the source to features ``(N, M)``."""
        phase = self._projected(torch.cat(blocks, dim=1)) @ self.frequencies
        scale = math.sqrt(1.0 / self.frequencies.shape[1])
        return [scale * torch.cat([torch.cos(phase), torch.sin(phase)], dim=1)]

    def __call__(self, x: list[FloatArray]) -> list[Tensor]:
        return self.of(self.source(x))
