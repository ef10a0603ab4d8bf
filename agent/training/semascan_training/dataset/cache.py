"""Arrays on disk beside the data they were decoded from, made once for each state of the folder."""

import fcntl
import hashlib
import json
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np

FOLDER = ".training-cache"
# What an entry's arrays hold; a change of it makes the cache anew.
LAYOUT = 1


def cached(
    folder: Path, key: dict, shapes: dict[str, tuple[tuple[int, ...], str]], fill: Callable[[dict], None]
) -> dict[str, np.ndarray]:
    """Memory-mapped arrays by name; `fill` writes them if this `key` has not been seen.

    The entry is built aside and renamed when complete, so that a broken run leaves no half of one. Of several trainings
    that begin together one builds it, and the others wait.
    """
    text = json.dumps({"layout": LAYOUT, **key}, sort_keys=True, default=str)
    name = hashlib.sha256(text.encode()).hexdigest()[:16]
    entry = folder / FOLDER / name
    if not entry.exists():
        entry.parent.mkdir(exist_ok=True)
        with entry.with_suffix(".lock").open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)  # given back when the file is closed, by a killed run too
            if not entry.exists():
                _build(entry, shapes, fill)
    return {array: np.load(entry / f"{array}.npy", mmap_mode="r") for array in shapes}


def _build(entry: Path, shapes: dict[str, tuple[tuple[int, ...], str]], fill: Callable[[dict], None]) -> None:
    building = entry.with_suffix(".building")
    shutil.rmtree(building, ignore_errors=True)
    building.mkdir()
    arrays = {
        array: np.lib.format.open_memmap(building / f"{array}.npy", "w+", dtype, shape)
        for array, (shape, dtype) in shapes.items()
    }
    fill(arrays)
    for array in arrays.values():
        array.flush()
    building.rename(entry)
