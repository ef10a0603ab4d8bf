"""80 % of the parts to train, 10 % to validate, 10 % to test, as in [Remanufacturing paper], or more to test.

A part never is on two sides. Parts are told apart by their names, so two inspections of one part are one part.
"""

import hashlib
from dataclasses import asdict, dataclass

import numpy as np

from ..errors import TrainingError

SUBSET = 0.8


@dataclass(frozen=True)
class Split:
    """Names of the parts on each side."""

    train: list[str]
    validation: list[str]
    test: list[str]

    def rows(self, parts: list[str], side: str) -> np.ndarray:
        """Rows of the views whose part is on that side."""
        wanted = set(getattr(self, side))
        return np.array([i for i, part in enumerate(parts) if part in wanted], dtype=np.int64)

    def to_table(self) -> dict:
        """For `split.json`."""
        return asdict(self)


def split_by_part(parts: list[str], seed: int, tests: int = 1) -> Split:
    """A seeded split: of every ten parts one validates and `tests` test; none, where `tests` is 0.

    A part keeps its side when the data set grows: parts with numbers for names are counted by them, others are drawn by
    their names alone. A side that this leaves empty, as happens in small sets, gets a training part.
    """
    names = sorted(set(parts))
    sides: dict[str, list[str]] = {"test": [], "validation": [], "train": []}
    for name in names:
        drawn = _drawn(name, seed)
        sides["test" if drawn < tests else "validation" if drawn == tests else "train"].append(name)
    needed = ["train", "validation", *(["test"] if tests else [])]
    if len(names) < (10 if tests else 2):
        reason = "at least 10 are needed to train, validate and test on different ones"
        instead = "data.test_parts = 0 tests on none of them and needs 2"
        raise TrainingError(f"{len(names)} part{'s' if len(names) != 1 else ''}: {reason}; {instead}")
    for side in needed:
        if not sides[side]:
            # From the largest side, the one whose digest is least: not the first by name.
            largest = max(sides.values(), key=len)
            chosen = min(largest, key=lambda name: _digest(name, seed))
            largest.remove(chosen)
            sides[side].append(chosen)
    return Split(**sides)


def _drawn(name: str, seed: int) -> int:
    """A number below 10 for the part: all different for numbered parts of one ten."""
    if name.isdecimal() and name.isascii():
        ten, one = divmod(int(name), 10)
        return int(np.random.default_rng([seed, ten]).permutation(10)[one])
    return _digest(name, seed) % 10


def _digest(name: str, seed: int) -> int:
    return int.from_bytes(hashlib.sha256(f"{seed}/{name}".encode()).digest()[:8], "big")


def composition(train: list[str], kind: str, seed: int, member: int) -> list[str]:
    """The training parts of one ensemble member, with repetition where it is a bootstrap."""
    rng = np.random.default_rng([seed, member])
    if kind == "bootstrap":
        return sorted(rng.choice(train, len(train)).tolist())
    if kind == "subset":
        return sorted(rng.choice(train, max(1, round(SUBSET * len(train))), replace=False).tolist())
    return list(train)
