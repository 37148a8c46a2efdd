"""Learning the time model: trained as a density of the parameters, then read for its features."""

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from ..embedding.encoder import Encoder
from ..embedding.rkhs import RKHSEmbedding
from ..embedding.time_model import TimeModel
from .mixture_head import MixtureHead
from .training import DensityNetwork, train

# Draws embedded at a time.
_CHUNK = 256
# Networks, each trained without its part of the draws.
_FOLDS = 3


@dataclass(frozen=True)
class TimePlan:
    """How the time model is made and learned.

    Args:
        kernel_features, bandwidth: of :class:`~..embedding.rkhs.RKHSEmbedding`.
        width, features: of :class:`~..embedding.time_model.TimeModel`.
        components: of the mixture it is trained under.
        frames, points: how many it sees of a recording and a frame, evenly spread; 0 for all.
        learning_rate, weight_decay, batch, max_epochs, patience: of :func:`~.training.train`.
    """

    kernel_features: int
    bandwidth: float
    width: int
    features: int
    components: int
    frames: int
    points: int
    learning_rate: float
    weight_decay: float
    batch: int
    max_epochs: int
    patience: int


class TimeNetwork(DensityNetwork):
    """The time model with a mixture density head. Inputs: the recordings' points, then their masks."""

    def __init__(self, model: TimeModel, head: MixtureHead) -> None:
        super().__init__()
        self.model, self.head = model, head

    def features(self, inputs: Sequence[Tensor]) -> Tensor:
        half = len(inputs) // 2
        out: Tensor = self.model(list(inputs[:half]), list(inputs[half:]))
        return out

    def log_prob(self, inputs: Sequence[Tensor], z: Tensor) -> Tensor:
        return self.head.log_prob(self.features(inputs), torch.zeros_like(z), z)


class TrajectoryFeatures:
    """What time models predict of the parameters from recordings: a mean and a log standard deviation of each.

    The posterior's mean is the summary that loses least (Fearnhead and Prangle 2012). Several networks each leave out
    a part of the draws and predict it, so that what is trained on the predictions meets the errors that new data will
    have; of new data, the mean of all networks' predictions is taken.

    Args:
        encoder: made from the training draws.
        points, seen: what it gives for them.
        target: ``(N, D)`` parameters in probit coordinates; weights: ``(N,)``.
        plan: how.
        generator: of all that is random.
        device: where it is trained.

    Attributes:
        training: ``(N, 2 D)`` of the training draws, each by the network that never saw it, float64.
        frames: ``(N, F)`` of the training draws: every frame's kernel mean under the layer of the first network.
    """

    def __init__(
        self,
        encoder: Encoder,
        points: list[Tensor],
        seen: list[Tensor],
        target: Tensor,
        weights: Tensor,
        plan: TimePlan,
        generator: torch.Generator,
        device: torch.device,
    ) -> None:
        self.encoder, self.plan = encoder, plan
        inputs, masks = encoder.coded(points, seen, plan.frames, plan.points)
        given, z, w = [*inputs, *masks], target.float(), weights.float()
        fold = torch.randperm(len(z), generator=generator) % _FOLDS
        self.networks = []
        self.training = torch.zeros(len(z), 2 * z.shape[1], dtype=torch.float64)
        for k in range(_FOLDS):
            layer = RKHSEmbedding(encoder.inputs, plan.kernel_features, plan.bandwidth, generator)
            head = MixtureHead(plan.features, z.shape[1], plan.components, z.std(0).clamp(min=1e-3))
            network = TimeNetwork(TimeModel(layer, len(points), plan.width, plan.features), head).to(device)
            kept = torch.nonzero(fold != k).flatten()
            held = torch.zeros(len(kept), dtype=torch.bool)
            held[: max(2, len(kept) // 10)] = True
            train(
                network, [t[kept].to(device) for t in given], z[kept].to(device), w[kept].to(device),
                held[torch.randperm(len(kept), generator=generator)].to(device), generator,
                learning_rate=plan.learning_rate, weight_decay=plan.weight_decay, batch=plan.batch,
                max_epochs=plan.max_epochs, patience=plan.patience,
            )  # fmt: skip
            self.networks.append(network.cpu())
            left = torch.nonzero(fold == k).flatten()
            self.training[left] = _predicted(network, [t[left] for t in given])
        self.frames = self._frames(points, seen)

    def _frames(self, points: list[Tensor], seen: list[Tensor]) -> Tensor:
        return self.encoder.embedded(self.networks[0].model.layer, points, seen, 0)

    def __call__(self, points: list[Tensor], seen: list[Tensor]) -> tuple[Tensor, Tensor]:
        """New encoded recordings to predictions ``(B, 2 D)`` and frames ``(B, F)``, float64."""
        inputs, masks = self.encoder.coded(points, seen, self.plan.frames, self.plan.points)
        each = [_predicted(network, [*inputs, *masks]) for network in self.networks]
        return torch.stack(each).mean(0), self._frames(points, seen)


def _predicted(network: TimeNetwork, given: list[Tensor]) -> Tensor:
    rows = []
    with torch.no_grad():
        for i in range(0, len(given[0]), _CHUNK):
            features = network.features([t[i : i + _CHUNK] for t in given])
            log_weights, means, factors = network.head(features, torch.zeros(len(features), network.head.dim))
            share = log_weights.exp().unsqueeze(-1)
            mean = (share * means).sum(1)
            within = torch.linalg.inv(factors).square().sum(-1)
            variance = (share * (within + (means - mean.unsqueeze(1)) ** 2)).sum(1)
            rows.append(torch.cat([mean, 0.5 * variance.log()], dim=1))
    return torch.cat(rows).double()
