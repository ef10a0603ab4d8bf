"""Training of a recipe: stages (trunk and members) of epochs, each epoch checkpointed.

An epoch's order, augmentations and random numbers follow from seed, stage and epoch, so a run that is resumed at any
epoch ends with the same weights as one that was never stopped. With a time limit the schedule follows the clock
instead, and the result depends on the machine.
"""

import copy
import json
import time
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import torch

from .batches import evaluation_batches, training_batches
from .dataset import Samples, composition, open_samples, split_by_part
from .errors import TrainingError
from .losses import training_loss
from .metrics import Confusion
from .networks import make_network
from .recipe import Recipe, read_recipe
from .run import INDEX, LOG, RECIPE, Run, load_checkpoint, open_run, save_checkpoint
from .schedule import learning_rate, make_optimiser
from .weights import load_imagenet, load_start

TRUNK = "trunk"


@dataclass(frozen=True)
class Options:
    """What a call adds to its recipe."""

    hours: float | None = None  # for all stages together
    resume: bool = False
    start: tuple[Path, ...] = ()  # runs or exported models whose weights are the start
    imagenet: Path | None = None
    threads: int = 1
    epochs: int | None = None  # stop after so many epochs of a stage: to test resuming


@dataclass(frozen=True)
class Stage:
    """One training from a start to an end."""

    name: str
    number: int
    rows: np.ndarray
    epochs: int
    peak_rate: float
    hours: float | None


def train(recipe_path: Path, data: Path, out: Path, options: Options) -> Run:
    """Trains every stage of the recipe that is not finished yet."""
    device = prepare(options.threads)
    recipe = read_recipe(recipe_path)
    if (out / RECIPE).exists() and not options.resume:
        raise TrainingError(f"{out}: holds a run already; continue it with --resume or name another folder")
    samples = open_samples(data, recipe, options.threads)
    split = split_by_part(samples.parts, recipe.data.split_seed, recipe.data.test_parts)
    weights = recipe.training.class_weights
    if weights and len(weights) != len(samples.classes):
        raise TrainingError(f"training.class_weights: {len(samples.classes)} are expected, for {samples.classes}")
    started_from = [path.name for path in options.start]
    if (out / INDEX).exists():  # resumed: what it began with stays true
        started_from = open_run(out).started_from or started_from
    threads = f"{options.threads} thread{'s' if options.threads > 1 else ''}"
    used = device.type if device.type != "cpu" else f"cpu, {threads}"
    run = Run(out, recipe, split, samples.classes, samples.about, started_from, used)
    run.save(recipe_path.read_text(encoding="utf-8"))
    if recipe.training.keep and not options.start:
        raise TrainingError("training.keep: what is kept of is the start; name it with --start, also for --resume")
    validation = split.rows(samples.parts, "validation")
    limit = recipe.training.validation_images
    if limit and limit < len(validation):
        validation = validation[np.linspace(0, len(validation) - 1, limit).round().astype(int)]
    for stage in stages(recipe, split.train, samples, options.hours):
        torch.manual_seed(recipe.training.seed + stage.number)
        network = make_network(recipe, len(samples.classes))
        trunk = out / TRUNK / "checkpoint.pt"
        _start(network, recipe, options, trunk if stage.number and trunk.exists() else None)
        Trainer(run, stage, network.to(device, memory_format=torch.channels_last), device).run_epochs(
            samples, validation, options.epochs
        )
    return run


def prepare(threads: int) -> torch.device:
    """Sets the number of threads and chooses the device: a GPU if there is one."""
    torch.set_num_threads(threads)
    cv2.setNumThreads(1)
    torch.backends.cudnn.benchmark = True  # all batches of a training have one size
    return torch.device("cuda" if torch.cuda.is_available() else "cpu")


def stages(recipe: Recipe, train_parts: list[str], samples: Samples, hours: float | None) -> list[Stage]:
    """A trunk on all training parts if the members fork from one, then the members on parts of their own."""
    ensemble, training = recipe.ensemble, recipe.training
    plan = []
    if ensemble.fork_epochs:
        plan.append((TRUNK, 0, list(train_parts), training.epochs, training.learning_rate))
    for member in range(ensemble.members):
        parts = composition(train_parts, ensemble.composition, training.seed, member)
        epochs = ensemble.fork_epochs or training.epochs
        rate = ensemble.fork_learning_rate if ensemble.fork_epochs else training.learning_rate
        plan.append((f"member-{member}", member + 1, parts, epochs, rate))
    rows_of = {}
    for row, part in enumerate(samples.parts):
        rows_of.setdefault(part, []).append(row)
    total = sum(epochs for _, _, _, epochs, _ in plan)
    return [
        Stage(
            name,
            number,
            np.array([row for part in parts for row in rows_of[part]], dtype=np.int64),
            epochs,
            rate,
            hours * epochs / total if hours else None,
        )
        for name, number, parts, epochs, rate in plan
    ]


def _start(network: torch.nn.Module, recipe: Recipe, options: Options, trunk: Path | None) -> None:
    if trunk is not None:
        load_start(network, trunk)
        return
    if recipe.network.start != "random":
        load_imagenet(network, options.imagenet, "network.start")
    for path in options.start:
        load_start(network, path)


class Trainer:
    """One stage: its network, optimiser and place."""

    def __init__(self, run: Run, stage: Stage, network: torch.nn.Module, device: torch.device):
        self.run, self.recipe, self.stage, self.network, self.device = run, run.recipe, stage, network, device
        self.folder = run.stage(stage.name)
        self.optimiser = make_optimiser(network, run.recipe)
        self.epoch, self.elapsed = 0, 0.0
        # A resumed stage has begun with the same start: its weights are in the network until the checkpoint's come.
        self.before = copy.deepcopy(network).eval().requires_grad_(False) if run.recipe.training.keep else None
        checkpoint = load_checkpoint(self.folder)
        if checkpoint is not None:
            network.load_state_dict(checkpoint["network"])
            self.optimiser.load_state_dict(checkpoint["optimiser"])
            self.epoch, self.elapsed = checkpoint["epoch"], checkpoint["elapsed"]

    def progress(self, share_of_epoch: float, seconds: float) -> float:
        """0..1, by the clock if there is a time limit."""
        if self.stage.hours:
            return (self.elapsed + seconds) / (3600 * self.stage.hours)
        return (self.epoch + share_of_epoch) / self.stage.epochs

    def run_epochs(self, samples: Samples, validation: np.ndarray, limit: int | None) -> None:
        """Trains to the stage's end, or to `limit` epochs."""
        while self.progress(0.0, 0.0) < 1.0 and (limit is None or self.epoch < limit):
            begin = time.monotonic()
            loss, images, rate = self.train_epoch(samples, begin)
            trained = time.monotonic()
            metrics = validate(self.network, samples, validation, self.recipe, self.device)
            self.elapsed += time.monotonic() - begin
            self.epoch += 1
            state = {"network": self.network.state_dict(), "optimiser": self.optimiser.state_dict()}
            save_checkpoint(self.folder, {**state, "epoch": self.epoch, "elapsed": self.elapsed})
            entry = {
                "epoch": self.epoch,
                "progress": round(self.progress(0.0, 0.0), 4),
                "elapsed_s": round(self.elapsed, 1),
                "learning_rate": rate,
                "loss": round(loss, 5),
                "images": images,
                "ms_per_image": round(1e3 * (trained - begin) / max(1, images), 1),
                "validation": metrics,
            }
            with (self.folder / LOG).open("a", encoding="utf-8") as log:
                log.write(json.dumps(entry) + "\n")

    def train_epoch(self, samples: Samples, begin: float) -> tuple[float, int, float]:
        """One epoch, or what the time limit leaves of it; mean loss, number of images, last learning rate."""
        self.network.train()
        torch.manual_seed((self.recipe.training.seed << 20) + (self.stage.number << 12) + self.epoch)
        size = self.recipe.training.epoch_images or len(self.stage.rows)
        losses, images, rate = [], 0, 0.0
        workers = torch.get_num_threads() - 1 if self.device.type == "cuda" else 0
        stage = self.stage
        for batch in training_batches(samples, stage.rows, self.recipe, stage.number, self.epoch, workers, self.device):
            progress = self.progress(images / size, time.monotonic() - begin)
            if progress >= 1.0:
                break
            self.freeze(progress)
            rate = learning_rate(self.recipe, stage.peak_rate, progress)
            for group in self.optimiser.param_groups:
                group["lr"] = rate
            loss = training_loss(self.network, batch, self.recipe, self.before)
            self.optimiser.zero_grad(set_to_none=True)
            loss.backward()
            self.optimiser.step()
            losses.append(loss.detach())  # read at the end: a GPU need not wait for each
            images += len(batch.labels)
        losses = torch.stack(losses).tolist() if losses else []
        if not np.isfinite(losses).all():
            raise TrainingError(f"{self.folder}: the loss is not finite in epoch {self.epoch}; lower the learning rate")
        return float(np.mean(losses)) if losses else 0.0, images, rate

    def freeze(self, progress: float) -> None:
        """The frozen start of [Remanufacturing paper]: the pretrained backbones stand still for the first epochs."""
        network = self.recipe.network
        if network.start != "frozen":
            return
        moving = progress * self.recipe.training.epochs >= network.frozen_epochs
        for module in self.network.modules():
            if hasattr(type(module), "from_torchvision"):
                module.requires_grad_(moving)
                module.train(moving)


@torch.no_grad()
def validate(
    network: torch.nn.Module, samples: Samples, rows: np.ndarray, recipe: Recipe, device: torch.device
) -> dict[str, float]:
    """Metrics of the network in its present state."""
    network.eval()
    confusion = Confusion.empty(len(samples.classes))
    for batch in evaluation_batches(samples, rows, recipe, recipe.data.augment_validation, device):
        logits = network(batch.image)["logits"]
        confusion.add(batch.labels.cpu().numpy(), logits.argmax(1).cpu().numpy())
    return confusion.table(samples.classes)
