"""The softmax over classes, spelled out."""

import numpy as np
import onnx
import onnxruntime
from onnx import TensorProto, helper

from semascan_training.class_softmax import spell_out_class_softmax


def model(axis: int) -> onnx.ModelProto:
    shape = ["n", 6, "h", "w"]
    graph = helper.make_graph(
        [helper.make_node("Softmax", ["scores"], ["probabilities"], axis=axis)],
        "softmax",
        [helper.make_tensor_value_info("scores", TensorProto.FLOAT, shape)],
        [helper.make_tensor_value_info("probabilities", TensorProto.FLOAT, shape)],
    )
    return helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)


def probabilities(model: onnx.ModelProto, scores: np.ndarray) -> np.ndarray:
    session = onnxruntime.InferenceSession(model.SerializeToString(), providers=["CPUExecutionProvider"])
    return session.run(["probabilities"], {"scores": scores})[0]


def test_the_probabilities_are_the_same_however_large_the_scores():
    whole = model(axis=1)
    spelled = spell_out_class_softmax(whole)
    onnx.checker.check_model(spelled)
    assert "Softmax" not in {node.op_type for node in spelled.graph.node}
    scores = np.random.default_rng(1).normal(0, 40, (2, 6, 7, 9)).astype(np.float32)
    scores[0, 2, 0, 0] = 1e4
    np.testing.assert_allclose(probabilities(spelled, scores), probabilities(whole, scores), atol=1e-6)


def test_other_axes_stay():
    assert spell_out_class_softmax(model(axis=3)) == model(axis=3)
