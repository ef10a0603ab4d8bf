"""The softmax over classes, spelled out in elementary nodes.

ONNX Runtime's kernel takes the last axis only: over the classes of [N, K, H, W] it transposes twice and then works on
rows of K values, a third of the time of a small network. Maximum, exponential, sum and quotient give the same
probabilities (to rounding) without moving the tensor.
"""

import numpy as np
import onnx
from onnx import helper, numpy_helper

CLASS_AXIS = 1


def spell_out_class_softmax(model: onnx.ModelProto) -> onnx.ModelProto:
    """The model with every softmax over axis 1 in elementary nodes; others stay."""
    nodes, axes = [], []
    for place, node in enumerate(model.graph.node):
        axis = next((attribute.i for attribute in node.attribute if attribute.name == "axis"), -1)
        if node.op_type != "Softmax" or axis != CLASS_AXIS:
            nodes.append(node)
            continue
        name = node.name or f"softmax_{place}"
        scores, largest, shifted = node.input[0], f"{name}/largest", f"{name}/shifted"
        powers, total, summed = f"{name}/powers", f"{name}/total", f"{name}/axes"
        axes.append(numpy_helper.from_array(np.array([CLASS_AXIS], np.int64), summed))
        nodes += [
            helper.make_node("ReduceMax", [scores], [largest], axes=[CLASS_AXIS], keepdims=1),
            helper.make_node("Sub", [scores, largest], [shifted]),
            helper.make_node("Exp", [shifted], [powers]),
            helper.make_node("ReduceSum", [powers, summed], [total], keepdims=1),
            helper.make_node("Div", [powers, total], list(node.output)),
        ]
    spelled = onnx.ModelProto()
    spelled.CopyFrom(model)
    del spelled.graph.node[:]
    spelled.graph.node.extend(nodes)
    spelled.graph.initializer.extend(axes)
    return spelled
