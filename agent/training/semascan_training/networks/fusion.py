"""How a colour and a depth encoder are fused ([Remanufacturing paper], Fig. 5).

*Intermediate*: after every stage the fused features replace the colour branch's and pass on to its next stage.
*Late*: both encoders run to their end apart from each other; features meet in the skip connections only.
Either by adding features or by convolutions over both, one in the first and a small network in the second case.
"""

import torch
from torch import nn

from .backbones.edge import conv_norm


class Add(nn.Module):
    """Element-wise addition of two feature maps."""

    def __init__(self, channels: int):
        super().__init__()

    def forward(self, colour, depth):
        return colour + depth


class Convolve(nn.Module):
    """A 1x1 convolution over both feature maps."""

    def __init__(self, channels: int):
        super().__init__()
        self.mix = nn.Sequential(conv_norm(2 * channels, channels, 1), nn.ReLU())

    def forward(self, colour, depth):
        return self.mix(torch.cat((colour, depth), 1))


class Network(nn.Module):
    """A small network over both feature maps: 1x1, then 3x3."""

    def __init__(self, channels: int):
        super().__init__()
        self.mix = nn.Sequential(
            conv_norm(2 * channels, channels, 1), nn.ReLU(), conv_norm(channels, channels), nn.ReLU()
        )

    def forward(self, colour, depth):
        return self.mix(torch.cat((colour, depth), 1))


class FusedEncoder(nn.Module):
    """Two encoders as one: colour [N, 3, H, W] and geometry [N, 5, H, W] to fused feature maps, finest first."""

    def __init__(self, colour: nn.Module, depth: nn.Module, mixer: type[nn.Module], intermediate: bool):
        super().__init__()
        self.channels, self.strides, self.decoder = colour.channels, colour.strides, colour.decoder
        self.colour, self.depth = colour, depth
        self.mixers = nn.ModuleList(mixer(channels) for channels in colour.channels)
        self.intermediate = intermediate

    def forward(self, colour, depth):
        maps = []
        for colour_stage, depth_stage, mixer in zip(self.colour.stages, self.depth.stages, self.mixers):
            colour, depth = colour_stage(colour), depth_stage(depth)
            maps.append(mixer(colour, depth))
            if self.intermediate:
                colour = maps[-1]
        return maps


# Fusion type -> (mixer, intermediate); early fusion has one encoder and no mixer.
FUSIONS: dict[str, tuple[type[nn.Module], bool]] = {
    "intermediate-add": (Add, True),
    "intermediate-conv": (Convolve, True),
    "late-add": (Add, False),
    "late-network": (Network, False),
}
