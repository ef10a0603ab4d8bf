"""Batches: order and augmentations of an epoch."""

import numpy as np
import pytest
from conftest import write_recipe

pytest.importorskip("torch", reason="needs PyTorch")

from semascan_training.batches import Epoch, training_batches
from semascan_training.dataset import open_samples
from semascan_training.recipe import read_recipe


def test_an_epoch_depends_on_its_seed_alone(tmp_path, data):
    recipe = read_recipe(write_recipe(tmp_path / "r.toml"))
    samples = open_samples(data, recipe)
    rows = np.arange(8)
    first, again, other = (list(training_batches(samples, rows, recipe, 0, epoch)) for epoch in (1, 1, 2))
    assert all(a.image.equal(b.image) and a.labels.equal(b.labels) for a, b in zip(first, again))
    assert not all(a.image.equal(b.image) for a, b in zip(first, other))
    ahead = list(training_batches(samples, rows, recipe, 0, 1, workers=2))
    assert len(ahead) == len(first)
    assert all(a.image.equal(b.image) and a.labels.equal(b.labels) for a, b in zip(first, ahead))


def test_an_epoch_may_go_through_the_rows_several_times(tmp_path, data):
    recipe = read_recipe(write_recipe(tmp_path / "r.toml", training={"epoch_images": 20}))
    epoch = Epoch(open_samples(data, recipe), np.arange(8), recipe, 0, 1)
    assert len(epoch) == 5 and sorted(epoch.order[:8]) == sorted(epoch.order[8:16]) == list(range(8))
    assert list(epoch.order[:8]) != list(epoch.order[8:16])
