"""80 % of the parts to train, 10 % to validate, 10 % to test, as in [Remanufacturing paper], or more to test.

A part never is on two sides.
"""

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
    """A seeded split: of every ten parts one validates and `tests` test.

    Parts with numbers for names are counted by them, so a data set may grow: a part keeps its side.
    """
    names = sorted(set(parts))
    sides: dict[str, list[str]] = {"test": [], "validation": [], "train": []}
    for position, name in enumerate(names):
        ten, one = divmod(int(name) if name.isdigit() else position, 10)
        drawn = int(np.random.default_rng([seed, ten]).permutation(10)[one])
        sides["test" if drawn < tests else "validation" if drawn == tests else "train"].append(name)
    if not all(sides.values()):
        raise TrainingError(f"{len(names)} parts: at least 10 are needed to train, validate and test on different ones")
    return Split(**sides)


def composition(train: list[str], kind: str, seed: int, member: int) -> list[str]:
    """The training parts of one ensemble member, with repetition where it is a bootstrap."""
    rng = np.random.default_rng([seed, member])
    if kind == "bootstrap":
        return sorted(rng.choice(train, len(train)).tolist())
    if kind == "subset":
        return sorted(rng.choice(train, max(1, round(SUBSET * len(train))), replace=False).tolist())
    return list(train)
