"""A compact instance network (after Panoptic-DeepLab [Cheng 2020]).

Beside the class scores it gives, at stride 4, a heat map of object centres a class and for each pixel the offset to the
centre of its object. Pixels are grouped by the centre they point at; no boxes, no proposals, any number of objects.
"""

import torch
from torch import nn

from .backbones import features
from .backbones.edge import conv_norm
from .u_net import Decoder, SegmentationHead

STRIDE = 4
OFFSET_UNIT = 64.0
"""Pixels: the network regresses offsets in this unit, so that its outputs are of order one."""
RARE = -4.6
"""Score of a centre at the start: a probability of 1 % [Lin 2017], since centres are rare."""


class InstanceNet(nn.Module):
    """[N, C, H, W] to class scores [N, K, H, W], centres [N, K, H/4, W/4] in 0..1 and offsets (x, y) in pixels."""

    outputs = ("centres", "offsets")

    def __init__(self, stem: nn.Module, backbone: nn.Module, classes: int):
        super().__init__()
        self.stem, self.backbone = stem, backbone
        self.decoder = Decoder(backbone)
        self.head = SegmentationHead(self.decoder.channels, classes, self.decoder.stride)
        self.level = backbone.strides.index(STRIDE)
        self.instance_decoder = Decoder(backbone, last=self.level)
        width = self.instance_decoder.channels
        self.centres = nn.Sequential(conv_norm(width, width), nn.ReLU(), nn.Conv2d(width, classes, 1))
        self.offsets = nn.Sequential(conv_norm(width, width), nn.ReLU(), nn.Conv2d(width, 2, 1))
        nn.init.constant_(self.centres[-1].bias, RARE)

    def forward(self, x):
        maps = features(self.backbone, self.stem(x))
        shared = self.instance_decoder(maps[self.level :])
        centre_logits = self.centres(shared)
        return {
            "logits": self.head(self.decoder(maps)),
            "centre_logits": centre_logits,
            "centres": centre_logits.sigmoid(),
            "offsets": self.offsets(shared) * OFFSET_UNIT,
        }


def instance_targets(instances, labels, classes: int, sigma: float = 2.0):
    """Targets from instance numbers and class labels [N, H, W] (0 = none).

    Returns centre heat maps [N, K, h, w] with a Gaussian of `sigma` cells at every object's centre of gravity, offsets
    [N, 2, h, w] in pixels and the mask [N, 1, h, w] of cells that belong to an object; h = H / 4.
    """
    count, height, width = labels.shape
    rows = torch.arange(height // STRIDE, dtype=torch.float32) * STRIDE + (STRIDE - 1) / 2
    columns = torch.arange(width // STRIDE, dtype=torch.float32) * STRIDE + (STRIDE - 1) / 2
    heat = torch.zeros(count, classes, len(rows), len(columns))
    offsets = torch.zeros(count, 2, len(rows), len(columns))
    coarse = instances[:, STRIDE // 2 :: STRIDE, STRIDE // 2 :: STRIDE]
    for n in range(count):
        for instance in torch.unique(instances[n]).tolist():
            if instance == 0:
                continue
            inside = instances[n] == instance
            y, x = (axis.float().mean() for axis in torch.nonzero(inside, as_tuple=True))
            label = int(labels[n][inside].long().mode().values)
            distance2 = (rows[:, None] - y) ** 2 + (columns[None, :] - x) ** 2
            bump = torch.exp(-distance2 / (2 * (sigma * STRIDE) ** 2))
            heat[n, label] = torch.maximum(heat[n, label], bump)
            cells = coarse[n] == instance
            offsets[n, 0] = torch.where(cells, (x - columns)[None, :].expand_as(cells), offsets[n, 0])
            offsets[n, 1] = torch.where(cells, (y - rows)[:, None].expand_as(cells), offsets[n, 1])
    return heat, offsets, (coarse > 0).unsqueeze(1).float()
