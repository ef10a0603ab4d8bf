"""Metrics of a label image, against figures counted by hand."""

import numpy as np
import pytest

from semascan_training.dataset.samples import IGNORE
from semascan_training.metrics import Confusion

# Six pixels of class 0, four of class 1, two unknown; class 2 occurs nowhere, class 3 only in the prediction.
TRUTH = np.array([[0, 0, 0, 0, 0, 0], [1, 1, 1, 1, IGNORE, IGNORE]], np.uint8)
PREDICTION = np.array([[0, 0, 0, 0, 1, 3], [1, 1, 1, 0, 0, 1]], np.uint8)


def test_figures_are_those_counted_by_hand():
    confusion = Confusion.empty(4)
    confusion.add(TRUTH[:, :3], PREDICTION[:, :3])
    confusion.add(TRUTH[:, 3:], PREDICTION[:, 3:])
    table = confusion.table(["none", "housing", "gear", "electrical connection"])
    assert table["pixel_accuracy"] == 0.7
    assert table["iou_none"] == pytest.approx(4 / 7, abs=1e-4)
    assert table["iou_housing"] == pytest.approx(3 / 5, abs=1e-4)
    assert table["iou_electrical_connection"] == 0
    assert table["mean_iou"] == pytest.approx((3 / 5 + 0) / 2, abs=1e-4)
    assert table["mean_iou_with_none"] == pytest.approx((4 / 7 + 3 / 5 + 0) / 3, abs=1e-4)
    assert table["mean_recall"] == pytest.approx((4 / 6 + 3 / 4) / 2, abs=1e-4)
    assert table["mean_precision_without_none"] == pytest.approx((3 / 4 + 0) / 2, abs=1e-4)
    assert table["false_detection_rate"] == pytest.approx(2 / 5, abs=1e-4)


def test_what_does_not_occur_is_left_out():
    confusion = Confusion.empty(3)
    confusion.add(np.full((2, 2), IGNORE, np.uint8), np.ones((2, 2), np.uint8))
    table = confusion.table(["none", "housing", "gear"])
    assert not {"mean_iou", "mean_recall", "iou_none", "iou_housing"} & table.keys()
