"""VGG16 [Simonyan 2015] as the U-Net of [Remanufacturing paper] uses it: five levels at strides 1 to 16."""

from torch import nn
from torchvision.models import vgg16_bn


class Vgg16(nn.Module):
    """The 13 convolutions with batch normalisation; a pooling layer opens each level but the first."""

    channels = (64, 128, 256, 512, 512)
    strides = (1, 2, 4, 8, 16)
    decoder = "double"

    def __init__(self, in_channels: int):
        super().__init__()
        layers = list(vgg16_bn(weights=None).features)
        pools = [i for i, layer in enumerate(layers) if isinstance(layer, nn.MaxPool2d)]
        if in_channels != 3:
            layers[0] = nn.Conv2d(in_channels, 64, 3, padding=1)
        starts, ends = [0, *pools[:-1]], pools
        self.stages = nn.ModuleList(nn.Sequential(*layers[a:b]) for a, b in zip(starts, ends))

    @staticmethod
    def from_torchvision(key: str) -> str | None:
        """Our name for a weight of torchvision's `vgg16_bn`; None for what a backbone has not."""
        if not key.startswith("features."):
            return None
        index, rest = key.removeprefix("features.").split(".", 1)
        for level, (start, end) in enumerate(((0, 6), (6, 13), (13, 23), (23, 33), (33, 43))):
            if start <= int(index) < end:
                return f"stages.{level}.{int(index) - start}.{rest}"
        return None
