"""Training: resuming, forking, time limits, starts."""

import json
import time

import cv2
import numpy as np
import pytest
from conftest import write_recipe, write_set

torch = pytest.importorskip("torch", reason="needs PyTorch")

from semascan_training.batches import make_batch
from semascan_training.dataset import open_samples
from semascan_training.dataset.samples import IGNORE
from semascan_training.errors import TrainingError
from semascan_training.losses import centre_loss, dice_loss, keeping_loss
from semascan_training.networks import make_network
from semascan_training.recipe import read_recipe
from semascan_training.run import load_checkpoint
from semascan_training.schedule import learning_rate
from semascan_training.train import Options, train
from semascan_training.weights import load_imagenet, load_start


def weights(folder):
    return load_checkpoint(folder)["network"]


def test_a_resumed_run_ends_where_an_uninterrupted_one_does(tmp_path, data):
    recipe = write_recipe(tmp_path / "r.toml", training={"epochs": 3, "epoch_images": 12})
    train(recipe, data, tmp_path / "whole", Options())
    train(recipe, data, tmp_path / "parts", Options(epochs=1))
    with pytest.raises(TrainingError, match="--resume"):
        train(recipe, data, tmp_path / "parts", Options())
    train(recipe, data, tmp_path / "parts", Options(resume=True))
    whole, parts = weights(tmp_path / "whole" / "member-0"), weights(tmp_path / "parts" / "member-0")
    assert all(whole[name].equal(parts[name]) for name in whole)
    assert load_checkpoint(tmp_path / "parts" / "member-0")["epoch"] == 3


def test_dice_means_over_the_classes_that_are_shown():
    labels = torch.zeros(2, 8, 8, dtype=torch.long)
    labels[:, :2] = 1
    labels[:, 6:] = IGNORE
    scores = torch.zeros(2, 3, 8, 8)
    scores[:, 0] = scores[:, 2] = 0.5
    scores.requires_grad_(True)
    loss = dice_loss(scores, labels)
    # Of 96 known pixels 64 are of class 0 and 32 of class 1; class 2 is not shown.
    nothing, one = (2 * 32 + 1) / (48 + 64 + 1), 1 / (32 + 1)
    assert loss.item() == pytest.approx(1 - (nothing + one) / 2)
    loss.backward()
    assert scores.grad[:, 2].abs().sum() == 0 and scores.grad[:, :, 6:].abs().sum() == 0
    assert dice_loss(scores, torch.full_like(labels, IGNORE)).item() == 0


def test_the_start_has_a_say_only_where_nothing_is_known():
    torch.manual_seed(0)
    labels = torch.zeros(1, 4, 4, dtype=torch.long)
    labels[:, 2:] = IGNORE
    before = torch.randn(1, 3, 4, 4)
    logits = before.clone()
    logits[:, :, :2] += torch.randn(1, 3, 2, 4)  # where labels are
    logits += 2.0  # the same probabilities
    assert keeping_loss(logits, before, labels).item() == pytest.approx(0, abs=1e-6)
    logits[0, 1, 3, 3] += 3.0
    logits.requires_grad_(True)
    loss = keeping_loss(logits, before, labels)
    p, q = (scores[0, :, 3, 3].softmax(0) for scores in (before, logits))
    assert loss.item() == pytest.approx(((p * (p / q).log()).sum() / 8).item(), rel=1e-4)
    loss.backward()
    assert logits.grad[:, :, :2].abs().sum() == 0
    assert keeping_loss(logits, before, torch.zeros_like(labels)).item() == 0


def test_keeping_needs_a_start_and_holds_the_network_to_it(tmp_path, data):
    (unknown := tmp_path / "unknown").mkdir()
    write_set(unknown, parts=10)
    mark_unknown(unknown)
    recipe = write_recipe(tmp_path / "start.toml", training={"epochs": 1})
    start = train(recipe, data, tmp_path / "start", Options()).folder
    moved = {}
    for keep in (0.0, 50.0):
        recipe = write_recipe(tmp_path / "r.toml", training={"epochs": 2, "learning_rate": 5e-3, "keep": keep})
        run = train(recipe, unknown, tmp_path / f"run-{keep}", Options(start=(start,)))
        moved[keep] = divergence(run, start, unknown)
    assert moved[50.0] < 0.5 * moved[0.0]
    with pytest.raises(TrainingError, match="--start"):
        train(recipe, data, tmp_path / "none", Options())
    with pytest.raises(TrainingError, match="detectors"):
        read_recipe(write_recipe(tmp_path / "d.toml", "md-net", training={"keep": 1.0, "loss": "mask-rcnn"}))


def mark_unknown(folder):
    """Leaves the upper half of every label picture open."""
    index = json.loads((folder / "dataset.json").read_text())
    (folder / "dataset.json").write_text(json.dumps(index | {"ignore": IGNORE}))
    for path in folder.glob("*/labels/*.png"):
        labels = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
        labels[: len(labels) // 2] = IGNORE
        cv2.imwrite(str(path), labels)


@torch.no_grad()
def divergence(run, start, folder):
    """How far the run's network is from the start where nothing is known."""
    samples = open_samples(folder, run.recipe)
    batch = make_batch(samples, np.arange(8), run.recipe, None)
    outputs = []
    for path in (run.folder, start):
        network = make_network(run.recipe, len(samples.classes))
        load_start(network, path)
        outputs.append(network.eval()(batch.image)["logits"])
    return keeping_loss(*outputs, batch.labels).item()


def test_a_centre_where_nothing_is_known_costs_nothing():
    logits = torch.full((1, 2, 4, 4), -6.0)
    logits[0, 1, 3, 3] = 4.0
    heat, known = torch.zeros(1, 2, 4, 4), torch.ones(1, 1, 4, 4)
    false = centre_loss(logits, heat, known).item()
    known[0, 0, 3, 3] = 0
    assert centre_loss(logits, heat, known).item() < 0.01 * false


def test_members_fork_from_a_trunk_and_part_ways(tmp_path, data):
    recipe = write_recipe(
        tmp_path / "r.toml",
        training={"epochs": 1, "epoch_images": 8},
        ensemble={"members": 2, "composition": "bootstrap", "fork_epochs": 1, "fork_learning_rate": 1e-6},
    )
    run = train(recipe, data, tmp_path / "run", Options())
    trunk, *members = (weights(run.folder / name) for name in ("trunk", "member-0", "member-1"))
    name = "backbone.stages.0.0.0.weight"
    for member in members:  # a tiny learning rate: a member that did not fork would be far away
        torch.testing.assert_close(member[name], trunk[name], atol=1e-4, rtol=0)
        assert not member[name].equal(trunk[name])
    assert not members[0][name].equal(members[1][name])


def test_a_time_limit_ends_the_run_and_its_schedule(tmp_path, data):
    recipe = write_recipe(tmp_path / "r.toml", training={"epochs": 1000, "epoch_images": 8})
    begin = time.monotonic()
    run = train(recipe, data, tmp_path / "run", Options(hours=4 / 3600))
    assert time.monotonic() - begin < 20
    log = run.log("member-0")
    assert 1 < len(log) < 1000
    assert log[-1]["progress"] >= 1.0
    assert log[-1]["learning_rate"] < 0.5 * max(entry["learning_rate"] for entry in log)


def test_the_schedule_in_steps_falls_by_a_fifth_every_ten_epochs(tmp_path):
    path = write_recipe(tmp_path / "r.toml", training={"schedule": "steps", "epochs": 200})
    recipe = read_recipe(path)
    assert learning_rate(recipe, 1.0, 0.0) == 1.0
    assert learning_rate(recipe, 1.0, 9.99 / 200) == 1.0
    assert learning_rate(recipe, 1.0, 10.01 / 200) == pytest.approx(0.8)
    assert learning_rate(recipe, 1.0, 195 / 200) == pytest.approx(0.8**19)


def test_imagenet_weights_come_from_a_file_or_not_at_all(tmp_path):
    from torchvision.models import resnet34

    path = write_recipe(tmp_path / "r.toml", network={"backbone": "resnet34", "start": "fine-tuned", "fusion": "early"})
    network = make_network(read_recipe(path), 3)
    with pytest.raises(TrainingError, match="--imagenet"):
        load_imagenet(network, None, "network.start")
    theirs = resnet34(weights=None).state_dict()
    torch.save(theirs, tmp_path / "resnet34.pth")
    load_imagenet(network, tmp_path / "resnet34.pth", "network.start")
    stages = network.backbone.stages
    assert stages[4][2].conv2.weight.equal(theirs["layer4.2.conv2.weight"])
    first = stages[0][0].weight
    assert first[:, :3].equal(theirs["conv1.weight"])
    torch.testing.assert_close(first[:, 3], theirs["conv1.weight"].mean(1))


def test_vgg16_weights_find_their_places():
    from torchvision.models import vgg16_bn

    from semascan_training.networks.backbones.vgg16 import Vgg16

    theirs, own = vgg16_bn(weights=None).state_dict(), Vgg16(3).state_dict()
    named = {Vgg16.from_torchvision(key): value for key, value in theirs.items()}
    assert all(key in named and named[key].shape == value.shape for key, value in own.items())


def test_a_frozen_backbone_stands_still(tmp_path, data):
    from torchvision.models import resnet34

    torch.save(resnet34(weights=None).state_dict(), tmp_path / "resnet34.pth")
    frozen = {"backbone": "resnet34", "start": "frozen", "frozen_epochs": 1}
    recipe = write_recipe(
        tmp_path / "r.toml", "u-net", network=frozen, training={"epochs": 2, "epoch_images": 4, "schedule": "steps"}
    )
    options = Options(imagenet=tmp_path / "resnet34.pth")
    name = "backbone.stages.2.0.conv1.weight"
    start = torch.load(tmp_path / "resnet34.pth")["layer2.0.conv1.weight"]
    train(recipe, data, tmp_path / "run", Options(imagenet=options.imagenet, epochs=1))
    assert weights(tmp_path / "run" / "member-0")[name].equal(start)
    train(recipe, data, tmp_path / "run", Options(imagenet=options.imagenet, resume=True))
    assert not weights(tmp_path / "run" / "member-0")[name].equal(start)


def test_streams_and_encoders_start_from_a_network_with_early_fusion(tmp_path, data):
    early = write_recipe(tmp_path / "early.toml", training={"epochs": 1})
    run = train(early, data, tmp_path / "early", Options())
    trained = weights(run.folder / "member-0")
    first, later = trained["backbone.stages.0.0.0.weight"], trained["backbone.stages.1.0.first.0.weight"]

    begun = train(early, data, tmp_path / "begun", Options(start=(run.folder,), epochs=1))
    assert begun.started_from == ["early"]
    assert train(early, data, tmp_path / "begun", Options(resume=True)).started_from == ["early"]

    both = make_network(read_recipe(write_recipe(tmp_path / "both.toml", "two-stream", "two-stream")), 3)
    assert load_start(both, run.folder) == ["contribution.weight", "contribution.bias"]
    fused = write_recipe(tmp_path / "late.toml", network={"fusion": "late-add"})
    fused = make_network(read_recipe(fused), 3)
    assert load_start(fused, run.folder) == []
    for colour, depth in ((both.colour.backbone, both.depth.backbone), (fused.encoder.colour, fused.encoder.depth)):
        assert colour.stages[0][0][0].weight.equal(first[:, :3])
        assert depth.stages[0][0][0].weight.equal(first[:, 3:])
        assert colour.stages[1][0].first[0].weight.equal(later)

    vgg = make_network(read_recipe(write_recipe(tmp_path / "vgg.toml", network={"backbone": "vgg16"})), 3)
    with pytest.raises(TrainingError, match="none of its weights"):
        load_start(vgg, run.folder)
