"""Corners that OpenCV finds in the pictures of `cargo bench -p semascan-boards --bench calibration -- --pictures DIR`, against the truth.

Usage: python by_opencv.py DIR, with opencv-python-headless.
"""

import json
import sys
import time
from pathlib import Path

import cv2
import numpy

WRONG = 5.0


def main() -> None:
    folder = Path(sys.argv[1])
    truth = json.loads((folder / "truth.json").read_text())
    board = json.loads((folder / "captures.json").read_text())["board"]
    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, board["dictionary"]))
    printed = cv2.aruco.CharucoBoard(
        (board["columns"], board["rows"]), board["square_mm"], board["marker_mm"], dictionary
    )
    detector = cv2.aruco.CharucoDetector(printed)
    errors, visible, wrong, seconds = [], 0, 0, []
    for view in truth["pictures"]:
        if not view["picture"].startswith("captures"):
            continue
        picture = cv2.imread(str(folder / view["picture"]), cv2.IMREAD_GRAYSCALE)
        begun = time.perf_counter()
        corners, ids, _, _ = detector.detectBoard(picture)
        seconds.append(time.perf_counter() - begun)
        visible += sum(corner is not None for corner in view["corners"])
        if ids is None:
            continue
        for corner, number in zip(corners.reshape(-1, 2), ids.ravel()):
            there = view["corners"][number]
            error = numpy.inf if there is None else float(numpy.hypot(*(corner - there)))
            wrong += error > WRONG
            errors.append(error)
    errors = numpy.sort(errors)
    print(
        f"OpenCV {cv2.__version__}: {len(errors)} of {visible} visible corners, median {numpy.median(errors):.4f}, "
        f"p95 {numpy.quantile(errors, 0.95):.4f}, largest {errors[-1]:.4f} pixels; wrong names: {wrong}; "
        f"{1e3 * numpy.median(seconds):.1f} ms a picture (median)"
    )


if __name__ == "__main__":
    main()
