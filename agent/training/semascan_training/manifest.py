"""`model.toml`: what the agent must know of a network, and what people should."""

import hashlib
import json
import tomllib
from pathlib import Path

from .dataset.samples import MEAN, STD
from .errors import TrainingError
from .recipe import Recipe
from .taxonomy import class_list

SCHEMA = 1
LICENCE = "MIT OR Apache-2.0"


def manifest_text(
    recipe: Recipe, classes: list[str], files: list[Path], outputs: dict[str, str], training: dict, metrics: dict
) -> str:
    """The manifest of a model whose networks are `files`; `outputs` names the tensors beside `tensor`."""
    lines = [
        f"schema = {SCHEMA}",
        _entry("name", recipe.name),
        _entry("version", recipe.version),
        _entry("task", recipe.task),
        _entry("architecture", recipe.network.architecture),
        _entry("backbone", recipe.network.backbone),
        _entry("fusion", fusion(recipe)),
        _entry("licence", LICENCE),
    ]
    for file in files:
        digest = hashlib.sha256(file.read_bytes()).hexdigest()
        lines += ["", "[[network]]", _entry("file", file.name), _entry("sha256", digest)]
    lines += ["", "[input]", _entry("tensor", "image"), _entry("channels", list(recipe.data.channels)), "multiple = 32"]
    if recipe.data.footprint:
        lines += [_entry("footprint", list(recipe.data.footprint))]
    if recipe.uses_colour:
        lines += ["[input.colour]", _entry("mean", list(MEAN)), _entry("std", list(STD))]
    if recipe.uses_depth:
        near, far = _entry("near", recipe.data.near), _entry("far", recipe.data.far)
        lines += ["[input.depth]", near, far, "missing = 0.0"]
    lines += ["", "[output]", _entry("tensor", "probabilities"), _entry("activation", "none")]
    lines += [_entry(name, tensor) for name, tensor in outputs.items()]
    for item in class_list(classes, defects=recipe.task == "defect"):
        lines += ["", "[[classes]]", _entry("name", item.name), _entry("colour", item.colour)]
    for title, table in (("training", training), ("metrics", metrics)):
        lines += ["", f"[{title}]", *(_entry(key, value) for key, value in table.items())]
    return "\n".join(lines) + "\n"


def fusion(recipe: Recipe) -> str:
    """How colour and depth meet."""
    if recipe.task == "two-stream":
        return "contribution"
    stacked = recipe.uses_colour and recipe.uses_depth and recipe.network.fusion == "none"
    return "early" if stacked else recipe.network.fusion


def model_files(folder: Path) -> list[Path]:
    """The networks that a model's manifest names."""
    path = folder / "model.toml"
    try:
        table = tomllib.loads(path.read_text(encoding="utf-8"))
        return [folder / network["file"] for network in table["network"]]
    except (OSError, tomllib.TOMLDecodeError, KeyError, TypeError) as error:
        raise TrainingError(f"{path}: {error}") from error


def _entry(key: str, value) -> str:
    """One line of TOML; its strings, numbers, booleans and lists are written as JSON's are."""
    return f"{key} = {json.dumps(value)}"
