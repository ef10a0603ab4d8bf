"""Python's onnxruntime on the network of the benchmark: seconds of one run, on the same file, input and threads.

    python rivals.py FOLDER network.json

Checks that its output is ours, and prints one JSON object with its seconds and the ratio of ours to it. Needs numpy and
onnxruntime.
"""

import json
import os
import sys
import time

import numpy as np
import onnxruntime


def main(folder, ours):
    with open(os.path.join(folder, "network.json"), encoding="utf-8") as file:
        about = json.load(file)
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = about["threads"]
    options.add_session_config_entry("session.intra_op.allow_spinning", "0")
    session = onnxruntime.InferenceSession(
        os.path.join(folder, "network.onnx"), options, providers=["CPUExecutionProvider"]
    )
    image = np.fromfile(os.path.join(folder, "input.f32"), np.float32).reshape(about["shape"])
    expected = np.fromfile(os.path.join(folder, "output.f32"), np.float32)
    best = [float("inf")] * 2
    for run in range(about["runs"] + 1):
        cpu, wall = time.process_time(), time.perf_counter()
        (output,) = session.run([about["output"]], {about["input"]: image})
        seconds = [time.process_time() - cpu, time.perf_counter() - wall]
        # The first run allocates; ours was not counted either.
        if run > 0:
            best = [min(a, b) for a, b in zip(best, seconds)]
    difference = float(np.abs(output.ravel() - expected).max())
    if difference > 1e-4:
        sys.exit(f"the outputs differ by {difference}")
    with open(ours, encoding="utf-8") as file:
        single = json.load(file)["single"]
    print(
        json.dumps(
            {
                "onnxruntime": onnxruntime.__version__,
                "cpu_s": best[0],
                "wall_s": best[1],
                "difference": difference,
                "ours_to_python_cpu": single["cpu_s"] / best[0],
                "ours_to_python_wall": single["wall_s"] / best[1],
            }
        )
    )


if __name__ == "__main__":
    main(*sys.argv[1:])
