"""Mask R-CNN [He 2017] by torchvision, on any of our encoders, as a network that also gives class probabilities.

Pyramid and heads are normalised, as in torchvision's second version, and while it is trained the finest map of the
pyramid is asked for every pixel's class as well, as in Hybrid Task Cascade [Chen 2019]: both let it learn from
few pictures. torchvision's own resizing and normalisation are switched off: the picture comes as the manifest says.
Detections are turned into probabilities a pixel (the best score times mask of each class, the rest is background), so
that everything that reads semantic networks reads this one too; boxes, labels, scores and masks are given beside them.
"""

from collections import OrderedDict
from dataclasses import dataclass
from typing import ClassVar

import torch
from torch import nn
from torch.nn import functional as F
from torchvision.models.detection import MaskRCNN
from torchvision.models.detection.anchor_utils import AnchorGenerator
from torchvision.models.detection.faster_rcnn import FastRCNNConvFCHead, FastRCNNPredictor
from torchvision.models.detection.mask_rcnn import MaskRCNNHeads, MaskRCNNPredictor
from torchvision.models.detection.roi_heads import RoIHeads
from torchvision.models.detection.rpn import RegionProposalNetwork, RPNHead
from torchvision.models.detection.transform import GeneralizedRCNNTransform
from torchvision.ops import FeaturePyramidNetwork, MultiScaleRoIAlign, masks_to_boxes
from torchvision.ops.feature_pyramid_network import LastLevelMaxPool

from ..dataset.samples import IGNORE
from .unknown_boxes import leave_out_unknown

FINEST_STRIDE = 4
SMALLEST_ANCHOR = 16
BOX_CELLS, MASK_CELLS = 7, 14
"""Side of the grid that a proposal's features are sampled on."""
DETECTIONS = 20
LEAST_KNOWN = 0.5
"""Share of a picture without objects that has to be known."""
TINY = 1e-6


@dataclass(frozen=True)
class Size:
    """How wide what follows the encoder is, and how many proposals it looks at."""

    pyramid: int = 256  # channels, of the mask head as well
    box_layers: int = 4  # convolutions of the box head
    box: int = 1024  # width of its last layer
    candidates: int = 2000  # proposals a level, half of it at inference
    sampled: int = 512  # proposals of one image that the heads learn from
    on_objects: float = 0.25  # the share of them that lies on objects


PUBLISHED = Size()
"""Torchvision's, for encoders like its own."""
COMPACT = Size(pyramid=48, box_layers=2, box=128, candidates=400, sampled=96, on_objects=0.33)
"""For the compact backbone: half a million parameters."""


def pyramid_levels(encoder: nn.Module) -> list[int]:
    """The encoder's levels that the pyramid uses: stride 4 and coarser."""
    return [i for i, stride in enumerate(encoder.strides) if stride >= FINEST_STRIDE]


def make_pyramid(encoder: nn.Module, size: Size) -> FeaturePyramidNetwork:
    """A feature pyramid over those levels."""
    channels = [encoder.channels[i] for i in pyramid_levels(encoder)]
    return FeaturePyramidNetwork(channels, size.pyramid, LastLevelMaxPool(), nn.BatchNorm2d)


def named(maps: list[torch.Tensor]) -> "OrderedDict[str, torch.Tensor]":
    """Feature maps as torchvision wants them."""
    return OrderedDict((str(i), m) for i, m in enumerate(maps))


class ProposalHead(RPNHead):
    """Proposals in 32 bits whatever the layers compute in: 16 bits place a corner to a pixel or two only."""

    def forward(self, x):
        scores, deltas = super().forward(x)
        return [score.float() for score in scores], [delta.float() for delta in deltas]


class AsItIs(GeneralizedRCNNTransform):
    """Pictures keep their size and their normalisation; torchvision would enlarge them to 800 rows when it does not
    train."""

    def __init__(self, channels: int):
        super().__init__(0, 0, [0.0] * channels, [1.0] * channels)

    def resize(self, image, target=None):
        return image, target


class ProposalsBesideUnknown(RegionProposalNetwork):
    """Torchvision's, but that anchors in unknown pixels are no background."""

    @classmethod
    def of(cls, other: RegionProposalNetwork) -> "ProposalsBesideUnknown":
        """With the parts of another, which they share."""
        own = cls.__new__(cls)
        own.__dict__.update(other.__dict__)
        return own

    def assign_targets_to_anchors(self, anchors, targets):
        labels, boxes = super().assign_targets_to_anchors(anchors, targets)
        return [leave_out_unknown(*one) for one in zip(labels, anchors, (t["unknown"] for t in targets))], boxes


class HeadsBesideUnknown(RoIHeads):
    """Torchvision's, but that proposals in unknown pixels are no background."""

    @classmethod
    def of(cls, other: RoIHeads) -> "HeadsBesideUnknown":
        """With the parts of another, which they share."""
        own = cls.__new__(cls)
        own.__dict__.update(other.__dict__)
        own.unknown = []
        return own

    def select_training_samples(self, proposals, targets):
        self.unknown = [target["unknown"] for target in targets]  # torchvision passes boxes and labels on, nothing else
        return super().select_training_samples(proposals, targets)

    def assign_targets_to_proposals(self, proposals, gt_boxes, gt_labels):
        matched, labels = super().assign_targets_to_proposals(proposals, gt_boxes, gt_labels)
        return matched, [leave_out_unknown(*one) for one in zip(labels, proposals, self.unknown)]


class MaskRcnn(nn.Module):
    """[N, C, H, W] to detections and probabilities. `body` gives the pyramid's maps by name and has `out_channels`."""

    outputs = ("boxes", "labels", "scores", "masks")
    output_axes: ClassVar = {
        "image": {2: "h", 3: "w"},
        "probabilities": {2: "h", 3: "w"},
        "boxes": {0: "d"},
        "labels": {0: "d"},
        "scores": {0: "d"},
        "masks": {0: "d", 2: "h", 3: "w"},
    }
    halved = False  # non-maximum suppression turns a rounding of the weights into another set of boxes
    tolerance = 2e-3  # of an export: rounding in a box's corner moves the mask that is pasted there

    def __init__(self, body: nn.Module, levels: int, channels: int, classes: int, size: Size):
        super().__init__()
        self.classes = classes
        anchors = AnchorGenerator(
            tuple((SMALLEST_ANCHOR << i,) for i in range(levels + 1)), ((0.5, 1.0, 2.0),) * (levels + 1)
        )
        maps = [str(i) for i in range(levels)]
        self.detector = MaskRCNN(
            body,
            rpn_anchor_generator=anchors,
            rpn_head=ProposalHead(size.pyramid, anchors.num_anchors_per_location()[0]),
            rpn_pre_nms_top_n_train=size.candidates,
            rpn_post_nms_top_n_train=size.candidates,
            rpn_pre_nms_top_n_test=size.candidates // 2,
            rpn_post_nms_top_n_test=size.candidates // 2,
            box_roi_pool=MultiScaleRoIAlign(maps, BOX_CELLS, 2),
            box_head=FastRCNNConvFCHead(
                (size.pyramid, BOX_CELLS, BOX_CELLS), [size.pyramid] * size.box_layers, [size.box], nn.BatchNorm2d
            ),
            box_predictor=FastRCNNPredictor(size.box, classes),
            box_batch_size_per_image=size.sampled,
            box_positive_fraction=size.on_objects,
            box_detections_per_img=DETECTIONS,
            mask_roi_pool=MultiScaleRoIAlign(maps, MASK_CELLS, 2),
            mask_head=MaskRCNNHeads(size.pyramid, (size.pyramid,) * 4, 1, nn.BatchNorm2d),
            mask_predictor=MaskRCNNPredictor(size.pyramid, size.pyramid, classes),
        )
        self.detector.transform = AsItIs(channels)
        self.detector.rpn = ProposalsBesideUnknown.of(self.detector.rpn)
        self.detector.roi_heads = HeadsBesideUnknown.of(self.detector.roi_heads)
        self.pixel_classes = nn.Conv2d(size.pyramid, classes, 1)

    def own_losses(self, image, labels, instances) -> dict[str, torch.Tensor]:
        """The losses of the paper (objectness, box, class, mask) and that of the pixels' classes.

        Pictures that show no object and of which less than half is known are left out: no box may remain there.
        """
        teaches = (instances > 0).flatten(1).any(1) | ((labels != IGNORE).float().mean((1, 2)) >= LEAST_KNOWN)
        image, labels, instances = image[teaches], labels[teaches], instances[teaches]
        if not len(image):
            return {"loss_pixels": 0.0 * self.pixel_classes.weight.sum()}
        targets = [self.target(one, numbers) for one, numbers in zip(labels, instances)]
        maps = {}
        hook = self.detector.backbone.register_forward_hook(lambda _module, _input, output: maps.update(output))
        try:
            losses = self.detector(list(image), targets)
        finally:
            hook.remove()
        scores = F.interpolate(self.pixel_classes(maps["0"]).float(), size=labels.shape[1:], mode="bilinear")
        return {**losses, "loss_pixels": F.cross_entropy(scores, labels, ignore_index=IGNORE)}

    @staticmethod
    def target(labels, instances) -> dict[str, torch.Tensor]:
        """Boxes, classes and masks of one image's objects, and where nothing is known.

        Objects thinner than a pixel's box are left out.
        """
        numbers = torch.unique(instances)
        masks = instances[None] == numbers[numbers > 0][:, None, None]
        boxes = masks_to_boxes(masks) if len(masks) else torch.zeros(0, 4, device=labels.device)
        solid = (boxes[:, 2] > boxes[:, 0]) & (boxes[:, 3] > boxes[:, 1])
        masks, boxes = masks[solid], boxes[solid]
        kinds = [labels[mask].mode().values for mask in masks]
        kinds = torch.stack(kinds) if kinds else torch.zeros(0, dtype=torch.int64, device=labels.device)
        unknown = labels == IGNORE
        return {"boxes": boxes.float(), "labels": kinds, "masks": masks.to(torch.uint8), "unknown": unknown}

    def forward(self, image):
        detections = self.detector(list(image))
        probabilities = torch.stack([self.probabilities(d, image) for d in detections])
        first = {name: detections[0][name] for name in self.outputs}
        return {"logits": torch.log(probabilities + TINY), "probabilities": probabilities, **first}

    def probabilities(self, detection, image):
        """[K, H, W] from one image's detections."""
        nothing = torch.zeros_like(image[0, :1])
        by_detection = detection["masks"][:, 0] * detection["scores"][:, None, None]
        best = []
        for label in range(1, self.classes):
            own = by_detection * (detection["labels"] == label)[:, None, None].to(by_detection.dtype)
            best.append(torch.cat((nothing, own)).amax(0))
        foreground = torch.stack(best)
        whole = torch.cat((1.0 - foreground.amax(0, keepdim=True), foreground))
        return whole / whole.sum(0, keepdim=True)
