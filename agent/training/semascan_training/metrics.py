"""Metrics of a label image against the truth, from one confusion matrix.

IoU, precision and recall as [Wang 2023] takes them, the false detection rate as [Remanufacturing paper] does: the share
of wrong pixels among those that are said to be something other than none.

Classes that neither truth nor prediction shows are left out of the means. `mean_iou` is over the part's classes,
without background; `mean_iou_with_none` counts it too.
"""

from dataclasses import dataclass

import numpy as np

from .dataset.samples import IGNORE


@dataclass
class Confusion:
    """Counts of pixels [truth, prediction]."""

    counts: np.ndarray

    @classmethod
    def empty(cls, classes: int) -> "Confusion":
        """No pixel yet."""
        return cls(np.zeros((classes, classes), np.int64))

    def add(self, truth: np.ndarray, prediction: np.ndarray) -> None:
        """Counts two label images; truth's IGNORE is left out."""
        known = truth != IGNORE
        classes = len(self.counts)
        index = truth[known].astype(np.int64) * classes + prediction[known].astype(np.int64)
        self.counts += np.bincount(index, minlength=classes**2).reshape(classes, classes)

    def iou(self) -> np.ndarray:
        """Intersection over union by class; NaN where the class does not occur."""
        hit = np.diag(self.counts)
        return _ratio(hit, self.counts.sum(0) + self.counts.sum(1) - hit)

    def table(self, classes: list[str]) -> dict[str, float]:
        """All metrics by name, rounded to 0.0001; what is undefined is left out."""
        hit = np.diag(self.counts)
        truth, prediction = self.counts.sum(1), self.counts.sum(0)
        iou, precision, recall = self.iou(), _ratio(hit, prediction), _ratio(hit, truth)
        wrong_foreground = self.counts[:, 1:].sum() - hit[1:].sum()
        values = {
            "mean_iou": _mean(iou[1:]),
            "mean_iou_with_none": _mean(iou),
            "pixel_accuracy": hit.sum() / max(1, truth.sum()),
            "mean_accuracy": _mean(recall),
            "mean_precision": _mean(precision),
            "mean_recall": _mean(recall),
            "mean_precision_without_none": _mean(precision[1:]),
            "mean_recall_without_none": _mean(recall[1:]),
            "false_detection_rate": wrong_foreground / max(1, self.counts[:, 1:].sum()),
        }
        for i, name in enumerate(classes):
            values[f"iou_{name.replace(' ', '_')}"] = iou[i]
        return {name: round(float(value), 4) for name, value in values.items() if np.isfinite(value)}


def _ratio(part: np.ndarray, whole: np.ndarray) -> np.ndarray:
    return np.where(whole > 0, part / np.maximum(whole, 1), np.nan)


def _mean(values: np.ndarray) -> float:
    values = values[np.isfinite(values)]
    return float(values.mean()) if values.size else float("nan")
