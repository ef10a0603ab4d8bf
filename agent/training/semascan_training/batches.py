"""From rows of a data set to tensors; order and augmentations depend on seed, member and epoch alone."""

from collections import deque
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
import torch

from .augment import View, augment
from .dataset import Samples
from .dataset.samples import DEPTH_UNIT
from .recipe import Recipe

MEAN = (0.485, 0.456, 0.406)
STD = (0.229, 0.224, 0.225)
"""ImageNet's, so that pretrained backbones see what they know."""


@dataclass
class Batch:
    """`image` [N, C, H, W] float in the order of the recipe's channels, `labels` and `instances` [N, H, W] long."""

    image: torch.Tensor
    labels: torch.Tensor
    instances: torch.Tensor

    def to(self, device: torch.device) -> "Batch":
        """The batch on a device; the image in the memory layout that convolutions like."""
        image = self.image.to(device, memory_format=torch.channels_last)
        return Batch(image, self.labels.to(device), self.instances.to(device))


def picture_tensor(rgb: np.ndarray | None, depth: np.ndarray | None, near: float, far: float) -> torch.Tensor:
    """What the manifest's [input] says: colour [N, H, W, 3] u8 and depth [N, H, W] u16 to [N, C, H, W] float."""
    planes = []
    if rgb is not None:
        colour = torch.from_numpy(np.ascontiguousarray(rgb)).permute(0, 3, 1, 2).float().div_(255)
        planes.append(colour.sub_(torch.tensor(MEAN).view(3, 1, 1)).div_(torch.tensor(STD).view(3, 1, 1)))
    if depth is not None:
        metres = torch.from_numpy(depth.astype(np.float32)).unsqueeze(1) * DEPTH_UNIT
        normal = ((metres - near) / (far - near)).clamp_(0.0, 1.0)
        planes.append(normal * (metres > 0))
    return torch.cat(planes, 1)


def make_batch(samples: Samples, rows: np.ndarray, recipe: Recipe, rngs: list[np.random.Generator] | None) -> Batch:
    """One batch; with generators, one a row, the views are augmented."""
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
    return Batch(
        picture_tensor(
            np.stack([v.rgb for v in views]) if recipe.uses_colour else None,
            np.stack([v.depth for v in views]) if depth is not None else None,
            recipe.data.near,
            recipe.data.far,
        ),
        torch.from_numpy(np.stack([v.labels for v in views]).astype(np.int64)),
        torch.from_numpy(np.stack([v.instances for v in views]).astype(np.int64)),
    )


def training_batches(
    samples: Samples, rows: np.ndarray, recipe: Recipe, stage: int, epoch: int, workers: int = 0
) -> Iterator[Batch]:
    """One epoch: the rows in a new order, augmented. `stage` tells trunk and members apart. Whole batches only.

    With `workers`, so many threads prepare batches ahead, for a GPU that would wait for them; the batches are the same.
    """
    seed = [recipe.training.seed, stage, epoch]
    order = rows[np.random.default_rng(seed).permutation(len(rows))]
    if recipe.training.epoch_images:
        order = order[: recipe.training.epoch_images]
    size = min(recipe.training.batch, len(order))

    def prepare(first: int) -> Batch:
        rngs = [np.random.default_rng([*seed, first + i]) for i in range(size)]
        return make_batch(samples, order[first : first + size], recipe, rngs)

    starts = range(0, len(order) - size + 1, size)
    if not workers:
        yield from map(prepare, starts)
        return
    with ThreadPoolExecutor(workers) as pool:
        ahead: deque[Future[Batch]] = deque()
        for first in starts:
            ahead.append(pool.submit(prepare, first))
            if len(ahead) > 2 * workers:
                yield ahead.popleft().result()
        while ahead:
            yield ahead.popleft().result()


def evaluation_batches(samples: Samples, rows: np.ndarray, recipe: Recipe, augmented: bool) -> Iterator[Batch]:
    """The rows in order, as they are or, if asked, augmented the same way every time."""
    size = recipe.training.batch
    for first in range(0, len(rows), size):
        some = rows[first : first + size]
        seed = [recipe.training.seed, 1 << 20, first]
        rngs = [np.random.default_rng([*seed, i]) for i in range(len(some))] if augmented else None
        yield make_batch(samples, some, recipe, rngs)
