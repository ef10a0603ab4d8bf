"""From rows of a data set to tensors; order and augmentations depend on seed, member and epoch alone."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

import numpy as np
import torch
from torch.utils.data import DataLoader, Dataset

from .augment import View, augment
from .dataset import Samples
from .dataset.samples import DEPTH_UNIT, MEAN, STD
from .recipe import Recipe


@dataclass
class Batch:
    """`image` [N, C, H, W] float in the order of the recipe's channels, `labels` and `instances` [N, H, W] long."""

    image: torch.Tensor
    labels: torch.Tensor
    instances: torch.Tensor


class Pictures(NamedTuple):
    """A batch in as few bytes as the data set has: what passes between processes and to a GPU."""

    rgb: torch.Tensor | None  # [N, H, W, 3] u8
    depth: torch.Tensor | None  # [N, H, W] i32, DEPTH_UNIT
    labels: torch.Tensor  # [N, H, W] u8
    instances: torch.Tensor  # [N, H, W] u8

    def batch(self, recipe: Recipe, device: torch.device) -> Batch:
        """The batch on a device, widened there; the image in the memory layout that convolutions like."""
        there = Pictures(*(plane if plane is None else plane.to(device, non_blocking=True) for plane in self))
        image = picture_tensor(there.rgb, there.depth, recipe.data.near, recipe.data.far)
        image = image.contiguous(memory_format=torch.channels_last)
        return Batch(image, there.labels.long(), there.instances.long())


def picture_tensor(rgb: torch.Tensor | None, depth: torch.Tensor | None, near: float, far: float) -> torch.Tensor:
    """What the manifest's [input] says: colour [N, H, W, 3] u8 and depth [N, H, W] i32 to [N, C, H, W] float."""
    planes = []
    if rgb is not None:
        colour = rgb.permute(0, 3, 1, 2).float().div_(255)
        mean, std = _colour_statistics(rgb.device)
        planes.append(colour.sub_(mean).div_(std))
    if depth is not None:
        metres = depth.float().unsqueeze(1) * DEPTH_UNIT
        normal = ((metres - near) / (far - near)).clamp_(0.0, 1.0)
        planes.append(normal * (metres > 0))
    return torch.cat(planes, 1)


@cache
def _colour_statistics(device: torch.device) -> tuple[torch.Tensor, torch.Tensor]:
    mean, std = (torch.tensor(values, device=device).view(3, 1, 1) for values in (MEAN, STD))
    return mean, std


def make_pictures(
    samples: Samples, rows: np.ndarray, recipe: Recipe, rngs: list[np.random.Generator] | None
) -> Pictures:
    """The views of some rows; with generators, one a row, they are augmented."""
    depth = samples.depth if recipe.uses_depth else None
    views = []
    for i, row in enumerate(rows):
        view = View(
            np.asarray(samples.rgb[row]),
            None if depth is None else np.asarray(depth[row]),
            np.asarray(samples.labels[row]),
            np.asarray(samples.instances[row]),
        )
        views.append(augment(view, rngs[i], recipe.data.augment) if rngs else view)

    def stack(planes: list[np.ndarray]) -> torch.Tensor:
        return torch.from_numpy(np.stack(planes))

    return Pictures(
        stack([v.rgb for v in views]) if recipe.uses_colour else None,
        stack([v.depth.astype(np.int32) for v in views]) if depth is not None else None,
        stack([v.labels for v in views]),
        stack([v.instances for v in views]),
    )


CPU = torch.device("cpu")


def make_batch(
    samples: Samples,
    rows: np.ndarray,
    recipe: Recipe,
    rngs: list[np.random.Generator] | None,
    device: torch.device = CPU,
) -> Batch:
    """One batch; with generators, one a row, the views are augmented."""
    return make_pictures(samples, rows, recipe, rngs).batch(recipe, device)


class Epoch(Dataset):
    """The batches of one epoch: the rows in a new order, augmented. Whole batches only.

    An epoch of more images than there are rows goes through them again, in another order.
    """

    def __init__(self, samples: Samples, rows: np.ndarray, recipe: Recipe, stage: int, epoch: int):
        self.samples, self.recipe = samples, recipe
        self.seed = [recipe.training.seed, stage, epoch]
        rng = np.random.default_rng(self.seed)
        images = recipe.training.epoch_images or len(rows)
        passes = [rows[rng.permutation(len(rows))] for _ in range(-(-images // len(rows)))]
        self.order = np.concatenate(passes)[:images]
        self.size = min(recipe.training.batch, len(self.order))

    def __len__(self) -> int:
        return len(self.order) // self.size

    def __getitem__(self, batch: int) -> Pictures:
        first = batch * self.size
        rngs = [np.random.default_rng([*self.seed, first + i]) for i in range(self.size)]
        return make_pictures(self.samples, self.order[first : first + self.size], self.recipe, rngs)


def training_batches(
    samples: Samples,
    rows: np.ndarray,
    recipe: Recipe,
    stage: int,
    epoch: int,
    workers: int = 0,
    device: torch.device = CPU,
) -> Iterator[Batch]:
    """One epoch's batches on a device. `stage` tells trunk and members apart.

    With `workers`, so many processes prepare batches ahead, for a GPU that would wait for them (threads would wait for
    one another: half of an augmentation is Python's own work); the batches are the same.
    """
    batches = Epoch(samples, rows, recipe, stage, epoch)
    if not workers:
        for number in range(len(batches)):
            yield batches[number].batch(recipe, device)
        return
    # Forked processes share the arrays. Those that an epoch leaves behind early end with the loader.
    loader = DataLoader(
        batches,
        batch_size=None,
        num_workers=workers,
        pin_memory=device.type == "cuda",
        prefetch_factor=4,
        multiprocessing_context="fork",
    )
    for pictures in loader:
        yield pictures.batch(recipe, device)


def evaluation_batches(
    samples: Samples, rows: np.ndarray, recipe: Recipe, augmented: bool, device: torch.device = CPU
) -> Iterator[Batch]:
    """The rows in order, as they are or, if asked, augmented the same way every time."""
    size = recipe.training.batch
    for first in range(0, len(rows), size):
        some = rows[first : first + size]
        seed = [recipe.training.seed, 1 << 20, first]
        rngs = [np.random.default_rng([*seed, i]) for i in range(len(some))] if augmented else None
        yield make_batch(samples, some, recipe, rngs, device)
