"""From a recipe to a network.

Every network maps a picture [N, C, H, W] to a dictionary of tensors: `logits` [N, K, H, W] always, others by kind.
"""

from torch import nn

from ..errors import TrainingError
from ..recipe import Recipe
from .backbones import make_backbone
from .fcn import Fcn
from .fusion import FUSIONS
from .instance import InstanceNet
from .stems import ColourStem, GeometryStem, StackedStem
from .two_stream import TwoStream
from .u_net import UNet
from .ud_net import ud_net

ONE_ENCODER = {"u-net": UNet, "fcn": Fcn, "instance": InstanceNet}


def make_network(recipe: Recipe, classes: int) -> nn.Module:
    """The recipe's network with random weights; `classes` counts `none`."""
    network = recipe.network
    near, far = recipe.data.near, recipe.data.far
    kind = network.architecture
    if network.head == "fine":
        if kind != "u-net" or network.backbone == "vgg16":
            raise TrainingError("network.head: 'fine' is for a u-net whose backbone begins at half resolution")
        stem = _stem(recipe)
        return UNet(stem, make_backbone(network.backbone, stem.channels), classes, fine=True)
    if kind in ONE_ENCODER:
        stem = _stem(recipe)
        return ONE_ENCODER[kind](stem, make_backbone(network.backbone, stem.channels), classes)
    if kind == "ud-net":
        _need_both(recipe)
        if network.fusion not in ("early", *FUSIONS):
            raise TrainingError(f"network.fusion: '{network.fusion}' is not early or one of {', '.join(FUSIONS)}")
        return ud_net(network.backbone, network.fusion, classes, near, far)
    if kind == "two-stream":
        _need_both(recipe)
        if network.stream not in ("u-net", "fcn"):
            raise TrainingError(f"network.stream: '{network.stream}' is not u-net or fcn")
        streams = [
            ONE_ENCODER[network.stream](stem, make_backbone(network.backbone, stem.channels), classes)
            for stem in (ColourStem(), GeometryStem(near, far))
        ]
        return TwoStream(*streams, classes)
    if kind in ("mask-rcnn", "md-net"):
        from .md_net import md_net  # torchvision's detection module takes a second to import

        return md_net(recipe, classes)
    raise TrainingError(f"network.architecture: '{kind}' is not known")


def _stem(recipe: Recipe) -> nn.Module:
    if not recipe.uses_depth:
        return ColourStem()
    kind = StackedStem if recipe.uses_colour else GeometryStem
    return kind(recipe.data.near, recipe.data.far)


def _need_both(recipe: Recipe) -> None:
    if not (recipe.uses_colour and recipe.uses_depth):
        raise TrainingError(f"data.channels: a {recipe.network.architecture} sees colour and depth")
