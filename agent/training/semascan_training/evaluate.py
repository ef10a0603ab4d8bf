"""Exported networks on labelled views, through ONNX Runtime, as the agent runs them."""

from pathlib import Path

import numpy as np
import onnxruntime

from .batches import evaluation_batches
from .dataset import Samples
from .metrics import Confusion
from .recipe import Recipe


def open_session(path: Path, threads: int = 1) -> onnxruntime.InferenceSession:
    """A session that leaves the other cores alone."""
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = threads
    options.add_session_config_entry("session.intra_op.allow_spinning", "0")
    return onnxruntime.InferenceSession(str(path), options, providers=["CPUExecutionProvider"])


def evaluate_networks(files: list[Path], samples: Samples, rows: np.ndarray, recipe: Recipe) -> dict[str, float]:
    """Metrics of the mean of all networks' probabilities, unaugmented, and the mean IoU of one network alone."""
    sessions = [open_session(file) for file in files]
    classes = len(samples.classes)
    together, alone = Confusion.empty(classes), [Confusion.empty(classes) for _ in files]
    for batch in evaluation_batches(samples, rows, recipe, augmented=False):
        truth = batch.labels.numpy()
        image = np.ascontiguousarray(batch.image.numpy())
        total = 0.0
        for session, confusion in zip(sessions, alone):
            probabilities = probabilities_of(session, image)
            confusion.add(truth, probabilities.argmax(1))
            total = total + probabilities
        together.add(truth, total.argmax(1))
    metrics = together.table(samples.classes)
    single = [confusion.table(samples.classes).get("mean_iou", 0.0) for confusion in alone]
    return {"test_images": len(rows), **metrics, "mean_iou_single": round(float(np.mean(single)), 4)}


def probabilities_of(session: onnxruntime.InferenceSession, image: np.ndarray) -> np.ndarray:
    """[N, C, H, W] to [N, K, H, W], one by one where the network takes no batch."""
    one = session.get_inputs()[0].shape[0] == 1
    parts = [image[i : i + 1] for i in range(len(image))] if one else [image]
    return np.concatenate([session.run(["probabilities"], {"image": part})[0] for part in parts])
