"""The data set that `semascan synth` writes: one BOP scene folder a part, with label pictures beside it."""

import json
from pathlib import Path

import cv2
import numpy as np

from ..errors import TrainingError
from ..recipe import Recipe
from .cache import cached
from .samples import DEPTH_UNIT, Samples

INDEX = "dataset.json"
SCHEMA = 1
MILLIMETRE = 1e-3


def read(folder: Path, recipe: Recipe) -> Samples:
    """All complete parts of the folder; labels are components or, for a defect network, defects."""
    index = _json(folder / INDEX)
    if index.get("schema") != SCHEMA:
        raise TrainingError(f"{folder / INDEX}: schema {index.get('schema')!r}; this version reads {SCHEMA}")
    kind = "defects" if recipe.task == "defect" else "classes"
    classes = index.get(kind)
    if not isinstance(classes, list) or len(classes) < 2 or classes[0] != "none":
        raise TrainingError(f"{folder / INDEX}: {kind} must be a list that begins with 'none'")
    label_folder = "defects" if recipe.task == "defect" else "labels"
    views = [(scene, view) for scene in _scenes(folder) for view in _views(scene, label_folder)]
    if not views:
        raise TrainingError(f"{folder}: no part with rgb, depth and {label_folder} in it")
    first = _picture(views[0][0] / "rgb" / f"{views[0][1]}.png")
    height, width = first.shape[:2]
    n = len(views)
    shapes = {
        "rgb": ((n, height, width, 3), "u1"),
        "depth": ((n, height, width), "u2"),
        "labels": ((n, height, width), "u1"),
        "instances": ((n, height, width), "u1"),
    }
    key = {"index": index, "labels": label_folder, "views": [f"{scene.name}/{view}" for scene, view in views]}

    def fill(arrays: dict) -> None:
        cameras = {}
        for row, (scene, view) in enumerate(views):
            if scene not in cameras:
                cameras[scene] = _json(scene / "scene_camera.json")
            arrays["rgb"][row] = cv2.cvtColor(_picture(scene / "rgb" / f"{view}.png"), cv2.COLOR_BGR2RGB)
            arrays["depth"][row] = _depth(scene, view, cameras[scene])
            labels = _plane(scene / label_folder / f"{view}.png")
            if labels.max() >= len(classes):
                raise TrainingError(f"{scene / label_folder / view}.png: class {labels.max()} of {len(classes)}")
            arrays["labels"][row] = labels
            arrays["instances"][row] = _instances(scene, view, labels.shape)

    arrays = cached(folder, key, shapes, fill)
    about = {k: index[k] for k in ("generator", "seed", "views", "size", "window") if k in index}
    return Samples(**arrays, parts=[scene.name for scene, _ in views], classes=classes, about=about)


def _scenes(folder: Path) -> list[Path]:
    """Folders of parts; the generator writes `objects.json` and cameras last or at once, so both must be there."""
    scenes = (path for path in folder.iterdir() if path.is_dir() and path.name.isdigit())
    return sorted(s for s in scenes if (s / "scene_camera.json").exists() and (s / "scene_gt.json").exists())


def _views(scene: Path, label_folder: str) -> list[str]:
    return sorted(p.stem for p in (scene / "rgb").glob("*.png") if (scene / label_folder / p.name).exists())


def _depth(scene: Path, view: str, cameras: dict) -> np.ndarray:
    path = scene / "depth" / f"{view}.png"
    raw = _plane(path)
    if raw.dtype != np.uint16:
        raise TrainingError(f"{path}: 16 bits a pixel are expected")
    try:
        scale = float(cameras[str(int(view))]["depth_scale"]) * MILLIMETRE / DEPTH_UNIT
    except (KeyError, TypeError, ValueError) as error:
        raise TrainingError(f"{scene / 'scene_camera.json'}: no depth_scale for view {view}") from error
    return raw if abs(scale - 1) < 1e-6 else np.rint(raw * scale).clip(0, 65535).astype(np.uint16)


def _instances(scene: Path, view: str, shape: tuple[int, ...]) -> np.ndarray:
    """Numbers of the objects from their visible masks, from 1."""
    instances = np.zeros(shape, np.uint8)
    for path in sorted((scene / "mask_visib").glob(f"{view}_*.png")):
        number = int(path.stem.rsplit("_", 1)[1]) + 1
        if number > 254:
            raise TrainingError(f"{path}: more than 254 objects in one view")
        instances[_plane(path) > 0] = number
    return instances


def _picture(path: Path) -> np.ndarray:
    picture = cv2.imread(str(path), cv2.IMREAD_COLOR)
    if picture is None:
        raise TrainingError(f"{path}: not a readable picture")
    return picture


def _plane(path: Path) -> np.ndarray:
    plane = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    if plane is None or plane.ndim != 2:
        raise TrainingError(f"{path}: not a readable picture of one channel")
    return plane


def _json(path: Path) -> dict:
    try:
        table = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise TrainingError(f"{path}: {error}") from error
    if not isinstance(table, dict):
        raise TrainingError(f"{path}: an object is expected")
    return table
