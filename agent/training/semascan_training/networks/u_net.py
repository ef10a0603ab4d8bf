"""U-Net [Ronneberger 2015]: an encoder, a decoder with skip connections, a pixel-wise classifier."""

import torch
from torch import nn
from torch.nn import functional as F

from .backbones import features
from .backbones.edge import conv_norm


def upsample(x, factor: float = 2.0):
    """Bilinear, by a fixed factor, so that an exported graph takes any size."""
    return x if factor == 1 else F.interpolate(x, scale_factor=factor, mode="bilinear", align_corners=False)


class DoubleStep(nn.Module):
    """The paper's decoder step: up-convolution, concatenation with the skip, two 3x3 convolutions."""

    def __init__(self, coarse: int, skip: int, outside: int):
        super().__init__()
        self.up = nn.ConvTranspose2d(coarse, outside, 2, 2)
        self.convolutions = nn.Sequential(
            conv_norm(outside + skip, outside), nn.ReLU(), conv_norm(outside, outside), nn.ReLU()
        )

    def forward(self, x, skip):
        return self.convolutions(torch.cat((self.up(x), skip), 1))


class CompactStep(nn.Module):
    """A decoder step for processors: both sides narrowed first, then added, then one 3x3 convolution."""

    def __init__(self, coarse: int, skip: int, outside: int):
        super().__init__()
        self.narrow = conv_norm(coarse, outside, 1)
        self.lateral = conv_norm(skip, outside, 1)
        self.convolution = conv_norm(outside, outside)

    def forward(self, x, skip):
        return F.relu(self.convolution(F.relu(upsample(self.narrow(x)) + self.lateral(skip))))


STEPS = {"double": DoubleStep, "compact": CompactStep}
WIDTH_LIMIT = {"double": 256, "compact": 64}


class Decoder(nn.Module):
    """From feature maps, finest first, back to the finest one's resolution; `last` stops at a coarser level."""

    def __init__(self, backbone: nn.Module, last: int = 0):
        super().__init__()
        channels, limit = backbone.channels, WIDTH_LIMIT[backbone.decoder]
        steps, coarse = [], channels[-1]
        for skip in reversed(channels[last:-1]):
            outside = min(skip, limit)
            steps.append(STEPS[backbone.decoder](coarse, skip, outside))
            coarse = outside
        self.steps = nn.ModuleList(steps)
        self.channels = coarse
        self.stride = backbone.strides[last]

    def forward(self, maps):
        x = maps[-1]
        for step, skip in zip(self.steps, reversed(maps[:-1])):
            x = step(x, skip)
        return x


class SegmentationHead(nn.Module):
    """Class scores at the decoder's resolution, interpolated to the picture's."""

    def __init__(self, inside: int, classes: int, stride: int):
        super().__init__()
        self.scores = nn.Conv2d(inside, classes, 1)
        self.stride = stride

    def forward(self, decoded, picture=None):
        return upsample(self.scores(decoded), float(self.stride))


class FineHead(nn.Module):
    """Scores for every pixel from features at half resolution: four sets, dealt out to the pixels of a 2x2 cell.

    For what is finer than the decoder, as rust and cracks are (interpolated scores cannot exceed an IoU of 0.9 and 0.35
    there). The picture's own 2x2 cells join the decoder's features, since the encoder's first layer smooths them.
    """

    CELL = 2
    WIDTH = 32

    def __init__(self, inside: int, picture_channels: int, classes: int):
        super().__init__()
        self.cells = nn.Sequential(conv_norm(picture_channels, inside, self.CELL, self.CELL, padding=0), nn.ReLU())
        self.mix = nn.Sequential(conv_norm(2 * inside, self.WIDTH), nn.ReLU())
        self.scores = nn.Conv2d(self.WIDTH, classes * self.CELL**2, 1)
        self.deal = nn.PixelShuffle(self.CELL)

    def forward(self, decoded, picture):
        return self.deal(self.scores(self.mix(torch.cat((decoded, self.cells(picture)), 1))))


class UNet(nn.Module):
    """[N, C, H, W] to class scores [N, K, H, W]; `stem` prepares the picture for the backbone."""

    def __init__(self, stem: nn.Module, backbone: nn.Module, classes: int, fine: bool = False):
        super().__init__()
        self.stem = stem
        self.backbone = backbone
        self.decoder = Decoder(backbone)
        if fine:
            self.head = FineHead(self.decoder.channels, stem.channels, classes)
        else:
            self.head = SegmentationHead(self.decoder.channels, classes, self.decoder.stride)

    def forward(self, x):
        picture = self.stem(x)
        return {"logits": self.head(self.decoder(features(self.backbone, picture)), picture)}
