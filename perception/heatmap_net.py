"""The network of ``heatmap``: ResNet-34, and a light head that draws one heatmap a keypoint."""

import math

import torch
from torch import Tensor, nn
from torch.nn import functional

#: Pixels of the picture to a cell of the heatmap.
STRIDE = 2
#: The picture's sides are multiples of this, so that every halving of them is even.
MULTIPLE = 32
#: Feature maps of ResNet-34, at strides 2, 4, 8, 16 and 32.
_CHANNELS = (64, 64, 128, 256, 512)
_WIDTH = 64
#: On a heatmap of so many cells a keypoint is seen as likely as not before anything is learned.
_CELLS = 32.0**2


class HeatmapNet(nn.Module):
    """Pictures to heatmaps that sum to one over a picture where the keypoint is seen, and to zero where it is not.

    The head adds up the feature maps of every stride from coarse to fine. A heatmap is a softmax over the cells and
    one more place, "not seen", whose logit is zero; so an empty heatmap can be learned as any other.

    Args:
        keypoints: K.
        stages: of the backbone's four; three leave out the one that sees a small picture as a handful of cells, and
            with it most of the weights.

    References:
        He et al., *Deep Residual Learning for Image Recognition*, 2016 (the backbone, from MONAI).
        Lin et al., *Feature Pyramid Networks for Object Detection*, 2017 (the head).
    """

    def __init__(self, keypoints: int, stages: int = 4) -> None:
        from monai.networks.nets.resnet import ResNetFeatures

        super().__init__()
        self.backbone = ResNetFeatures("resnet34", pretrained=False, spatial_dims=2, in_channels=3)
        if stages == 3:
            self.backbone.layer4 = nn.Sequential()  # passes on what it is given
        self.stages = stages
        self.lateral = nn.ModuleList(nn.Conv2d(c, _WIDTH, 1) for c in _CHANNELS[: 1 + stages])
        self.smooth = nn.Sequential(
            nn.Conv2d(_WIDTH, _WIDTH, 3, padding=1, bias=False), nn.BatchNorm2d(_WIDTH), nn.ReLU(inplace=True)
        )
        self.draw = nn.Conv2d(_WIDTH, keypoints, 1)
        nn.init.normal_(self.draw.weight, std=0.01)
        assert self.draw.bias is not None
        nn.init.constant_(self.draw.bias, -math.log(_CELLS))

    def forward(self, pictures: Tensor) -> Tensor:
        """Logits ``(N, K, H / 2, W / 2)`` of pictures ``(N, 3, H, W)`` from 0 to 1; sides are multiples of 32."""
        maps = self.backbone((pictures - 0.5) / 0.25)[: 1 + self.stages]
        total: Tensor = self.lateral[-1](maps[-1])
        for features, squeeze in zip(maps[-2::-1], list(self.lateral)[-2::-1], strict=True):
            finer = functional.interpolate(total, size=features.shape[2:], mode="bilinear", align_corners=False)
            total = finer + squeeze(features)
        drawn: Tensor = self.draw(self.smooth(total))
        return drawn


def log_shares(logits: Tensor) -> Tensor:
    """Logarithms of the shares ``(N, K, h w + 1)`` of every cell, row by row, and last of "not seen"."""
    flat = logits.flatten(2)
    return torch.log_softmax(torch.cat([flat, torch.zeros_like(flat[..., :1])], dim=2), dim=2)
