"""Export: parity, 16-bit storage, manifest."""

import hashlib
import tomllib
from pathlib import Path

import numpy as np
import onnx
import onnxruntime
import pytest
from conftest import CLASSES, write_recipe
from onnx import TensorProto

torch = pytest.importorskip("torch", reason="needs PyTorch")

from semascan_training.export import Exported, example_picture, export, parity, to_onnx
from semascan_training.networks import make_network
from semascan_training.recipe import read_recipe
from semascan_training.train import Options, train
from semascan_training.weight_storage import store_in_eight_bits, whole_initializers, widened
from semascan_training.weights import load_start

RGBD = ["red", "green", "blue", "depth"]


@pytest.fixture(scope="module")
def model(tmp_path_factory, data) -> Path:
    """A small ensemble, exported with metrics."""
    folder = tmp_path_factory.mktemp("model")
    recipe = write_recipe(
        folder / "r.toml",
        network={"fusion": "early"},
        training={"epochs": 3},
        ensemble={"members": 2, "composition": "bootstrap"},
    )
    run = train(recipe, data, folder / "run", Options())
    export(run.folder, folder / "model", data)
    return folder / "model"


def test_the_manifest_says_what_the_agent_must_know(model):
    manifest = tomllib.loads((model / "model.toml").read_text())
    assert (manifest["schema"], manifest["name"], manifest["task"], manifest["fusion"]) == (
        1,
        "small",
        "semantic",
        "early",
    )
    assert manifest["input"]["channels"] == RGBD and manifest["input"]["multiple"] == 32
    assert manifest["input"]["depth"] == {"near": 0.25, "far": 0.9, "missing": 0.0}
    assert manifest["output"] == {"tensor": "probabilities", "activation": "none"}
    assert [c["name"] for c in manifest["classes"]] == CLASSES
    assert len(manifest["network"]) == 2
    for network in manifest["network"]:
        assert hashlib.sha256((model / network["file"]).read_bytes()).hexdigest() == network["sha256"]
    assert manifest["training"]["members"] == 2 and len(manifest["training"]["test_parts"]) == 1
    assert 0 <= manifest["metrics"]["mean_iou"] <= 1 and manifest["metrics"]["test_images"] == 4


def test_large_weights_are_stored_in_16_bits_and_can_be_a_start(model, tmp_path):
    stored = onnx.load(str(model / "member-0.onnx"))
    for tensor in stored.graph.initializer:
        size = int(np.prod(tensor.dims))
        assert size * 4 <= 1024 or tensor.data_type == TensorProto.FLOAT16, tensor.name
    recipe = read_recipe(write_recipe(tmp_path / "r.toml", network={"fusion": "early"}))
    network = make_network(recipe, len(CLASSES))
    assert load_start(network, model) == []
    picture = example_picture(1, 64, 96, 4, seed=5)
    assert parity(Exported(network).eval(), stored.SerializeToString(), picture) < 1e-4


@pytest.mark.parametrize(
    ("architecture", "fusion", "task", "outputs"),
    [
        ("ud-net", "late-network", "semantic", []),
        ("fcn", "none", "semantic", []),
        ("two-stream", "none", "two-stream", ["contribution"]),
        ("instance", "none", "instance", ["centres", "offsets"]),
    ],
)
def test_any_size_and_batch(tmp_path, architecture, fusion, task, outputs):
    recipe = read_recipe(write_recipe(tmp_path / "r.toml", architecture, task, network={"fusion": fusion}))
    network = make_network(recipe, 6)
    content, _ = to_onnx(network, recipe)
    graph = onnx.load_model_from_string(content).graph
    assert not {"Shape", "Loop", "If"} & {node.op_type for node in graph.node}
    session = onnxruntime.InferenceSession(content, providers=["CPUExecutionProvider"])
    assert [o.name for o in session.get_outputs()] == ["probabilities", *outputs]
    given = session.run(None, {"image": np.random.rand(3, 4, 64, 160).astype(np.float32)})
    assert given[0].shape == (3, 6, 64, 160)
    np.testing.assert_allclose(given[0].sum(1), 1.0, atol=1e-5)
    if architecture == "instance":
        assert given[1].shape == (3, 6, 16, 40) and given[2].shape == (3, 2, 16, 40)
    if architecture == "two-stream":
        assert given[1].shape == (3, 1, 64, 160)


@pytest.mark.slow
def test_an_untrained_mask_rcnn_exports(tmp_path):
    recipe = write_recipe(
        tmp_path / "r.toml", "mask-rcnn", "instance", ["red", "green", "blue"], network={"backbone": "resnet34"}
    )
    recipe = read_recipe(recipe)
    torch.manual_seed(0)
    content, _ = to_onnx(make_network(recipe, 6), recipe)
    session = onnxruntime.InferenceSession(content, providers=["CPUExecutionProvider"])
    assert [o.name for o in session.get_outputs()] == ["probabilities", "boxes", "labels", "scores", "masks"]
    picture = example_picture(1, 160, 256, 3, seed=9).numpy()
    probabilities, boxes, labels, scores, masks = session.run(None, {"image": picture})
    assert probabilities.shape == (1, 6, 160, 256)
    assert masks.shape == (len(boxes), 1, 160, 256) and len(labels) == len(scores) == len(boxes)


def test_weights_in_8_bits_come_back_within_half_a_step(model):
    halved = onnx.load(str(model / "member-0.onnx"))
    stored = store_in_eight_bits(widened(halved))
    assert len(stored.SerializeToString()) < 0.7 * len(halved.SerializeToString())
    before, after = whole_initializers(halved), whole_initializers(stored)
    assert before.keys() == after.keys()
    for name, values in before.items():
        if values.ndim == 4:
            step = np.abs(values).max(axis=(1, 2, 3), keepdims=True) / 127
            assert (np.abs(values - after[name]) <= 0.51 * step + 1e-9).all(), name
    picture = example_picture(1, 64, 96, 4, seed=5).numpy()
    halved, stored = (
        onnxruntime.InferenceSession(m.SerializeToString()).run(["probabilities"], {"image": picture})[0]
        for m in (halved, stored)
    )
    assert np.abs(halved - stored).mean() < 0.02
