"""The decoded views of a data set."""

from dataclasses import dataclass, field

import numpy as np

IGNORE = 255
"""Label of pixels that nothing is known of: they count neither in the loss nor in a metric."""
DEPTH_UNIT = 1e-4
"""Metres a step of the depth arrays; 0 is missing."""
MEAN = (0.485, 0.456, 0.406)
STD = (0.229, 0.224, 0.225)
"""Colours as a share of 255 are brought to mean 0 and deviation 1 by ImageNet's figures, which pretrained backbones
were trained with."""


@dataclass
class Samples:
    """Arrays with one row a view, all of one size; read only, large ones memory-mapped."""

    rgb: np.ndarray  # [n, H, W, 3] u8
    depth: np.ndarray | None  # [n, H, W] u16, DEPTH_UNIT
    labels: np.ndarray  # [n, H, W] u8: class, 0 = none, IGNORE = unknown
    instances: np.ndarray  # [n, H, W] u8: number of the object, 0 = none
    parts: list[str]  # the part that view n shows
    classes: list[str]  # the first is `none`
    about: dict = field(default_factory=dict)  # where the data come from, for the manifest

    def __len__(self) -> int:
        return len(self.parts)
