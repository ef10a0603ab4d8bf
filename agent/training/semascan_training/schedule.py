"""Optimisers and learning rates as functions of progress, 0 at the start and 1 at the end of the training.

Progress is what epochs or, with a time limit, hours have passed of those granted: so a schedule always ends where it
should, whatever the machine.
"""

import math

import torch

from .recipe import Recipe

STEP_EPOCHS = 10
STEP_FACTOR = 0.8
"""[Remanufacturing paper], Table 2: reduced by 20 % every 10 epochs."""
WARM_UP = 0.1
FLOOR = 1e-3
"""One-cycle: rises over the first tenth, falls on a cosine to a thousandth (after [Smith 2018])."""


def learning_rate(recipe: Recipe, peak: float, progress: float) -> float:
    """The learning rate at that progress."""
    if recipe.training.schedule == "steps":
        return peak * STEP_FACTOR ** math.floor(progress * recipe.training.epochs / STEP_EPOCHS)
    if progress < WARM_UP:
        return peak * max(FLOOR, progress / WARM_UP)
    fall = 0.5 * (1 + math.cos(math.pi * min(1.0, (progress - WARM_UP) / (1 - WARM_UP))))
    return peak * max(FLOOR, fall)


def make_optimiser(network: torch.nn.Module, recipe: Recipe) -> torch.optim.Optimizer:
    """The recipe's optimiser; weight decay spares biases and normalisations."""
    training = recipe.training
    weights = [p for p in network.parameters() if p.ndim > 1]
    others = [p for p in network.parameters() if p.ndim <= 1]
    groups = [{"params": weights, "weight_decay": training.weight_decay}, {"params": others, "weight_decay": 0.0}]
    fused = all(p.is_cuda for p in network.parameters())  # one step of all weights in a few kernels
    if training.optimiser == "sgd":
        return torch.optim.SGD(groups, training.learning_rate, momentum=0.9, fused=fused)
    kind = torch.optim.Adam if training.optimiser == "adam" else torch.optim.AdamW
    return kind(groups, training.learning_rate, fused=fused)
