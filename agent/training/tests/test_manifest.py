"""The manifest: what the agent reads of a network."""

import hashlib
import tomllib

import pytest
from conftest import CLASSES, write_recipe

from semascan_training.errors import TrainingError
from semascan_training.manifest import manifest_text, model_files
from semascan_training.recipe import read_recipe
from semascan_training.taxonomy import class_list


def test_files_input_and_classes_are_named(tmp_path):
    recipe = read_recipe(write_recipe(tmp_path / "r.toml"))
    network = tmp_path / "member-0.onnx"
    network.write_bytes(b"a network")
    outputs, training, metrics = {"contribution": "contribution"}, {"epochs": [3]}, {"mean_iou": 0.5}
    text = manifest_text(recipe, CLASSES, [network], outputs, training, metrics)
    (tmp_path / "model.toml").write_text(text, encoding="utf-8")

    table = tomllib.loads(text)
    assert (table["name"], table["task"], table["fusion"]) == ("small", "semantic", "early")
    assert table["network"] == [{"file": "member-0.onnx", "sha256": hashlib.sha256(b"a network").hexdigest()}]
    assert table["input"]["channels"] == ["red", "green", "blue", "depth"] and table["input"]["multiple"] == 32
    assert table["input"]["footprint"] == [0.0006, 0.00115]
    assert table["input"]["colour"] == {"mean": [0.485, 0.456, 0.406], "std": [0.229, 0.224, 0.225]}
    assert table["input"]["depth"] == {"near": 0.25, "far": 0.9, "missing": 0.0}
    assert table["output"] == {"tensor": "probabilities", "activation": "none", "contribution": "contribution"}
    assert table["classes"] == [{"name": c.name, "colour": c.colour} for c in class_list(CLASSES)]
    assert (table["training"], table["metrics"]) == ({"epochs": [3]}, {"mean_iou": 0.5})
    assert model_files(tmp_path) == [network]


def test_a_network_without_depth_is_given_no_depth(tmp_path):
    recipe = read_recipe(write_recipe(tmp_path / "r.toml", "u-net", "defect", ["red", "green", "blue"]))
    table = tomllib.loads(manifest_text(recipe, ["none", "corrosion"], [], {}, {}, {}))
    assert table["fusion"] == "none" and "depth" not in table["input"]
    assert table["classes"][1]["colour"] == class_list(["none", "corrosion"], defects=True)[1].colour


def test_a_broken_manifest_is_named(tmp_path):
    (tmp_path / "model.toml").write_text("[[network]]\n", encoding="utf-8")
    with pytest.raises(TrainingError, match=r"model\.toml"):
        model_files(tmp_path)
