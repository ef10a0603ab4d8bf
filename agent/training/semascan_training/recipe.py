"""A recipe: one TOML file that says everything about how a network is trained, but where the data lies."""

import tomllib
from dataclasses import MISSING, dataclass, field, fields, is_dataclass
from pathlib import Path

from .errors import TrainingError

TASKS = ("semantic", "defect", "instance", "two-stream")
COLOUR = ("red", "green", "blue")
STARTS = ("random", "frozen", "fine-tuned")
FUSED = ("ud-net", "md-net")
"""Architectures that `fusion` chooses among variants of."""
HEADS = ("interpolated", "fine")
LOSSES = ("dice", "focal", "dice+focal", "mask-rcnn")
OPTIMISERS = ("sgd", "adam", "adamw")
SCHEDULES = ("steps", "one-cycle")
PRECISIONS = ("float32", "bfloat16")
COMPOSITIONS = ("all", "bootstrap", "subset")
SIDE = 32
"""Pixels that a picture's sides are multiples of."""


@dataclass(frozen=True)
class NetworkRecipe:
    """What is built and how it starts."""

    architecture: str
    backbone: str = "edge"
    fusion: str = "none"
    head: str = "interpolated"  # interpolated | fine: for classes finer than half the picture's resolution
    stream: str = "u-net"  # architecture of each stream of a two-stream network
    start: str = "random"  # random | frozen | fine-tuned: the latter two load ImageNet weights into the backbone
    frozen_epochs: int = 50


@dataclass(frozen=True)
class DataRecipe:
    """What the network sees."""

    channels: tuple[str, ...] = (*COLOUR, "depth")
    near: float = 0.25  # metres
    far: float = 0.90
    # Finest and coarsest edge of a pixel on the parts, metres; empty = unknown. The default is `semascan synth`'s.
    footprint: tuple[float, ...] = (0.0006, 0.00115)
    augment: float = 0.5  # share of the images that are augmented
    augment_validation: bool = False  # [Remanufacturing paper] validates on augmented images
    part_pattern: str = ""  # labelme: pattern of file names; its first group that matches is the part
    scale: float = 1.0  # labelme: pictures are resized by this factor
    window: tuple[float, ...] = ()  # columns and rows around the labelled part that are taken; empty = whole pictures
    split_seed: int = 1
    test_parts: int = 1  # of every ten parts; 0 = none


@dataclass(frozen=True)
class TrainingRecipe:
    """How the weights are found."""

    loss: str = "dice+focal"
    focal_gamma: float = 2.0
    class_weights: tuple[float, ...] = ()  # of the focal loss; empty = all alike
    # Weight of what the start (--start, a trunk) says where nothing is known; 0 = it may change there. Learning without
    # forgetting [Li 2018].
    keep: float = 0.0
    optimiser: str = "adamw"
    learning_rate: float = 2e-3
    weight_decay: float = 1e-2
    schedule: str = "one-cycle"
    epochs: int = 40
    epoch_images: int = 0  # images of one epoch, a part of them or several times all; 0 = each once
    validation_images: int = 0  # 0 = all
    batch: int = 8
    precision: str = "float32"  # float32 | bfloat16: convolutions in 16 bits, faster where the processor has them
    seed: int = 1


@dataclass(frozen=True)
class EnsembleRecipe:
    """Members differ in their training parts, as in [Remanufacturing paper].

    With `fork_epochs` they fork from a trunk trained on all of them.
    """

    members: int = 1
    composition: str = "all"  # all | bootstrap: as many parts, drawn with replacement | subset: 80 % of the parts
    fork_epochs: int = 0
    fork_learning_rate: float = 1e-3


@dataclass(frozen=True)
class Recipe:
    """One network (or ensemble) with its name and task."""

    name: str
    task: str
    network: NetworkRecipe
    version: str = "1"
    data: DataRecipe = field(default_factory=DataRecipe)
    training: TrainingRecipe = field(default_factory=TrainingRecipe)
    ensemble: EnsembleRecipe = field(default_factory=EnsembleRecipe)

    @property
    def uses_depth(self) -> bool:
        """Whether the network sees depth."""
        return "depth" in self.data.channels

    @property
    def uses_colour(self) -> bool:
        """Whether the network sees colour."""
        return "red" in self.data.channels


def read_recipe(path: Path) -> Recipe:
    """Reads and checks a recipe; an error names the file and the field."""
    try:
        table = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, tomllib.TOMLDecodeError) as error:
        raise TrainingError(f"{path}: {error}") from error
    try:
        recipe = _from_table(Recipe, table, "")
        _check(recipe)
    except TrainingError as error:
        raise TrainingError(f"{path}: {error}") from error
    return recipe


def _from_table(kind: type, table: dict, prefix: str):
    known = {f.name: f for f in fields(kind)}
    for key in table:
        if key not in known:
            raise TrainingError(f"{prefix}{key}: no such field; known are {', '.join(known)}")
    values = {}
    for name, f in known.items():
        if name not in table:
            if f.default is MISSING and f.default_factory is MISSING:
                raise TrainingError(f"{prefix}{name} is missing")
            continue
        value, expected = table[name], f.type
        if is_dataclass(expected):
            if not isinstance(value, dict):
                raise TrainingError(f"{prefix}{name}: a table is expected")
            values[name] = _from_table(expected, value, f"{prefix}{name}.")
        elif expected == tuple[str, ...]:
            if not isinstance(value, list) or not all(isinstance(item, str) for item in value):
                raise TrainingError(f"{prefix}{name}: a list of names is expected")
            values[name] = tuple(value)
        elif expected == tuple[float, ...]:
            if not isinstance(value, list) or not all(type(item) in (int, float) for item in value):
                raise TrainingError(f"{prefix}{name}: a list of numbers is expected")
            values[name] = tuple(map(float, value))
        elif expected is float and type(value) in (int, float):
            values[name] = float(value)
        elif type(value) is expected:
            values[name] = value
        else:
            raise TrainingError(f"{prefix}{name}: {expected.__name__} is expected, not {value!r}")
    return kind(**values)


def _check(recipe: Recipe) -> None:
    choices = [
        ("task", recipe.task, TASKS),
        ("network.start", recipe.network.start, STARTS),
        ("network.head", recipe.network.head, HEADS),
        ("training.loss", recipe.training.loss, LOSSES),
        ("training.optimiser", recipe.training.optimiser, OPTIMISERS),
        ("training.schedule", recipe.training.schedule, SCHEDULES),
        ("training.precision", recipe.training.precision, PRECISIONS),
        ("ensemble.composition", recipe.ensemble.composition, COMPOSITIONS),
        ("data.channels", recipe.data.channels, (COLOUR, (*COLOUR, "depth"), ("depth",))),
    ]
    for name, value, allowed in choices:
        if value not in allowed:
            raise TrainingError(f"{name}: {value!r} is not one of {allowed}")
    if recipe.network.fusion != "none" and recipe.network.architecture not in FUSED:
        raise TrainingError(f"network.fusion: a {recipe.network.architecture} has none; {', '.join(FUSED)} have")
    if not 0 < recipe.data.near < recipe.data.far:
        raise TrainingError("data.near, data.far: 0 < near < far is expected")
    footprint = recipe.data.footprint
    if footprint and not (len(footprint) == 2 and 0 < footprint[0] <= footprint[1]):
        raise TrainingError("data.footprint: two lengths, the finest first, or none are expected")
    window = recipe.data.window
    if window and not (len(window) == 2 and all(side > 0 and side % SIDE == 0 for side in window)):
        raise TrainingError(f"data.window: columns and rows, multiples of {SIDE}, or none are expected")
    if not 0 <= recipe.data.test_parts <= 8:
        raise TrainingError(f"data.test_parts: 0 to 8 of every ten are expected, not {recipe.data.test_parts}")
    positive = (
        ("training.epochs", recipe.training.epochs),
        ("training.batch", recipe.training.batch),
        ("training.learning_rate", recipe.training.learning_rate),
        ("ensemble.members", recipe.ensemble.members),
        ("data.scale", recipe.data.scale),
    )
    for name, value in positive:
        if value <= 0:
            raise TrainingError(f"{name}: more than 0 is expected, not {value}")
    if recipe.training.keep < 0:
        raise TrainingError(f"training.keep: 0 or more is expected, not {recipe.training.keep}")
    if recipe.training.keep and recipe.training.loss == "mask-rcnn":
        raise TrainingError("training.keep: is for networks that label pixels, not for detectors")
    if recipe.ensemble.members > 1 and recipe.ensemble.composition == "all":
        raise TrainingError("ensemble.composition: members of an ensemble differ in their data: bootstrap or subset")
