"""Folders labelled with labelme: polygons to masks, large pictures cut into tiles.

Pictures lie beside their `.json` or in `images/` beside `labels/`. Only polygons, rectangles and circles have an area;
other shapes are refused by name rather than dropped. Shapes with one `group_id` are pieces of one object, as
`semascan dataset` writes objects with holes. A file may name its `part`, as that command does; a recipe's pattern goes
before, the file's own name is the last resort. What is labelled `__ignore__` is not known: it counts neither in the
loss nor in a metric.
"""

import json
import re
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from ..errors import TrainingError
from ..recipe import Recipe
from .samples import IGNORE, Samples

TILE_HEIGHT, TILE_WIDTH = 256, 320
IGNORE_LABEL = "__ignore__"


@dataclass(frozen=True)
class Annotation:
    """One labelled picture."""

    picture: Path
    shapes: list[dict]
    part: str


def read(folder: Path, recipe: Recipe) -> Samples:
    """All labelled pictures of a folder, as tiles of 320x256 after resizing by the recipe's `data.scale`."""
    if recipe.uses_depth:
        raise TrainingError(f"{folder}: labelme pictures have no depth; the recipe's data.channels ask for it")
    files = sorted(folder.rglob("*.json"))
    annotations = [_annotation(path, recipe.data.part_pattern) for path in files]
    if not annotations:
        raise TrainingError(f"{folder}: neither a dataset.json nor labelme files (*.json)")
    names = sorted({_label(shape) for a in annotations for shape in a.shapes} - {IGNORE_LABEL})
    classes = ["none", *names]
    sizes = [_scaled_size(a.picture, recipe.data.scale) for a in annotations]
    places = [(i, y, x) for i, size in enumerate(sizes) for y, x in _tiles(*size)]
    tile = (len(places), TILE_HEIGHT, TILE_WIDTH)
    arrays = {"rgb": np.empty((*tile, 3), np.uint8), "labels": np.empty(tile, np.uint8)}
    arrays["instances"] = np.empty(tile, np.uint8)
    opened, planes = -1, []
    for row, (i, y, x) in enumerate(places):
        if i != opened:
            opened, planes = i, _planes(annotations[i], classes, sizes[i])
        for name, plane in zip(("rgb", "labels", "instances"), planes):
            arrays[name][row] = plane[y : y + TILE_HEIGHT, x : x + TILE_WIDTH]
    parts = [annotations[i].part for i, _, _ in places]
    about = {"generator": "labelme", "pictures": len(annotations)}
    return Samples(**arrays, depth=None, parts=parts, classes=classes, about=about)


def _annotation(path: Path, part_pattern: str) -> Annotation:
    try:
        table = json.loads(path.read_text(encoding="utf-8"))
        name = re.split(r"[\\/]", table["imagePath"])[-1]
        shapes = table["shapes"]
        for shape in shapes:
            shape["label"], shape["points"]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise TrainingError(f"{path}: not a labelme file ({error})") from error
    candidates = [path.parent / name, path.parent.parent / "images" / name]
    picture = next((p for p in candidates if p.exists()), None)
    if picture is None:
        raise TrainingError(f"{path}: its picture {name} is neither beside it nor in images/")
    part = table.get("part") or path.stem
    if not isinstance(part, str):
        raise TrainingError(f"{path}: part must be a name")
    if part_pattern:
        found = re.search(part_pattern, path.stem)
        if found is None or not found.groups():
            raise TrainingError(f"{path}: its name does not match data.part_pattern '{part_pattern}' with a group")
        part = next((group for group in found.groups() if group), part)
    return Annotation(picture, shapes, part)


def _label(shape: dict) -> str:
    return shape["label"].strip().lower()


def fill_shape(mask: np.ndarray, shape: dict, scale: float, value: int) -> None:
    """Draws one shape into a mask; the vertices are pixels of the unscaled picture."""
    kind = shape.get("shape_type", "polygon")
    points = np.asarray(shape["points"], np.float32)
    if kind == "polygon" and len(points) >= 3:
        outline = points
    elif kind == "rectangle" and len(points) == 2:
        (left, top), (right, bottom) = points
        outline = np.array([[left, top], [right, top], [right, bottom], [left, bottom]], np.float32)
    elif kind == "circle" and len(points) == 2:
        turn = np.linspace(0, 2 * np.pi, 64, endpoint=False)
        outline = points[0] + np.linalg.norm(points[1] - points[0]) * np.stack((np.cos(turn), np.sin(turn)), 1)
    else:
        raise TrainingError(f"a shape of type '{kind}' with {len(points)} points has no area")
    # labelme counts from a pixel's corner, OpenCV from its centre.
    cv2.fillPoly(mask, [np.rint(outline * scale - 0.5).astype(np.int32)], value)


def _planes(annotation: Annotation, classes: list[str], size: tuple[int, int]) -> list[np.ndarray]:
    """Colour, labels and instances, padded to at least one tile; what is padded is IGNORE."""
    picture = _read(annotation.picture)
    height, width = size
    scale = width / picture.shape[1]
    rgb = cv2.resize(cv2.cvtColor(picture, cv2.COLOR_BGR2RGB), (width, height), interpolation=cv2.INTER_AREA)
    labels, instances = np.zeros(size, np.uint8), np.zeros(size, np.uint8)
    numbers: dict = {}
    for place, shape in enumerate(annotation.shapes):
        name, group = _label(shape), shape.get("group_id")
        known = name != IGNORE_LABEL
        key = ("", place) if group is None else (name, group)
        number = numbers.setdefault(key, len(numbers) + 1) if known else 0
        try:
            fill_shape(labels, shape, scale, classes.index(name) if known else IGNORE)
            fill_shape(instances, shape, scale, min(number, 254))
        except TrainingError as error:
            raise TrainingError(f"{annotation.picture}: {error}") from error
    below, right = max(0, TILE_HEIGHT - height), max(0, TILE_WIDTH - width)
    return [
        cv2.copyMakeBorder(rgb, 0, below, 0, right, cv2.BORDER_REPLICATE),
        cv2.copyMakeBorder(labels, 0, below, 0, right, cv2.BORDER_CONSTANT, value=IGNORE),
        cv2.copyMakeBorder(instances, 0, below, 0, right, cv2.BORDER_CONSTANT, value=0),
    ]


def _scaled_size(path: Path, scale: float) -> tuple[int, int]:
    height, width = _read(path).shape[:2]
    return max(1, round(height * scale)), max(1, round(width * scale))


def _tiles(height: int, width: int) -> list[tuple[int, int]]:
    """Corners of tiles that cover the picture with the least overlap."""
    return [(y, x) for y in _starts(height, TILE_HEIGHT) for x in _starts(width, TILE_WIDTH)]


def _starts(length: int, tile: int) -> list[int]:
    count = max(1, -(-length // tile))
    return [round(i * max(0, length - tile) / max(1, count - 1)) for i in range(count)]


def _read(path: Path) -> np.ndarray:
    picture = cv2.imread(str(path), cv2.IMREAD_COLOR)
    if picture is None:
        raise TrainingError(f"{path}: not a readable picture")
    return picture
