"""The command line: train, export, evaluate, untrained."""

import argparse
import json
import os
import sys
from pathlib import Path

# Threads that wait must not spin: other work needs the cores. OpenMP reads this when it starts, so it comes before
# torch is imported.
os.environ.setdefault("OMP_WAIT_POLICY", "passive")

from .errors import TrainingError


def main(arguments: list[str] | None = None) -> int:
    """Runs one command; 0 done, 1 failed, 2 called wrongly."""
    options = _parser().parse_args(arguments)
    try:
        result = options.command(options)
    except TrainingError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    print(json.dumps(result, indent=1))
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser("semascan_training", description="Trains Semascan's networks.")
    commands = parser.add_subparsers(required=True)

    train = commands.add_parser("train", help="a recipe and data to a run")
    train.add_argument("recipe", type=Path)
    train.add_argument("--data", type=Path, required=True, help="folder of `semascan synth`, or a labelme folder")
    train.add_argument("--out", type=Path, required=True, help="folder of the run")
    train.add_argument("--model", type=Path, help="export there when done")
    train.add_argument("--hours", type=float, help="time limit; the learning-rate schedule is fitted to it")
    train.add_argument("--resume", action="store_true", help="continue the run in --out, if there is one")
    train.add_argument(
        "--start", type=Path, action="append", default=[], help="run or model whose weights to start from"
    )
    train.add_argument("--imagenet", type=Path, help="torchvision's ImageNet weights of the backbone")
    train.add_argument("--threads", type=int, default=1)
    train.set_defaults(command=_train)

    export = commands.add_parser("export", help="a run to a model folder")
    export.add_argument("run", type=Path)
    export.add_argument("model", type=Path)
    export.add_argument("--data", type=Path, help="measure the held-out test parts for the manifest")
    export.add_argument("--bits", type=int, choices=(8, 16), default=16, help="of the stored weights")
    export.set_defaults(command=_export)

    untrained = commands.add_parser("untrained", help="a recipe to a model folder with random weights")
    untrained.add_argument("recipe", type=Path)
    untrained.add_argument("model", type=Path)
    untrained.set_defaults(command=_untrained)

    evaluate = commands.add_parser("evaluate", help="a model on the parts of one side of its run's split")
    evaluate.add_argument("run", type=Path)
    evaluate.add_argument("model", type=Path)
    evaluate.add_argument("--data", type=Path, required=True)
    evaluate.add_argument("--side", choices=("train", "validation", "test", "all"), default="test")
    evaluate.set_defaults(command=_evaluate)
    return parser


def _train(options) -> dict:
    from .train import Options, train

    given = Options(options.hours, options.resume, tuple(options.start), options.imagenet, options.threads)
    run = train(options.recipe, options.data, options.out, given)
    last = {stage.name: run.log(stage.name)[-1] for stage in sorted(run.folder.iterdir()) if run.log(stage.name)}
    if options.model:
        from .export import export

        return export(run.folder, options.model, options.data)
    return last


def _export(options) -> dict:
    from .export import export

    return export(options.run, options.model, options.data, options.bits)


def _untrained(options) -> dict:
    from .export import export_untrained
    from .recipe import read_recipe

    export_untrained(read_recipe(options.recipe), options.model)
    return {"model": str(options.model)}


def _evaluate(options) -> dict:
    import numpy as np

    from .dataset import open_samples
    from .evaluate import evaluate_networks
    from .manifest import model_files
    from .run import open_run

    run = open_run(options.run)
    samples = open_samples(options.data, run.recipe)
    whole = options.side == "all"
    rows = np.arange(len(samples)) if whole else run.split.rows(samples.parts, options.side)
    if not len(rows):
        raise TrainingError(f"{options.data}: none of its parts is on the side '{options.side}' of the run's split")
    return evaluate_networks(model_files(options.model), samples, rows, run.recipe)
