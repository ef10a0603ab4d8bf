"""ResNet34 [He 2016]: five levels at strides 2 to 32."""

from torch import nn
from torchvision.models import resnet34


class ResNet34(nn.Module):
    """Stem and the four residual stages; the pooling layer opens the second level."""

    channels = (64, 64, 128, 256, 512)
    strides = (2, 4, 8, 16, 32)
    decoder = "double"

    def __init__(self, in_channels: int):
        super().__init__()
        whole = resnet34(weights=None)
        if in_channels != 3:
            whole.conv1 = nn.Conv2d(in_channels, 64, 7, 2, 3, bias=False)
        stem = nn.Sequential(whole.conv1, whole.bn1, whole.relu)
        first = nn.Sequential(whole.maxpool, *whole.layer1)
        self.stages = nn.ModuleList([stem, first, whole.layer2, whole.layer3, whole.layer4])

    @staticmethod
    def from_torchvision(key: str) -> str | None:
        """Our name for a weight of torchvision's `resnet34`; None for what a backbone has not."""
        head, _, rest = key.partition(".")
        if head in ("conv1", "bn1"):
            return f"stages.0.{('conv1', 'bn1').index(head)}.{rest}"
        if head == "layer1":
            block, tail = rest.split(".", 1)
            return f"stages.1.{int(block) + 1}.{tail}"
        if head in ("layer2", "layer3", "layer4"):
            return f"stages.{int(head[-1])}.{rest}"
        return None
