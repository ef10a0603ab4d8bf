"""FCN-8s [Long 2015], a baseline of [Wang 2023], Table 4: scores at strides 8, 16 and 32, added and interpolated."""

from torch import nn

from .backbones import features
from .u_net import upsample

FINEST_STRIDE = 8


class Fcn(nn.Module):
    """[N, C, H, W] to class scores [N, K, H, W], without a decoder."""

    def __init__(self, stem: nn.Module, backbone: nn.Module, classes: int):
        super().__init__()
        self.stem, self.backbone = stem, backbone
        self.first = next(i for i, stride in enumerate(backbone.strides) if stride >= FINEST_STRIDE)
        self.stride = backbone.strides[self.first]
        self.scores = nn.ModuleList(nn.Conv2d(c, classes, 1) for c in backbone.channels[self.first :])

    def forward(self, x):
        maps = features(self.backbone, self.stem(x))[self.first :]
        scores = self.scores[-1](maps[-1])
        for layer, features_ in zip(reversed(self.scores[:-1]), reversed(maps[:-1])):
            scores = upsample(scores) + layer(features_)
        return {"logits": upsample(scores, float(self.stride))}
