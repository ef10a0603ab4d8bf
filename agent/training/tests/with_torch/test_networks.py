"""Every architecture and fusion variant: shapes, and that it learns four images by heart."""

import numpy as np
import pytest
from conftest import CLASSES, HEIGHT, RECIPES, WIDTH, write_recipe

torch = pytest.importorskip("torch", reason="needs PyTorch")

from semascan_training.batches import Batch, make_batch
from semascan_training.dataset import open_samples
from semascan_training.losses import training_loss
from semascan_training.networks import make_network
from semascan_training.recipe import read_recipe
from semascan_training.schedule import make_optimiser
from semascan_training.weights import load_start

FUSIONS = ("early", "intermediate-add", "intermediate-conv", "late-add", "late-network")
RGB = ["red", "green", "blue"]
SEMANTIC = [
    ("u-net", "none", RGB),
    ("u-net", "none", ["depth"]),
    ("fcn", "none", [*RGB, "depth"]),
    ("two-stream", "none", [*RGB, "depth"]),
    ("instance", "none", [*RGB, "depth"]),
    *[("ud-net", fusion, [*RGB, "depth"]) for fusion in FUSIONS],
]
DETECTORS = [
    ("md-net", "early", [*RGB, "depth"]),
    *[
        pytest.param(*which, marks=pytest.mark.slow)
        for which in (
            ("mask-rcnn", "none", RGB),
            *[("md-net", fusion, [*RGB, "depth"]) for fusion in FUSIONS[1:]],
        )
    ],
]


def small_recipe(tmp_path, architecture, fusion, channels, **network):
    loss = "mask-rcnn" if architecture in ("mask-rcnn", "md-net") else "dice+focal"
    path = write_recipe(
        tmp_path / "recipe.toml",
        architecture,
        channels=channels,
        network={"fusion": fusion, **network},
        training={"loss": loss, "learning_rate": 1e-4 if loss == "mask-rcnn" else 3e-3},
    )
    return read_recipe(path)


@pytest.mark.parametrize(("architecture", "fusion", "channels"), SEMANTIC)
def test_four_images_are_learned(tmp_path, data, architecture, fusion, channels):
    recipe = small_recipe(tmp_path, architecture, fusion, channels)
    samples = open_samples(data, recipe)
    batch = make_batch(samples, np.arange(4), recipe, None)
    torch.manual_seed(0)
    network = make_network(recipe, len(CLASSES)).train()
    optimiser = make_optimiser(network, recipe)
    losses = []
    for _ in range(25):
        outputs = network(batch.image)
        assert outputs["logits"].shape == (4, len(CLASSES), HEIGHT, WIDTH)
        loss = training_loss(network, batch, recipe)
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
        losses.append(float(loss.detach()))
    assert losses[-1] < 0.5 * losses[0], losses
    agreement = (network(batch.image)["logits"].argmax(1) == batch.labels).float().mean()
    assert agreement > 0.9


@pytest.mark.parametrize(("architecture", "fusion", "channels"), DETECTORS)
def test_detectors_give_losses_and_probabilities(tmp_path, data, architecture, fusion, channels):
    recipe = small_recipe(tmp_path, architecture, fusion, channels)
    samples = open_samples(data, recipe)
    batch = make_batch(samples, np.arange(2), recipe, None)
    torch.manual_seed(0)
    network = make_network(recipe, len(CLASSES)).train()
    optimiser = make_optimiser(network, recipe)
    losses = []
    for _ in range(6):
        loss = training_loss(network, batch, recipe)
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
        losses.append(float(loss.detach()))
    assert min(losses[3:]) < losses[0], losses
    network.eval()
    with torch.no_grad():
        outputs = network(batch.image)
    assert outputs["probabilities"].shape == (2, len(CLASSES), HEIGHT, WIDTH)
    torch.testing.assert_close(outputs["probabilities"].sum(1), torch.ones(2, HEIGHT, WIDTH))


@pytest.mark.parametrize("fusion", FUSIONS)
def test_a_detector_starts_from_the_encoders_of_a_ud_net(tmp_path, fusion):
    torch.manual_seed(0)
    source = make_network(small_recipe(tmp_path, "ud-net", fusion, [*RGB, "depth"]), len(CLASSES))
    torch.save({"network": source.state_dict()}, tmp_path / "checkpoint.pt")
    detector = make_network(small_recipe(tmp_path, "md-net", fusion, [*RGB, "depth"]), len(CLASSES))
    missing = load_start(detector, tmp_path / "checkpoint.pt")
    assert not [name for name in missing if ".stages." in name]
    filters = {name: value for name, value in source.state_dict().items() if name.endswith("stages.1.0.first.0.weight")}
    own = [value for name, value in detector.state_dict().items() if name.endswith("stages.1.0.first.0.weight")]
    assert len(own) == len(filters) and all(a.equal(b) for a, b in zip(own, filters.values()))


@pytest.mark.parametrize("backbone", ["vgg16", "resnet34"])
@pytest.mark.parametrize(
    ("architecture", "fusion"), [("u-net", "none"), ("ud-net", "intermediate-add"), ("fcn", "none")]
)
def test_large_backbones(tmp_path, backbone, architecture, fusion):
    recipe = small_recipe(tmp_path, architecture, fusion, [*RGB, "depth"], backbone=backbone)
    network = make_network(recipe, 3).eval()
    with torch.no_grad():
        assert network(torch.rand(1, 4, 64, 96))["logits"].shape == (1, 3, 64, 96)


def test_a_fine_head_draws_what_is_thinner_than_its_decoder(tmp_path):
    recipe = small_recipe(tmp_path, "u-net", "none", RGB, head="fine")
    torch.manual_seed(0)
    labels = torch.zeros(2, 64, 96, dtype=torch.int64)
    labels[:, 21, 8:80] = 1
    labels[:, 8:50, 41] = 1
    image = torch.randn(2, 3, 64, 96) * 0.1 + labels.unsqueeze(1)
    network = make_network(recipe, 2).train()
    optimiser = make_optimiser(network, recipe)
    for _ in range(40):
        loss = training_loss(network, Batch(image, labels, labels), recipe)
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
    drawn = network(image)["logits"].argmax(1) == 1
    assert (drawn & (labels == 1)).sum() / (drawn | (labels == 1)).sum() > 0.9


def test_contribution_is_colours_alone_where_depth_is_missing(tmp_path):
    network = make_network(small_recipe(tmp_path, "two-stream", "none", [*RGB, "depth"]), 3).eval()
    picture = torch.rand(1, 4, 64, 64).clamp(min=0.1)
    picture[:, 3, :32] = 0
    with torch.no_grad():
        outputs = network(picture)
    share = outputs["contribution"]
    assert torch.all(share[:, :, :32] == 1)
    assert torch.all(share[:, :, 32:] < 1)
    by_colour = outputs["colour_logits"].softmax(1)
    torch.testing.assert_close(outputs["probabilities"][:, :, :32], by_colour[:, :, :32])


def test_every_recipe_can_be_built():
    for path in sorted(RECIPES.glob("*.toml")):
        recipe = read_recipe(path)
        if recipe.network.backbone == "edge":
            make_network(recipe, 6)
