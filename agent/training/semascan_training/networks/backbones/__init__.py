"""Encoders: a picture to feature maps of falling resolution.

A backbone is a module with `channels` (feature channels, finest level first), `strides` (of the same levels), `stages`
(one module a level, each fed with the one before) and `decoder` (the name of the decoder block that suits its size).
Stages are separate, so that fusion can happen between them.
"""

from collections.abc import Callable

from torch import nn

from ...errors import TrainingError
from .edge import Edge
from .resnet34 import ResNet34
from .vgg16 import Vgg16

BACKBONES: dict[str, Callable[[int], nn.Module]] = {"edge": Edge, "resnet34": ResNet34, "vgg16": Vgg16}


def make_backbone(name: str, in_channels: int) -> nn.Module:
    """The backbone of that name with randomly initialised weights."""
    if name not in BACKBONES:
        raise TrainingError(f"network.backbone: '{name}' is not one of {', '.join(BACKBONES)}")
    return BACKBONES[name](in_channels)


def features(backbone: nn.Module, x):
    """All feature maps of a picture [N, C, H, W], finest first."""
    maps = []
    for stage in backbone.stages:
        x = stage(x)
        maps.append(x)
    return maps
