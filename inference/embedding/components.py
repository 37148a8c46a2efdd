"""Principal components of high-dimensional rows, with rows that are only partly seen."""

import torch
from torch import Tensor

# The basis is found from at most this many draws (evenly spread over them); every draw is then projected onto it.
_BASIS_DRAWS = 1000


class PrincipalComponents:
    """The leading directions of centred rows, by the eigenvectors of their Gram matrix.

    A row that misses entries is not projected as if these were zero, which would shrink its scores towards the
    mean: its scores are their conditional expectation under probabilistic PCA (Tipping and Bishop 1999).

    Args:
        rows: ``(N, F)`` float64, centred; 0 where not seen (here and in all methods).
        seen: ``(N, F)`` or None when all entries are seen.
        count: at most this many directions.
    """

    def __init__(self, rows: Tensor, seen: Tensor | None, count: int) -> None:
        step = -(-len(rows) // _BASIS_DRAWS)
        part, mask = rows[::step], None if seen is None else seen[::step]
        self.basis, self.variance, self.noise = _decompose(part, count)
        if mask is not None and not bool(mask.all()):
            # Missing entries start at the mean; a few rounds of filling them in from the basis settle it.
            for _ in range(2):
                filled = torch.where(mask, part, self.scores(part, mask) @ self.basis.T)
                self.basis, self.variance, self.noise = _decompose(filled, count)

    def scores(self, rows: Tensor, seen: Tensor | None = None) -> Tensor:
        """``(N, F)`` rows to ``(N, k)`` scores."""
        scores = rows @ self.basis
        if seen is None:
            return scores
        identity = torch.eye(scores.shape[1], dtype=scores.dtype)
        for i in torch.nonzero(~seen.all(dim=1)).flatten().tolist():
            # The basis is orthonormal, so the part that was seen is one less the part that was not.
            lost = self.basis[~seen[i]]
            system = identity - lost.T @ lost + torch.diag(self.noise / self.variance)
            scores[i] = torch.linalg.solve(system, scores[i])
        return scores

    def complete(self, rows: Tensor, seen: Tensor) -> Tensor:
        """The rows with entries not seen filled in from those seen."""
        if bool(seen.all()):
            return rows
        return torch.where(seen, rows, self.scores(rows, seen) @ self.basis.T)


def _decompose(rows: Tensor, count: int) -> tuple[Tensor, Tensor, Tensor]:
    """Basis ``(F, k)``, variances ``(k,)`` of the scores, and the mean variance of an entry that is left over."""
    draws, entries = rows.shape
    values, vectors = torch.linalg.eigh(rows @ rows.T / draws)
    values, vectors = values.flip(0).clamp(min=0.0), vectors.flip(1)
    keep = int((values > 1e-10 * values[0].clamp(min=1e-20)).sum())
    keep = min(count, keep, entries) if float(values[0]) > 1e-20 else 0
    basis = rows.T @ (vectors[:, :keep] / (values[:keep] * draws).sqrt())
    left = values[keep:].sum() / max(entries - keep, 1)
    return basis, values[:keep], left.clamp(min=1e-8)
