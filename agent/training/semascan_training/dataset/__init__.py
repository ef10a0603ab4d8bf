"""Labelled views, decoded once into plain arrays, so that an epoch costs no decoding."""

from pathlib import Path

from ..errors import TrainingError
from ..recipe import Recipe
from . import labelme, synth
from .samples import Samples
from .split import Split, composition, split_by_part

__all__ = ["Samples", "Split", "composition", "open_samples", "split_by_part"]


def open_samples(folder: Path, recipe: Recipe, threads: int = 1) -> Samples:
    """The views of a folder that `semascan synth` wrote (it has a `dataset.json`), or of a labelme folder.

    `threads` decode a set of `semascan synth` that has not been read before.
    """
    if not folder.is_dir():
        raise TrainingError(f"{folder}: no such folder")
    if (folder / synth.INDEX).exists():
        return synth.read(folder, recipe, threads)
    return labelme.read(folder, recipe)
