"""MD-Net [Remanufacturing paper]: Mask R-CNN with depth, by early, intermediate or late fusion; without: M-Net."""

from torch import nn

from ..errors import TrainingError
from ..recipe import Recipe
from .backbones import features, make_backbone
from .fusion import FUSIONS, FusedEncoder
from .mask_rcnn import COMPACT, PUBLISHED, MaskRcnn, Size, make_pyramid, named, pyramid_levels
from .stems import ColourStem, GeometryStem, StackedStem


class OneEncoder(nn.Module):
    """Colour alone, or early fusion."""

    def __init__(self, stem: nn.Module, backbone: nn.Module, size: Size):
        super().__init__()
        self.stem, self.backbone, self.pyramid = stem, backbone, make_pyramid(backbone, size)
        self.out_channels = size.pyramid
        self.levels = pyramid_levels(backbone)

    def forward(self, x):
        maps = features(self.backbone, self.stem(x))
        return self.pyramid(named([maps[i] for i in self.levels]))


class FusedBeforePyramid(nn.Module):
    """Intermediate fusion: one pyramid over the fused features of two encoders."""

    def __init__(self, stems: tuple[nn.Module, nn.Module], encoder: FusedEncoder, size: Size):
        super().__init__()
        self.colour_stem, self.depth_stem = stems
        self.encoder, self.pyramid = encoder, make_pyramid(encoder, size)
        self.out_channels = size.pyramid
        self.levels = pyramid_levels(encoder)

    def forward(self, x):
        maps = self.encoder(self.colour_stem(x), self.depth_stem(x))
        return self.pyramid(named([maps[i] for i in self.levels]))


class FusedAfterPyramid(nn.Module):
    """Late fusion: colour and depth apart from each other up to the end of their pyramids."""

    def __init__(self, colour: OneEncoder, depth: OneEncoder, mixer: type[nn.Module]):
        super().__init__()
        self.colour, self.depth, self.levels = colour, depth, colour.levels
        self.out_channels = colour.out_channels
        self.mixers = nn.ModuleList(mixer(self.out_channels) for _ in range(len(self.levels) + 1))

    def forward(self, x):
        colour, depth = self.colour(x), self.depth(x)
        return type(colour)((name, mix(colour[name], depth[name])) for mix, name in zip(self.mixers, colour))


def md_net(recipe: Recipe, classes: int) -> MaskRcnn:
    """The recipe's Mask R-CNN or MD-Net."""
    fusion, backbone = recipe.network.fusion, recipe.network.backbone
    near, far = recipe.data.near, recipe.data.far
    size = COMPACT if backbone == "edge" else PUBLISHED
    if recipe.network.architecture == "mask-rcnn" or fusion == "early":
        stem = StackedStem(near, far) if recipe.uses_depth else ColourStem()
        body = OneEncoder(stem, make_backbone(backbone, stem.channels), size)
    elif fusion in FUSIONS:
        mixer, intermediate = FUSIONS[fusion]
        stems = ColourStem(), GeometryStem(near, far)
        encoders = [make_backbone(backbone, stem.channels) for stem in stems]
        if intermediate:
            body = FusedBeforePyramid(stems, FusedEncoder(*encoders, mixer, intermediate), size)
        else:
            body = FusedAfterPyramid(*(OneEncoder(s, e, size) for s, e in zip(stems, encoders)), mixer)
    else:
        raise TrainingError(f"network.fusion: '{fusion}' is not early or one of {', '.join(FUSIONS)}")
    return MaskRcnn(body, len(body.levels), len(recipe.data.channels), classes, size)
