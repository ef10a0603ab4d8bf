"""Convolutions that only shift, spelled out."""

import numpy as np
import onnx
import onnxruntime
from onnx import TensorProto, helper, numpy_helper

from semascan_training.shift_convolution import spell_out_shifts


def model(kernels: np.ndarray, pads: list[int]) -> onnx.ModelProto:
    graph = helper.make_graph(
        [helper.make_node("Conv", ["depth", "kernels"], ["neighbours"], pads=pads)],
        "neighbours",
        [helper.make_tensor_value_info("depth", TensorProto.FLOAT, ["n", 1, "h", "w"])],
        [helper.make_tensor_value_info("neighbours", TensorProto.FLOAT, ["n", len(kernels), "oh", "ow"])],
        [numpy_helper.from_array(kernels, "kernels")],
    )
    return helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)


def neighbours(model: onnx.ModelProto, depth: np.ndarray) -> np.ndarray:
    session = onnxruntime.InferenceSession(model.SerializeToString(), providers=["CPUExecutionProvider"])
    return session.run(["neighbours"], {"depth": depth})[0]


def test_every_shift_gives_the_same_bits():
    depth = np.random.default_rng(1).random((2, 1, 11, 7)).astype(np.float32)
    for pads in ([2, 2, 2, 2], [1, 0, 2, 3]):
        kernels = np.zeros((25, 1, 5, 5), np.float32)
        kernels.reshape(25, 25)[np.arange(25), np.arange(25)] = 1
        whole = model(kernels, pads)
        spelled = spell_out_shifts(whole)
        onnx.checker.check_model(spelled)
        assert "Conv" not in {node.op_type for node in spelled.graph.node}
        np.testing.assert_array_equal(neighbours(spelled, depth), neighbours(whole, depth))


def test_kernels_that_weigh_or_add_stay():
    for kernel in ([[0, 2, 0]], [[1, 0, 1]], [[0, 0, 0]]):
        whole = model(np.array([[kernel]], np.float32), [0, 1, 0, 1])
        assert spell_out_shifts(whole) == whole
