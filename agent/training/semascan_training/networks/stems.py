"""From the channels of a picture to what a backbone sees: colour as it is, depth as local geometry."""

import torch
from torch import nn

from . import depth_stem
from .depth_stem import DepthStem

COLOUR_CHANNELS = 3


class ColourStem(nn.Module):
    """The three colour channels."""

    channels = COLOUR_CHANNELS

    def forward(self, x):
        return x[:, :COLOUR_CHANNELS]


class GeometryStem(nn.Module):
    """The depth channel, which is the last, as local geometry."""

    channels = depth_stem.CHANNELS

    def __init__(self, near: float, far: float):
        super().__init__()
        self.geometry = DepthStem(near, far)

    def forward(self, x):
        return self.geometry(x[:, -1:])


class StackedStem(nn.Module):
    """Early fusion ([Remanufacturing paper], Fig. 5): colour and depth stacked before the network."""

    channels = COLOUR_CHANNELS + depth_stem.CHANNELS

    def __init__(self, near: float, far: float):
        super().__init__()
        self.geometry = DepthStem(near, far)

    def forward(self, x):
        return torch.cat((x[:, :COLOUR_CHANNELS], self.geometry(x[:, -1:])), 1)
