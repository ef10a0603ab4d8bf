"""A small data set in the layout of `semascan synth`, drawn here: two boxes on a table, one of them nearer."""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest

try:
    import torch
except ImportError:  # the tests in with_torch/ are skipped
    torch = None

HEIGHT, WIDTH, VIEWS = 64, 96, 4
CLASSES = ["none", "housing", "gear"]
RECIPES = Path(__file__).parent.parent / "recipes"


def draw_view(rng: np.random.Generator):
    """Colour, depth in 0.1 mm with a hole, component labels and defect labels of one view."""
    rgb = rng.integers(60, 90, (HEIGHT, WIDTH, 3)).astype(np.uint8)
    depth = np.full((HEIGHT, WIDTH), 6000, np.uint16)
    labels, defects = np.zeros((HEIGHT, WIDTH), np.uint8), np.zeros((HEIGHT, WIDTH), np.uint8)
    for label, colour, z in ((1, (200, 60, 40), 5500), (2, (40, 80, 200), 5200)):
        x, y = int(rng.integers(4, 52)) if label == 1 else int(rng.integers(50, 60)), int(rng.integers(4, 30))
        box = np.s_[y : y + 28, x : x + 32]
        rgb[box], depth[box], labels[box] = colour, z, label
        defects[y + 4 : y + 10, x + 4 : x + 12] = label
    depth[:6, :6] = 0
    return rgb, depth, labels, defects


@pytest.fixture(scope="session")
def data(tmp_path_factory) -> Path:
    """Ten parts of four views."""
    folder = tmp_path_factory.mktemp("data")
    write_set(folder, parts=10)
    return folder


def write_set(folder: Path, parts: int, seed: int = 3) -> None:
    """Writes the data set."""
    index = {
        "schema": 1, "generator": "test", "seed": seed, "parts": parts, "views": VIEWS,
        "size": [640, 480], "window": [WIDTH, HEIGHT], "classes": CLASSES, "defects": ["none", "corrosion", "wear"],
    }  # fmt: skip
    (folder / "dataset.json").write_text(json.dumps(index))
    rng = np.random.default_rng(seed)
    for part in range(parts):
        scene = folder / f"{part:06}"
        for name in ("rgb", "depth", "labels", "defects", "mask_visib"):
            (scene / name).mkdir(parents=True)
        cameras = {}
        for view in range(VIEWS):
            rgb, depth, labels, defects = draw_view(rng)
            cv2.imwrite(str(scene / "rgb" / f"{view:06}.png"), rgb[..., ::-1])
            cv2.imwrite(str(scene / "depth" / f"{view:06}.png"), depth)
            cv2.imwrite(str(scene / "labels" / f"{view:06}.png"), labels)
            cv2.imwrite(str(scene / "defects" / f"{view:06}.png"), defects)
            for k in (0, 1):
                mask = np.where(labels == k + 1, 255, 0).astype(np.uint8)
                cv2.imwrite(str(scene / "mask_visib" / f"{view:06}_{k:06}.png"), mask)
            cameras[str(view)] = {"cam_K": [600, 0, 48, 0, 600, 32, 0, 0, 1], "depth_scale": 0.1}
        (scene / "scene_camera.json").write_text(json.dumps(cameras))
        (scene / "scene_gt.json").write_text("{}")


@pytest.fixture(autouse=True)
def one_thread():
    """The tests share the machine."""
    if torch is not None:
        torch.set_num_threads(1)


def write_recipe(path: Path, architecture="ud-net", task="semantic", channels=None, **sections) -> Path:
    """A recipe for two short epochs on the small data set; `sections` add fields to its tables."""
    tables = {
        "network": {
            "architecture": architecture,
            "backbone": "edge",
            "fusion": "early" if architecture == "ud-net" else "none",
        },
        "data": {"channels": channels or ["red", "green", "blue", "depth"]},
        "training": {"epochs": 2, "batch": 4, "learning_rate": 1e-3, "validation_images": 4},
        "ensemble": {},
    }
    for name, fields in sections.items():
        tables[name].update(fields)
    lines = ['name = "small"', f'task = "{task}"']
    for name, fields in tables.items():
        lines += [f"[{name}]", *(f"{key} = {json.dumps(value)}" for key, value in fields.items())]
    path.write_text("\n".join(lines))
    return path
