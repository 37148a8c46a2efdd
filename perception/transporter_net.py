"""The network of Transporter: features, keypoints, and a picture from transported features.

References:
    Kulkarni et al., *Unsupervised Learning of Object Keypoints for Perception and Control*, 2019.
    Jakab, Gupta, Bilen and Vedaldi, *Unsupervised learning of object landmarks through conditional image generation*,
    2018: heatmaps by spatial softmax.
"""

import torch
from torch import Tensor, nn

#: Standard deviation of a keypoint's Gaussian, in halves of the picture's width and height. Narrower ones (0.07, 0.1)
#: reach too little of the picture to be drawn to what moves: more often a heatmap then keeps to one place.
SPREAD = 0.15
#: Pixels of the working picture along a cell of the feature map.
STRIDE = 4


class Transporter(nn.Module):
    """Reconstructs a target picture from a source picture and the target's features at the keypoints.

    Args:
        keypoints: K.
        width: channels of the first layer; the feature map has four times as many.
    """

    def __init__(self, keypoints: int, width: int = 16) -> None:
        super().__init__()
        deep = 4 * width
        self.features = _encoder(width)
        self.detector = nn.Sequential(_encoder(width), nn.Conv2d(deep, keypoints, 1))
        self.refiner = nn.Sequential(
            _layer(deep, deep),
            nn.Upsample(scale_factor=2.0, mode="bilinear"),
            _layer(deep, 2 * width),
            nn.Upsample(scale_factor=2.0, mode="bilinear"),
            _layer(2 * width, width),
            nn.Conv2d(width, 3, 3, padding=1),
        )

    def forward(self, source: Tensor, target: Tensor) -> Tensor:
        """The target ``(B, 3, H, W)`` reconstructed; both pictures are 0 to 1, H and W multiples of 4."""
        with torch.no_grad():  # as in the publication nothing is learned through the source
            moved = self.features(source)
            there = gaussians(self.locate(source)[0], moved.shape[2:])
        features, heat = self.features(target), gaussians(self.locate(target)[0], moved.shape[2:])
        for k in range(heat.shape[1]):
            before, after = there[:, k, None], heat[:, k, None]
            moved = (1.0 - before) * (1.0 - after) * moved + after * features
        return torch.as_tensor(self.refiner(moved))

    def locate(self, pictures: Tensor) -> tuple[Tensor, Tensor]:
        """Places ``(B, K, 2)`` of the keypoints, right and down from -1 to 1, and how sure they are ``(B, K)``.

        Sure is the share of a keypoint's heatmap that lies within two standard deviations of its Gaussian: near 1 for
        one peak, the share of that disc in the picture, 0.07, for a flat map.
        """
        logits = self.detector(pictures)
        rows, columns = logits.shape[2:]
        heat = torch.softmax(logits.flatten(2), dim=2).reshape(logits.shape)
        v, u = _centres(rows, heat), _centres(columns, heat)
        places = torch.stack([(heat.sum(2) * u).sum(2), (heat.sum(3) * v).sum(2)], dim=2)
        apart = (u[None, None, None] - places[..., 0, None, None]) ** 2
        apart = apart + (v[None, None, :, None] - places[..., 1, None, None]) ** 2
        return places, (heat * (apart < (2.0 * SPREAD) ** 2)).sum(dim=(2, 3))


def gaussians(places: Tensor, shape: torch.Size) -> Tensor:
    """Heatmaps ``(B, K, *shape)`` with a peak of 1 at ``places (B, K, 2)``."""
    u, v = _centres(shape[1], places), _centres(shape[0], places)
    across = torch.exp(-0.5 * ((u - places[..., :1]) / SPREAD) ** 2)
    down = torch.exp(-0.5 * ((v - places[..., 1:]) / SPREAD) ** 2)
    return down[..., :, None] * across[..., None, :]


def _centres(count: int, like: Tensor) -> Tensor:
    """Centres of ``count`` cells from -1 to 1."""
    return (torch.arange(count, dtype=like.dtype, device=like.device) + 0.5) * (2.0 / count) - 1.0


def _encoder(width: int) -> nn.Sequential:
    return nn.Sequential(
        _layer(3, width, size=5, stride=2),
        _layer(width, 2 * width),
        _layer(2 * width, 2 * width, stride=2),
        _layer(2 * width, 4 * width),
    )


def _layer(inside: int, outside: int, size: int = 3, stride: int = 1) -> nn.Sequential:
    # zeros around the picture would make its edge the most telling place of all
    convolution = nn.Conv2d(inside, outside, size, stride, size // 2, bias=False, padding_mode="replicate")
    return nn.Sequential(convolution, nn.BatchNorm2d(outside), nn.ReLU(inplace=True))
