"""Weights stored in 16 or 8 bits and widened in the graph: a half or a quarter of the file, the same speed.

In 16 bits a Cast widens them (11 bits of precision); in 8 bits a Cast and a Mul with one scale for each output channel,
so that the largest weight of a channel is 127. Runtimes fold both when they load the network, so the arithmetic stays
in 32 bits.
"""

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

SMALLEST = 1024
"""Bytes. Smaller tensors (biases, normalisations) stay: they weigh little and matter more."""
HALF, EIGHT, SCALE = "_half", "_eight", "_scale"
"""Suffixes of what a weight is stored as."""


def store_halved(model: onnx.ModelProto) -> onnx.ModelProto:
    """The model with its large weights in 16 bits. A tensor with values beyond their range stays as it is."""
    kept, casts = [], []
    for tensor in model.graph.initializer:
        values = numpy_helper.to_array(tensor)
        if _is_large(values) and np.abs(values).max() <= np.finfo(np.float16).max:
            kept.append(numpy_helper.from_array(values.astype(np.float16), tensor.name + HALF))
            casts.append(helper.make_node("Cast", [tensor.name + HALF], [tensor.name], to=TensorProto.FLOAT))
        else:
            kept.append(tensor)
    return _rebuilt(model, kept, [*casts, *model.graph.node])


def store_in_eight_bits(model: onnx.ModelProto) -> onnx.ModelProto:
    """The model with its large filters in 8 bits, with a scale for each entry of their first axis: an output channel,
    but for transposed convolutions."""
    kept, widening = [], []
    filters = {node.input[1] for node in model.graph.node if node.op_type in ("Conv", "ConvTranspose", "Gemm")}
    for tensor in model.graph.initializer:
        values, name = numpy_helper.to_array(tensor), tensor.name
        if name not in filters or not _is_large(values):
            kept.append(tensor)
            continue
        scale = np.abs(values).max(axis=tuple(range(1, values.ndim)), keepdims=True) / np.float32(127)
        steps = np.round(values / np.where(scale > 0, scale, 1)).astype(np.int8)
        kept.append(numpy_helper.from_array(steps, name + EIGHT))
        kept.append(numpy_helper.from_array(scale.astype(np.float32), name + SCALE))
        widening.append(helper.make_node("Cast", [name + EIGHT], [name + "_steps"], to=TensorProto.FLOAT))
        widening.append(helper.make_node("Mul", [name + "_steps", name + SCALE], [name]))
    return _rebuilt(model, kept, [*widening, *model.graph.node])


def widened(model: onnx.ModelProto) -> onnx.ModelProto:
    """The model with weights in 16 bits as plain ones again."""
    halves = {tensor.name for tensor in model.graph.initializer if tensor.name.endswith(HALF)}

    def plain(tensor):
        if tensor.name not in halves:
            return tensor
        return numpy_helper.from_array(numpy_helper.to_array(tensor).astype(np.float32), tensor.name.removesuffix(HALF))

    nodes = [node for node in model.graph.node if not (node.op_type == "Cast" and node.input[0] in halves)]
    return _rebuilt(model, [plain(tensor) for tensor in model.graph.initializer], nodes)


def _is_large(values: np.ndarray) -> bool:
    return values.dtype == np.float32 and values.nbytes > SMALLEST


def _rebuilt(model: onnx.ModelProto, initializers: list, nodes: list) -> onnx.ModelProto:
    """The model with other weights and nodes, checked."""
    rebuilt = onnx.ModelProto()
    rebuilt.CopyFrom(model)
    del rebuilt.graph.initializer[:], rebuilt.graph.node[:]
    rebuilt.graph.initializer.extend(initializers)
    rebuilt.graph.node.extend(nodes)
    onnx.checker.check_model(rebuilt)
    return rebuilt


def whole_initializers(model: onnx.ModelProto) -> dict[str, np.ndarray]:
    """All weights under their own names, those in 16 or 8 bits widened.

    The exporter stores equal tensors once and gives the others as Identity nodes: those are here again.
    """
    values = {tensor.name: numpy_helper.to_array(tensor) for tensor in model.graph.initializer}
    for name in [name for name in values if name.endswith(HALF)]:
        values[name.removesuffix(HALF)] = values.pop(name).astype(np.float32)
    for name in [name for name in values if name.endswith(EIGHT)]:
        whole = name.removesuffix(EIGHT)
        values[whole] = values.pop(name).astype(np.float32) * values.pop(whole + SCALE)
    for node in model.graph.node:
        if node.op_type == "Identity" and node.input[0] in values:
            values[node.output[0]] = values[node.input[0]]
    return values
