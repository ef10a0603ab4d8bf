"""Weights stored in 16 bits with a Cast to 32 in the graph: half the file, the same speed, 11 bits of precision.

Runtimes fold the casts when they load the network, so the arithmetic stays in 32 bits.
"""

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

SMALLEST = 1024
"""Bytes. Smaller tensors (biases, normalisations) stay: they weigh little and matter more."""
SUFFIX = "_half"


def store_halved(model: onnx.ModelProto) -> onnx.ModelProto:
    """The model with its large weights in 16 bits. A tensor with values beyond their range stays as it is."""
    halved = onnx.ModelProto()
    halved.CopyFrom(model)
    graph, casts, kept = halved.graph, [], []
    for tensor in graph.initializer:
        values = numpy_helper.to_array(tensor)
        fits = values.dtype == np.float32 and values.nbytes > SMALLEST
        if fits and np.abs(values).max() <= np.finfo(np.float16).max:
            kept.append(numpy_helper.from_array(values.astype(np.float16), tensor.name + SUFFIX))
            casts.append(helper.make_node("Cast", [tensor.name + SUFFIX], [tensor.name], to=TensorProto.FLOAT))
        else:
            kept.append(tensor)
    nodes = list(graph.node)
    del graph.initializer[:], graph.node[:]
    graph.initializer.extend(kept)
    graph.node.extend([*casts, *nodes])
    onnx.checker.check_model(halved)
    return halved


def whole_initializers(model: onnx.ModelProto) -> dict[str, np.ndarray]:
    """All weights under their own names, those in 16 bits widened.

    The exporter stores equal tensors once and gives the others as Identity nodes: those are here again.
    """
    values = {tensor.name: numpy_helper.to_array(tensor) for tensor in model.graph.initializer}
    for name in [name for name in values if name.endswith(SUFFIX)]:
        values[name.removesuffix(SUFFIX)] = values.pop(name).astype(np.float32)
    for node in model.graph.node:
        if node.op_type == "Identity" and node.input[0] in values:
            values[node.output[0]] = values[node.input[0]]
    return values
