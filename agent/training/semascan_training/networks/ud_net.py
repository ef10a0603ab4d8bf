"""UD-Net [Remanufacturing paper]: the U-Net with depth, by early, intermediate or late fusion."""

from torch import nn

from .backbones import make_backbone
from .fusion import FUSIONS, FusedEncoder
from .stems import ColourStem, GeometryStem, StackedStem
from .u_net import Decoder, SegmentationHead, UNet


class TwoEncoderUDNet(nn.Module):
    """Intermediate and late fusion: two encoders, one decoder. [N, 4, H, W] to class scores [N, K, H, W]."""

    def __init__(self, backbone: str, fusion: str, classes: int, near: float, far: float):
        super().__init__()
        mixer, intermediate = FUSIONS[fusion]
        self.colour_stem, self.depth_stem = ColourStem(), GeometryStem(near, far)
        self.encoder = FusedEncoder(
            make_backbone(backbone, self.colour_stem.channels),
            make_backbone(backbone, self.depth_stem.channels),
            mixer,
            intermediate,
        )
        self.decoder = Decoder(self.encoder)
        self.head = SegmentationHead(self.decoder.channels, classes, self.decoder.stride)

    def forward(self, x):
        maps = self.encoder(self.colour_stem(x), self.depth_stem(x))
        return {"logits": self.head(self.decoder(maps))}


def ud_net(backbone: str, fusion: str, classes: int, near: float, far: float) -> nn.Module:
    """The UD-Net with that fusion type."""
    if fusion == "early":
        stem = StackedStem(near, far)
        return UNet(stem, make_backbone(backbone, stem.channels), classes)
    return TwoEncoderUDNet(backbone, fusion, classes, near, far)
