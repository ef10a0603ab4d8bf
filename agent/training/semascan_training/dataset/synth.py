"""The data sets of `semascan synth` and `semascan dataset`: one BOP scene folder a part, with label pictures beside it.

Of corrected models' views not every pixel is known: such a set names `ignore` in its `dataset.json`, and these pixels
count neither in the loss nor in a metric. Its `parts` name the part that each scene shows: two inspections of one part
are one part of a split.
"""

import json
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import cv2
import numpy as np

from ..errors import TrainingError
from ..recipe import Recipe
from .cache import cached
from .samples import DEPTH_UNIT, IGNORE, Samples

INDEX = "dataset.json"
SCHEMA = 1
MILLIMETRE = 1e-3


def read(folder: Path, recipe: Recipe, threads: int = 1) -> Samples:
    """All complete parts of the folder; labels are components or, for a defect network, defects."""
    index = _index(folder / INDEX)
    defects = recipe.task == "defect"
    views = [(scene, view) for scene in _scenes(folder) for view in _views(scene)]
    if not views:
        raise TrainingError(f"{folder}: no part with rgb, depth, labels and defects in it")
    arrays = _arrays(folder, index, views, tuple(map(int, recipe.data.window)), threads)
    labels = {kind: arrays.pop(kind) for kind in ("labels", "defects")}["defects" if defects else "labels"]
    parts = [index["parts"].get(scene.name, scene.name) for scene, _ in views]
    about = {k: index[k] for k in ("generator", "seed", "views", "size", "window") if k in index}
    classes = index["defects" if defects else "classes"]
    return Samples(**arrays, labels=labels, parts=parts, classes=classes, about=about)


def _index(path: Path) -> dict:
    index = _json(path)
    if index.get("schema") != SCHEMA:
        raise TrainingError(f"{path}: schema {index.get('schema')!r}; this version reads {SCHEMA}")
    for kind in ("classes", "defects"):
        names = index.get(kind)
        if not isinstance(names, list) or len(names) < 2 or names[0] != "none":
            raise TrainingError(f"{path}: {kind} must be a list that begins with 'none'")
    if index.get("ignore", IGNORE) != IGNORE:
        raise TrainingError(f"{path}: ignore is {index['ignore']!r}; this version reads {IGNORE}")
    parts = index.setdefault("parts", {})
    if not isinstance(parts, dict):  # the number of parts, of `semascan synth`: each scene is one
        index["parts"] = {}
    elif not all(isinstance(name, str) and name for name in parts.values()):
        raise TrainingError(f"{path}: parts must name the part of each scene")
    return index


def _arrays(
    folder: Path, index: dict, views: list[tuple[Path, str]], window: tuple[int, ...], threads: int
) -> dict[str, np.ndarray]:
    """Everything of all views, components and defects, so that one decoding serves every recipe.

    With a `window` (columns, rows) only what it shows of each view, the part in its middle.
    """
    whole = _picture(views[0][0] / "rgb" / f"{views[0][1]}.png").shape[:2]
    height, width = (window[1], window[0]) if window else whole
    if height > whole[0] or width > whole[1]:
        raise TrainingError(f"data.window: {width}x{height} does not fit into pictures of {whole[1]}x{whole[0]}")
    plane = (len(views), height, width)
    shapes = {"rgb": ((*plane, 3), "u1"), "depth": (plane, "u2"), "instances": (plane, "u1")}
    kinds = {"labels": len(index["classes"]), "defects": len(index["defects"])}
    shapes |= dict.fromkeys(kinds, (plane, "u1"))

    cameras = {}
    has_unknown = "ignore" in index

    def decode(arrays: dict, row: int) -> None:
        scene, view = views[row]
        picture = _picture(scene / "rgb" / f"{view}.png")
        if picture.shape[:2] != whole:
            raise TrainingError(f"{scene / 'rgb' / view}.png: {whole[1]}x{whole[0]} is expected, as the first view has")
        planes = {kind: _plane(scene / kind / f"{view}.png") for kind in kinds}
        for kind, plane in planes.items():
            if plane.shape != whole:
                raise TrainingError(f"{scene / kind / view}.png: {whole[1]}x{whole[0]} is expected, as colour has")
        seen = window_around(planes["labels"], height, width)
        arrays["rgb"][row] = cv2.cvtColor(picture[seen], cv2.COLOR_BGR2RGB)
        arrays["depth"][row] = _depth(scene, view, cameras[scene])[seen]
        arrays["instances"][row] = _instances(scene, view, whole)[seen]
        for kind, classes in kinds.items():
            labels = planes[kind]
            known = labels[labels != IGNORE] if has_unknown else labels
            if known.size and known.max() >= classes:
                raise TrainingError(f"{scene / kind / view}.png: class {known.max()} of {classes}")
            arrays[kind][row] = labels[seen]

    def fill(arrays: dict) -> None:
        for scene in {scene for scene, _ in views}:
            cameras[scene] = _json(scene / "scene_camera.json")
        with ThreadPoolExecutor(threads) as pool:
            for _ in pool.map(lambda row: decode(arrays, row), range(len(views))):
                pass  # raises what a decoding raised

    key = {"index": index, "window": window, "views": [f"{scene.name}/{view}" for scene, view in views]}
    return cached(folder, key, shapes, fill)


def window_around(labels: np.ndarray, height: int, width: int) -> tuple[slice, slice]:
    """Rows and columns of a window whose middle is that of what is labelled, as far as the picture allows it."""
    rows, columns = np.nonzero((labels > 0) & (labels != IGNORE))
    starts = []
    for places, wanted, length in ((rows, height, labels.shape[0]), (columns, width, labels.shape[1])):
        middle = (int(places.min()) + int(places.max()) + 1) // 2 if places.size else length // 2
        starts.append(min(max(0, middle - wanted // 2), length - wanted))
    return slice(starts[0], starts[0] + height), slice(starts[1], starts[1] + width)


def _scenes(folder: Path) -> list[Path]:
    """Folders of complete parts."""
    scenes = (path for path in folder.iterdir() if path.is_dir() and path.name.isdigit())
    return sorted(s for s in scenes if (s / "scene_camera.json").exists() and (s / "scene_gt.json").exists())


def _views(scene: Path) -> list[str]:
    beside = ("depth", "labels", "defects")
    return sorted(p.stem for p in (scene / "rgb").glob("*.png") if all((scene / b / p.name).exists() for b in beside))


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
