"""A run to a model folder: ONNX files with 16-bit weights, checked against PyTorch, and their manifest."""

import io
from pathlib import Path

import numpy as np
import onnx
import onnxruntime
import torch
from torch import nn

from .class_softmax import spell_out_class_softmax
from .dataset import open_samples
from .errors import TrainingError
from .evaluate import evaluate_networks
from .manifest import manifest_text
from .networks import make_network
from .recipe import Recipe
from .run import Run, load_checkpoint, open_run, write_whole
from .shift_convolution import spell_out_shifts
from .taxonomy import COMPONENTS, DEFECTS
from .train import prepare
from .weight_storage import store_halved, store_in_eight_bits, widened

OPSET = 17
WHOLE_TOLERANCE = 1e-4
HALF_TOLERANCE = 5e-3
"""Largest difference of a probability against PyTorch, with weights in 32 and in 16 bits."""
EIGHT_BIT_COST = 0.005
"""Largest loss of mean IoU on the test parts that 8 bits may cost."""
TRACE_SIZE = (1, 128, 160)
PARITY_SIZE = (2, 96, 192)
"""Batch, height, width; they differ, so that the check also shows that the exported sizes are free."""


class Exported(nn.Module):
    """A network with its last activation in the graph: `probabilities` first, then what else it names in `outputs`."""

    def __init__(self, network: nn.Module):
        super().__init__()
        self.network = network
        self.names = ["probabilities", *getattr(network, "outputs", ())]
        every = {name: {0: "n", 2: f"{name}_h", 3: f"{name}_w"} for name in ("image", *self.names)}
        self.axes = getattr(network, "output_axes", every)

    def forward(self, image):
        outputs = self.network(image)
        if "probabilities" not in outputs:
            outputs["probabilities"] = outputs["logits"].softmax(1)
        return tuple(outputs[name] for name in self.names)


def export(run_folder: Path, out: Path, data: Path | None, bits: int = 16) -> dict[str, float]:
    """Exports all finished members of a run; with the data, the manifest gets metrics on the held-out test parts.

    Weights in 8 `bits` need the data: a model that they cost more than `EIGHT_BIT_COST` is refused.
    """
    if bits == 8 and data is None:
        raise TrainingError("weights in 8 bits: what they cost must be measured, name the --data")
    prepare(threads=1)
    run = open_run(run_folder)
    out.mkdir(parents=True, exist_ok=True)
    files, epochs, seconds, images, widths = [], [], 0.0, 0, []
    for member in range(run.recipe.ensemble.members):
        checkpoint = load_checkpoint(run.folder / f"member-{member}")
        if checkpoint is None:
            break
        network = make_network(run.recipe, len(run.classes))
        network.load_state_dict(checkpoint["network"])
        file = out / f"member-{member}.onnx"
        content, width = to_onnx(network, run.recipe)
        write_whole(file, content)
        files.append(file)
        widths.append(width)
        epochs.append(checkpoint["epoch"])
    if not files:
        raise TrainingError(f"{run_folder}: no member has been trained yet")
    logs = {name: run.log(name) for name in ("trunk", *(f"member-{i}" for i in range(len(files))))}
    for log in logs.values():
        seconds += log[-1]["elapsed_s"] if log else 0.0
        images += sum(entry["images"] for entry in log)
    metrics, stored = {}, max(widths)
    if data is not None:
        samples = open_samples(data, run.recipe)
        if samples.classes != run.classes:
            raise TrainingError(f"{data}: its classes {samples.classes} are not the run's {run.classes}")
        rows = run.split.rows(samples.parts, "test")
        if len(rows):
            metrics = evaluate_networks(files, samples, rows, run.recipe)
        elif bits == 8:
            raise TrainingError(f"{data}: weights in 8 bits: what they cost must be measured, and no part is for tests")
    if bits == 8:
        for file in files:
            write_whole(file, store_in_eight_bits(widened(onnx.load(str(file)))).SerializeToString())
        whole, metrics = metrics, evaluate_networks(files, samples, rows, run.recipe)
        metrics[f"mean_iou_in_{stored}_bits"] = whole["mean_iou"]
        stored = 8
        if whole["mean_iou"] - metrics["mean_iou"] > EIGHT_BIT_COST:
            raise TrainingError(f"{out}: 8 bits lower mean IoU from {whole['mean_iou']} to {metrics['mean_iou']}")
    training = _training_table(run, epochs, logs, seconds, images)
    training["weights"] = f"{stored} bits"
    outputs = {name: name for name in getattr(network, "outputs", ())}
    text = manifest_text(run.recipe, run.classes, files, outputs, training, metrics)
    write_whole(out / "model.toml", text.encode())
    return metrics


def export_untrained(recipe: Recipe, out: Path) -> None:
    """A model whose weights are random: to see that a recipe's network runs in the agent, and how fast, before any
    training."""
    prepare(threads=1)
    torch.manual_seed(recipe.training.seed)
    classes = DEFECTS if recipe.task == "defect" else COMPONENTS
    network = make_network(recipe, len(classes))
    out.mkdir(parents=True, exist_ok=True)
    file = out / "member-0.onnx"
    write_whole(file, to_onnx(network, recipe)[0])
    outputs = {name: name for name in getattr(network, "outputs", ())}
    text = manifest_text(recipe, list(classes), [file], outputs, {"data": "none: random weights"}, {})
    write_whole(out / "model.toml", text.encode())


def _training_table(run: Run, epochs: list[int], logs: dict, seconds: float, images: int) -> dict:
    recipe, split = run.recipe, run.split
    table = {
        "data": "semascan synth",
        "generator": str(run.about.get("generator", "unknown")),
        "data_seed": run.about.get("seed", 0),
        "parts": len(split.train) + len(split.validation) + len(split.test),
        "split": f"{len(split.train)}/{len(split.validation)}/{len(split.test)} parts (train/validation/test)",
        "test_parts": split.test,
        "members": len(epochs),
        "composition": recipe.ensemble.composition,
        "epochs": epochs,
        "images_seen": images,
        "hours": round(seconds / 3600, 3),
        "device": run.device,
        "start": ", ".join(run.started_from) or recipe.network.start,
        "loss": recipe.training.loss,
        "optimiser": recipe.training.optimiser,
        "learning_rate": recipe.training.learning_rate,
        "seed": recipe.training.seed,
        "augmented": recipe.data.augment,
    }
    if table["generator"] == "labelme":
        table["data"] = "labelme folder"
    elif table["generator"].startswith("semascan dataset"):
        table["data"] = "semascan dataset"
    if logs["trunk"]:
        table["trunk"] = f"members fork from one trunk of {logs['trunk'][-1]['epoch']} epochs on all training parts"
    return table


def to_onnx(network: nn.Module, recipe: Recipe) -> tuple[bytes, int]:
    """The network as ONNX, and the bits of its stored weights: 16 where that is lossless enough, else 32."""
    module = Exported(network).eval()
    channels = len(recipe.data.channels)
    traced = _export(module, example_picture(*TRACE_SIZE, channels, seed=1))
    whole = spell_out_shifts(spell_out_class_softmax(traced))
    content = whole.SerializeToString()
    count, height, width = PARITY_SIZE
    picture = example_picture(count if 0 in module.axes["image"] else 1, height, width, channels, seed=2)
    worst, tolerance = parity(module, content, picture), getattr(network, "tolerance", WHOLE_TOLERANCE)
    if not worst <= tolerance:
        raise TrainingError(f"{recipe.name}: the 32-bit export differs from PyTorch by {worst:.2g} > {tolerance}")
    if not getattr(network, "halved", True):
        return content, 32
    halved = store_halved(whole).SerializeToString()
    return (halved, 16) if parity(module, halved, picture) <= HALF_TOLERANCE else (content, 32)


def _export(module: Exported, example: torch.Tensor) -> onnx.ModelProto:
    buffer = io.BytesIO()
    torch.onnx.export(
        module,
        (example,),
        buffer,
        dynamo=False,
        opset_version=OPSET,
        # Normalisations stay nodes of their own, so that the weights keep their names and can be a start again;
        # runtimes fold them when they load the network.
        training=torch.onnx.TrainingMode.PRESERVE,
        input_names=["image"],
        output_names=module.names,
        dynamic_axes=module.axes,
    )
    return onnx.load_model_from_string(buffer.getvalue())


def example_picture(count: int, height: int, width: int, channels: int, seed: int) -> torch.Tensor:
    """Smooth random input [N, C, H, W]; depth, where there is any, has a hole."""
    generator = torch.Generator().manual_seed(seed)
    coarse = torch.rand(count, channels, height // 16, width // 16, generator=generator)
    picture = nn.functional.interpolate(coarse, size=(height, width), mode="bicubic").clamp(0.01, 1.0)
    if channels != 3:
        picture[:, -1, : height // 4, : width // 4] = 0.0
    return picture


def parity(module: Exported, content: bytes, picture: torch.Tensor) -> float:
    """Largest difference of the probabilities between PyTorch and ONNX Runtime."""
    with torch.no_grad():
        expected = module(picture)[0].numpy()
    session = onnxruntime.InferenceSession(content, providers=["CPUExecutionProvider"])
    given = session.run(["probabilities"], {"image": picture.numpy()})[0]
    return float(np.abs(given - expected).max())
