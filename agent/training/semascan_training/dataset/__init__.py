"""Labelled views, decoded once into plain arrays, so that an epoch costs no decoding."""

from pathlib import Path

from ..errors import TrainingError
from ..recipe import Recipe
from . import labelme, synth
from .samples import Samples
from .split import Split, composition, split_by_part

__all__ = ["Samples", "Split", "composition", "open_samples", "split_by_part"]


def open_samples(folder: Path, recipe: Recipe) -> Samples:
    """The views of a folder that `semascan synth` wrote (it has a `dataset.json`), or of a labelme folder."""
    if not folder.is_dir():
        raise TrainingError(f"{folder}: no such folder")
    if (folder / synth.INDEX).exists():
        return synth.read(folder, recipe)
    return labelme.read(folder, recipe)
