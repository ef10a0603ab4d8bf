"""The augmentations of [Remanufacturing paper], online, on a share of the images (there 50 %); the others stay.

Geometric ones (flip, rotation, scale, translation, crop) go to colour, depth, labels and instances alike, colour
(brightness, contrast, saturation) and filters (noise, CLAHE, blur) to the colour image alone. A zoom by s is a camera
that comes nearer: depth shifts by z0 (1/s - 1) about the middle depth z0, which keeps every slope as it was.
"""

from dataclasses import dataclass

import cv2
import numpy as np

from .dataset.samples import IGNORE

FLIP = 0.5  # probability; left to right only, since the cell's cameras look down on an upright part
ROTATION = 25.0  # degrees to either side
ZOOM = 1.25  # at most, and its inverse at least
SHIFT = 0.15  # of the picture's size
CROP = 0.3  # probability that a zoom is a crop: nearer, off centre
BRIGHTNESS = 0.25
CONTRAST = 0.3
SATURATION = 0.5
NOISE = 10.0  # standard deviation at most, grey values
FILTER = 0.3  # probability of each of noise, CLAHE and blur
COLOUR = 0.8  # probability of the colour adjustments together


@dataclass
class View:
    """One view to be augmented; arrays [H, W] but `rgb` [H, W, 3]. `depth` may be None."""

    rgb: np.ndarray
    depth: np.ndarray | None
    labels: np.ndarray
    instances: np.ndarray


def augment(view: View, rng: np.random.Generator, share: float) -> View:
    """The view itself or, with probability `share`, an augmented copy."""
    if rng.random() >= share:
        return view
    view = move(view, *draw_motion(rng, *view.labels.shape))
    if rng.random() < COLOUR:
        view.rgb = adjust(view.rgb, rng)
    if rng.random() < FILTER:
        view.rgb = equalize(view.rgb, rng.uniform(1.0, 3.0))
    if rng.random() < FILTER:
        view.rgb = cv2.GaussianBlur(view.rgb, (0, 0), rng.uniform(0.4, 1.2))
    if rng.random() < FILTER:
        view.rgb = add_noise(view.rgb, rng)
    return view


def draw_motion(rng: np.random.Generator, height: int, width: int) -> tuple[np.ndarray, float]:
    """A similarity with flips, 2x3, from old to new pixels, and its zoom."""
    zoom = float(np.exp(rng.uniform(-1, 1) * np.log(ZOOM)))
    reach = SHIFT
    if rng.random() < CROP:
        zoom = rng.uniform(ZOOM, ZOOM**2)
        reach = 0.5 * (1 - 1 / zoom) + SHIFT / 2
    angle = np.deg2rad(rng.uniform(-ROTATION, ROTATION))
    turn = zoom * np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    turn = turn @ np.diag([-1.0 if rng.random() < FLIP else 1.0, 1.0])
    centre = np.array([(width - 1) / 2, (height - 1) / 2])
    shift = rng.uniform(-reach, reach, 2) * (width, height)
    return np.column_stack((turn, centre - turn @ centre + shift)), zoom


def move(view: View, matrix: np.ndarray, zoom: float) -> View:
    """The view under a motion of the picture. What comes from outside it has no depth and the label IGNORE."""
    size = view.labels.shape[::-1]

    def warp(array, flags, border, value=0):
        return cv2.warpAffine(array, matrix, size, flags=flags, borderMode=border, borderValue=value)

    rgb = warp(view.rgb, cv2.INTER_LINEAR, cv2.BORDER_REPLICATE)
    labels = warp(view.labels, cv2.INTER_NEAREST, cv2.BORDER_CONSTANT, IGNORE)
    instances = warp(view.instances, cv2.INTER_NEAREST, cv2.BORDER_CONSTANT)
    depth = None
    if view.depth is not None:
        depth = warp(view.depth, cv2.INTER_NEAREST, cv2.BORDER_CONSTANT)
        valid = depth > 0
        seen = depth[valid & (labels > 0) & (labels != IGNORE)]
        if seen.size:
            nearer = round(float(np.median(seen)) * (1 / zoom - 1))
            moved = np.clip(depth.astype(np.int32) + nearer, 1, 65535).astype(np.uint16)
            depth = np.where(valid, moved, 0).astype(np.uint16)
    return View(rgb, depth, labels, instances)


def adjust(rgb: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Brightness, contrast and saturation."""
    gain = 1 + rng.uniform(-CONTRAST, CONTRAST)
    offset = 255 * rng.uniform(-BRIGHTNESS, BRIGHTNESS) * 0.5
    table = np.clip((np.arange(256) - 128) * gain + 128 + offset, 0, 255).astype(np.uint8)
    rgb = cv2.LUT(rgb, table)
    grey = cv2.cvtColor(cv2.cvtColor(rgb, cv2.COLOR_RGB2GRAY), cv2.COLOR_GRAY2RGB)
    share = 1 + rng.uniform(-SATURATION, SATURATION)
    return cv2.addWeighted(rgb, share, grey, 1 - share, 0)


def equalize(rgb: np.ndarray, limit: float) -> np.ndarray:
    """Contrast-limited adaptive histogram equalisation of the lightness."""
    lab = cv2.cvtColor(rgb, cv2.COLOR_RGB2LAB)
    lab[..., 0] = cv2.createCLAHE(limit, (8, 8)).apply(np.ascontiguousarray(lab[..., 0]))
    return cv2.cvtColor(lab, cv2.COLOR_LAB2RGB)


def add_noise(rgb: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Gaussian noise of a random strength."""
    noise = rng.standard_normal(rgb.shape, np.float32) * rng.uniform(1.0, NOISE)
    return np.clip(rgb + noise, 0, 255).astype(np.uint8)
