"""Weights in 16 and 8 bits: smaller, and the same network within rounding, in ONNX Runtime."""

import numpy as np
import onnx
import onnxruntime
import pytest
from onnx import TensorProto, helper, numpy_helper

from semascan_training.weight_storage import store_halved, store_in_eight_bits, whole_initializers, widened


@pytest.fixture
def model() -> onnx.ModelProto:
    """Two convolutions; the filters are larger than a kilobyte, the biases are not."""
    rng = np.random.default_rng(5)

    def weights(name, *shape):
        return numpy_helper.from_array(rng.normal(0, 0.1, shape).astype(np.float32), name)

    first = helper.make_node("Conv", ["image", "first", "bias"], ["inner"], pads=[1, 1, 1, 1])
    second = helper.make_node("Conv", ["inner", "second"], ["probabilities"], pads=[1, 1, 1, 1])
    graph = helper.make_graph(
        [first, second],
        "network",
        [helper.make_tensor_value_info("image", TensorProto.FLOAT, ["n", 4, "h", "w"])],
        [helper.make_tensor_value_info("probabilities", TensorProto.FLOAT, ["n", 8, "h", "w"])],
        [weights("first", 32, 4, 3, 3), weights("bias", 32), weights("second", 8, 32, 3, 3)],
    )
    return helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)


def outputs_of(model: onnx.ModelProto) -> np.ndarray:
    session = onnxruntime.InferenceSession(model.SerializeToString(), providers=["CPUExecutionProvider"])
    picture = np.random.default_rng(6).normal(0, 1, (1, 4, 24, 32)).astype(np.float32)
    return session.run(["probabilities"], {"image": picture})[0]


def test_16_bits_halve_the_file_and_hardly_change_the_result(model):
    stored = store_halved(model)
    kinds = {tensor.name: tensor.data_type for tensor in stored.graph.initializer}
    half, whole = TensorProto.FLOAT16, TensorProto.FLOAT
    assert kinds == {"first_half": half, "bias": whole, "second_half": half}
    assert stored.ByteSize() < 0.6 * model.ByteSize()
    assert np.abs(outputs_of(stored) - outputs_of(model)).max() < 5e-3


def test_weights_in_16_bits_are_plain_ones_again(model):
    plain = widened(store_halved(model))
    assert [node.op_type for node in plain.graph.node] == ["Conv", "Conv"]
    before, after = whole_initializers(store_halved(model)), whole_initializers(plain)
    assert before.keys() == after.keys() == {"first", "bias", "second"}
    assert all(np.array_equal(before[name], after[name]) for name in before)


def test_8_bits_come_back_within_half_a_step(model):
    stored = store_in_eight_bits(model)
    assert stored.ByteSize() < 0.4 * model.ByteSize()
    before, after = whole_initializers(model), whole_initializers(stored)
    assert np.array_equal(before["bias"], after["bias"])
    for name in ("first", "second"):
        step = np.abs(before[name]).max(axis=(1, 2, 3), keepdims=True) / 127
        assert (np.abs(before[name] - after[name]) <= 0.5 * step + 1e-7).all()
    whole, rounded = outputs_of(model), outputs_of(stored)
    assert np.abs(whole - rounded).mean() < 0.02 * np.abs(whole).mean()


def test_a_weight_beyond_16_bits_stays_in_32(model):
    large = next(tensor for tensor in model.graph.initializer if tensor.name == "second")
    values = numpy_helper.to_array(large) * 1e9
    large.CopyFrom(numpy_helper.from_array(values, "second"))
    assert "second" in {tensor.name for tensor in store_halved(model).graph.initializer}
