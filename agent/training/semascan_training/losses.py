"""Losses: Dice and focal ([Remanufacturing paper]), their sum, and those of instance and two-stream networks."""

from functools import cache

import torch
from torch.nn import functional as F

from .batches import Batch
from .dataset.samples import IGNORE
from .networks.instance import OFFSET_UNIT, STRIDE, instance_targets
from .recipe import Recipe

SMOOTH = 1.0
CENTRE_WEIGHT = 1.0
OFFSET_WEIGHT = 0.5
STREAM_WEIGHT = 0.5


def dice_loss(probabilities: torch.Tensor, labels: torch.Tensor) -> torch.Tensor:
    """1 - mean Dice over the classes that the batch shows; every class weighs the same, however small.

    `probabilities` [N, K, H, W], `labels` [N, H, W] with IGNORE where nothing is known.
    """
    known = labels != IGNORE
    probabilities = probabilities * known.unsqueeze(1)
    # Class by class: adding millions of pixels to a few places is what a GPU does slowest.
    places = [labels == k for k in range(probabilities.shape[1])]
    overlap = torch.stack([(own * place).sum() for own, place in zip(probabilities.unbind(1), places)])
    truth = torch.stack([place.sum() for place in places]).to(overlap.dtype)
    dice = (2 * overlap + SMOOTH) / (probabilities.sum((0, 2, 3)) + truth + SMOOTH)
    shown = truth > 0
    # No branch and no selection: either would make a GPU's work wait for the answer.
    return shown.any().to(dice.dtype) - (dice * shown).sum() / shown.sum().clamp(min=1)


def focal_loss(
    log_probabilities: torch.Tensor, labels: torch.Tensor, gamma: float, weights: tuple[float, ...] = ()
) -> torch.Tensor:
    """Cross entropy of a pixel times (1 - p)^gamma [Lin 2017] and its class's weight; gamma = 0 is plain."""
    entropy = F.nll_loss(log_probabilities, labels, ignore_index=IGNORE, reduction="none")
    if gamma > 0:
        entropy = entropy * (1 - torch.exp(-entropy)).clamp(min=1e-6) ** gamma
    if weights:
        entropy = entropy * _on_device(weights, labels.device)[torch.where(labels == IGNORE, 0, labels)]
    return entropy.sum() / (labels != IGNORE).sum().clamp(min=1)


@cache
def _on_device(values: tuple[float, ...], device: torch.device) -> torch.Tensor:
    return torch.tensor(values, device=device)


def keeping_loss(logits: torch.Tensor, before: torch.Tensor, labels: torch.Tensor) -> torch.Tensor:
    """How far the class scores [N, K, H, W] part from those of the start where nothing is known.

    The mean Kullback-Leibler divergence. Where labels are, the start has no say.
    """
    unknown = labels == IGNORE
    divergence = F.kl_div(logits.log_softmax(1), before.log_softmax(1), reduction="none", log_target=True).sum(1)
    return (divergence * unknown).sum() / unknown.sum().clamp(min=1)


def segmentation_loss(logits: torch.Tensor, labels: torch.Tensor, recipe: Recipe) -> torch.Tensor:
    """The recipe's loss for class scores [N, K, H, W]."""
    kind = recipe.training.loss
    log_probabilities = logits.log_softmax(1)
    loss = logits.new_zeros(())
    if "dice" in kind:
        loss = loss + dice_loss(log_probabilities.exp(), labels)
    if "focal" in kind:
        loss = loss + focal_loss(log_probabilities, labels, recipe.training.focal_gamma, recipe.training.class_weights)
    return loss


def centre_loss(logits: torch.Tensor, heat: torch.Tensor, known: torch.Tensor) -> torch.Tensor:
    """Penalty-reduced focal loss of a centre heat map [Law 2018]: near a centre a false one costs less.

    `known` [N, 1, h, w] is 0 where nothing is known: a centre there may be right.
    """
    p = logits.sigmoid().clamp(1e-4, 1 - 1e-4)
    is_centre = (heat > 0.95).to(p.dtype)
    positive = torch.log(p) * (1 - p) ** 2 * is_centre
    negative = torch.log(1 - p) * p**2 * (1 - heat) ** 4 * (1 - is_centre) * known
    return -(positive.sum() + negative.sum()) / is_centre.sum().clamp(min=1)


def training_loss(
    network: torch.nn.Module, batch: Batch, recipe: Recipe, before: torch.nn.Module | None = None
) -> torch.Tensor:
    """The loss of a batch; which terms it has follows from what the network gives.

    `before` is the start, by which the recipe's `keep` goes.
    """
    reduced = recipe.training.precision == "bfloat16"
    with torch.autocast(batch.image.device.type, torch.bfloat16, enabled=reduced):
        if hasattr(network, "own_losses"):
            return sum(network.own_losses(batch.image, batch.labels, batch.instances).values())
        outputs = network(batch.image)
    outputs = {name: output.float() for name, output in outputs.items()}
    loss = segmentation_loss(outputs["logits"], batch.labels, recipe)
    if before is not None:
        with torch.no_grad():
            start = before(batch.image)["logits"].float()
        loss = loss + recipe.training.keep * keeping_loss(outputs["logits"], start, batch.labels)
    for stream in ("colour_logits", "depth_logits"):
        if stream in outputs:
            loss = loss + STREAM_WEIGHT * segmentation_loss(outputs[stream], batch.labels, recipe)
    if "offsets" in outputs:
        classes = outputs["logits"].shape[1]
        targets = instance_targets(batch.instances.cpu(), batch.labels.cpu(), classes)
        heat, offsets, inside = (target.to(batch.image.device) for target in targets)
        known = (batch.labels[:, STRIDE // 2 :: STRIDE, STRIDE // 2 :: STRIDE] != IGNORE).unsqueeze(1).float()
        error = F.smooth_l1_loss(outputs["offsets"] / OFFSET_UNIT, offsets / OFFSET_UNIT, reduction="none", beta=0.1)
        loss = loss + CENTRE_WEIGHT * centre_loss(outputs["centre_logits"], heat, known)
        loss = loss + OFFSET_WEIGHT * (error * inside).sum() / inside.sum().clamp(min=1)
    return loss
