"""Where weights come from: chance, ImageNet, an earlier run, an exported model."""

from pathlib import Path

import onnx
import torch

from .errors import TrainingError
from .networks.stems import COLOUR_CHANNELS as COLOUR
from .networks.stems import StackedStem
from .weight_storage import whole_initializers


def load_imagenet(network: torch.nn.Module, path: Path | None, recipe_field: str) -> None:
    """Puts ImageNet weights into every backbone of the network.

    `path` is a state dictionary as torchvision publishes it for `vgg16_bn` or `resnet34`. A backbone that sees more
    than colour gets the colour filters, and their mean for the channels that ImageNet has not.
    """
    if path is None:
        raise TrainingError(f"{recipe_field} needs ImageNet weights: name torchvision's file with --imagenet")
    given = _state(path)
    backbones = [m for m in network.modules() if hasattr(type(m), "from_torchvision")]
    if not backbones:
        raise TrainingError(f"{recipe_field}: this network has no backbone with ImageNet weights")
    for backbone in backbones:
        own = backbone.state_dict()
        named = {backbone.from_torchvision(key): value for key, value in given.items()}
        for key, value in own.items():
            if key.endswith("num_batches_tracked"):
                continue
            if key not in named:
                raise TrainingError(f"{path}: has no weights for {type(backbone).__name__}'s {key}")
            own[key] = _fit(named[key], value, path, key)
        backbone.load_state_dict(own)


def _fit(given: torch.Tensor, wanted: torch.Tensor, path: Path, key: str) -> torch.Tensor:
    if given.shape == wanted.shape:
        return given
    first = given.ndim == 4 and given.shape[1] == COLOUR and given.shape[0] == wanted.shape[0]
    if not first or given.shape[2:] != wanted.shape[2:]:
        raise TrainingError(f"{path}: {key} is {tuple(given.shape)}, {tuple(wanted.shape)} is expected")
    mean = given.mean(1, keepdim=True)
    if wanted.shape[1] < COLOUR:
        return mean.expand_as(wanted).clone()
    extra = mean.expand(-1, wanted.shape[1] - COLOUR, -1, -1)
    return torch.cat((given, extra), 1)


def load_start(network: torch.nn.Module, path: Path) -> list[str]:
    """Puts in whatever weights of an earlier run or of an exported model fit by name and shape.

    `path` is a run's folder, a `checkpoint.pt`, a model's folder or an `.onnx` file. One encoder's weights fill each
    encoder and stream of a network that has several, those of a U-Net or UD-Net the encoders of a Mask R-CNN or MD-Net;
    the first filters of a network with early fusion are shared out to colour and depth. Returns the names that were not
    filled.
    """
    given = _start_state(path)
    own = network.state_dict()
    missing = []
    for key, wanted in own.items():
        found = next((given[name] for name in _names(key) if name in given), None)
        fitting = None if found is None else _share(found, wanted)
        if fitting is not None:
            own[key] = fitting
        elif not key.endswith("num_batches_tracked"):
            missing.append(key)
    if not any(value.ndim == 4 and key not in missing for key, value in own.items()):
        raise TrainingError(f"{path}: none of its weights fits this network")
    network.load_state_dict(own)
    return missing


# Prefixes of a network with several encoders or decoders, and what they are called in one with a single one.
SINGLE = (
    ("encoder.colour.", "backbone."),
    ("encoder.depth.", "backbone."),
    ("colour.", ""),
    ("depth.", ""),
    ("instance_decoder.", "decoder."),
)
# The same for the encoders of a detector, and what they are called in a UD-Net of the same fusion.
IN_DETECTOR = (
    ("detector.backbone.colour.backbone.", "encoder.colour."),
    ("detector.backbone.depth.backbone.", "encoder.depth."),
    ("detector.backbone.", ""),
)


def _names(key: str) -> tuple[str, str, str]:
    """What a weight may be called where it comes from, best first."""
    body = _renamed(key, IN_DETECTOR)
    return key, body, _renamed(body, SINGLE)


def _renamed(key: str, prefixes: tuple[tuple[str, str], ...]) -> str:
    return next((new + key.removeprefix(old) for old, new in prefixes if key.startswith(old)), key)


def _share(given: torch.Tensor, wanted: torch.Tensor) -> torch.Tensor | None:
    """The weights if they have the shape, or their colour or depth part if they are an early fusion's first filters."""
    if given.shape == wanted.shape:
        return given
    stacked = given.ndim == 4 and given.shape[1] == StackedStem.channels
    if not stacked or given.shape[0] != wanted.shape[0] or given.shape[2:] != wanted.shape[2:]:
        return None
    if wanted.shape[1] == COLOUR:
        return given[:, :COLOUR].clone()
    return given[:, COLOUR:].clone() if wanted.shape[1] == given.shape[1] - COLOUR else None


def _start_state(path: Path) -> dict[str, torch.Tensor]:
    if path.is_dir():
        names = ("trunk/checkpoint.pt", "member-0/checkpoint.pt", "member-0.onnx")
        found = next((path / name for name in names if (path / name).exists()), None)
        if found is None:
            raise TrainingError(f"{path}: neither a run (trunk, member-0) nor an exported model (member-0.onnx)")
        path = found
    if path.suffix == ".onnx":
        try:
            values = whole_initializers(onnx.load(str(path)))
        except Exception as error:  # protobuf's decode errors have no common class
            raise TrainingError(f"{path}: {error}") from error
        return {name.removeprefix("network."): torch.from_numpy(value.copy()) for name, value in values.items()}
    return _state(path)


def _state(path: Path) -> dict[str, torch.Tensor]:
    try:
        state = torch.load(path, map_location="cpu", weights_only=True)
    except Exception as error:  # torch raises several kinds for a file that is none of its own
        raise TrainingError(f"{path}: not a file of weights ({error})") from error
    return state.get("network", state) if isinstance(state, dict) else state
