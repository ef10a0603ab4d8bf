"""A run's folder: the recipe, the split, and one folder a stage with its checkpoint and log.

RUN/recipe.toml  RUN/run.json  RUN/trunk/{checkpoint.pt, log.jsonl}  RUN/member-0/...
"""

import json
import os
from dataclasses import dataclass, field
from pathlib import Path

import torch

from .dataset import Split
from .errors import TrainingError
from .recipe import Recipe, read_recipe

RECIPE, INDEX, CHECKPOINT, LOG = "recipe.toml", "run.json", "checkpoint.pt", "log.jsonl"


@dataclass
class Run:
    """What training leaves and export needs."""

    folder: Path
    recipe: Recipe
    split: Split
    classes: list[str]
    about: dict  # where the data come from
    started_from: list[str] = field(default_factory=list)  # names of runs or models whose weights were the start
    device: str = "unknown"  # what trained it

    def stage(self, name: str) -> Path:
        """Folder of a stage, made if need be."""
        folder = self.folder / name
        folder.mkdir(parents=True, exist_ok=True)
        return folder

    def log(self, name: str) -> list[dict]:
        """The log of a stage, the newest line of each epoch."""
        path = self.folder / name / LOG
        lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
        by_epoch = {entry["epoch"]: entry for entry in map(json.loads, lines)}
        return [by_epoch[epoch] for epoch in sorted(by_epoch)]

    def save(self, recipe_text: str) -> None:
        """Writes `recipe.toml` and `run.json`."""
        self.folder.mkdir(parents=True, exist_ok=True)
        write_whole(self.folder / RECIPE, recipe_text.encode())
        table = {
            "classes": self.classes,
            "about": self.about,
            "split": self.split.to_table(),
            "started_from": self.started_from,
            "device": self.device,
        }
        write_whole(self.folder / INDEX, json.dumps(table, indent=1).encode())


def open_run(folder: Path) -> Run:
    """Opens a run that `train` left."""
    recipe = read_recipe(folder / RECIPE)
    try:
        table = json.loads((folder / INDEX).read_text(encoding="utf-8"))
        split, classes, about = Split(**table["split"]), table["classes"], table["about"]
        started_from, device = table.get("started_from", []), table.get("device", "unknown")
        return Run(folder, recipe, split, classes, about, started_from, device)
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise TrainingError(f"{folder / INDEX}: {error}") from error


def write_whole(path: Path, content: bytes) -> None:
    """Writes a file so that it is there whole or not at all."""
    aside = path.with_name(path.name + ".part")
    aside.write_bytes(content)
    os.replace(aside, path)


def save_checkpoint(folder: Path, state: dict) -> None:
    """Writes a stage's checkpoint, whole or not at all."""
    aside = folder / (CHECKPOINT + ".part")
    torch.save(state, aside)
    os.replace(aside, folder / CHECKPOINT)


def load_checkpoint(folder: Path) -> dict | None:
    """A stage's checkpoint, if there is one."""
    path = folder / CHECKPOINT
    return torch.load(path, map_location="cpu", weights_only=True) if path.exists() else None
