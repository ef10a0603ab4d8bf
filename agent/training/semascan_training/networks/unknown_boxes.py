"""Boxes in unknown pixels: neither object nor background.

As COCO treats what is found in a crowd region: a box that lies there with more than half of its area, and on no object,
is not judged [Lin 2014]. Torchvision's samplers take boxes of label 0 for background and leave out those of label -1.
"""

import torch

UNKNOWN_SHARE = 0.5
NOT_JUDGED = -1


def leave_out_unknown(labels: torch.Tensor, boxes: torch.Tensor, unknown: torch.Tensor) -> torch.Tensor:
    """`labels` [N] of `boxes` [N, 4] (left, top, right, bottom, pixels), without the background in `unknown` [H, W]."""
    if not unknown.any():
        return labels
    background = (labels == 0) & (share_within(boxes, unknown) > UNKNOWN_SHARE)
    return torch.where(background, torch.full_like(labels, NOT_JUDGED), labels)


def share_within(boxes: torch.Tensor, mask: torch.Tensor) -> torch.Tensor:
    """The share of each box's pixels, of those in the picture, that are in `mask`; 0 for a box beside the picture."""
    height, width = mask.shape
    sums = torch.zeros(height + 1, width + 1, dtype=torch.int64, device=mask.device)
    sums[1:, 1:] = mask.to(torch.int64).cumsum(0).cumsum(1)
    left, right = (boxes[:, i].round().clamp(0, width).long() for i in (0, 2))
    top, bottom = (boxes[:, i].round().clamp(0, height).long() for i in (1, 3))
    within = sums[bottom, right] - sums[top, right] - sums[bottom, left] + sums[top, left]
    area = (right - left).clamp(min=0) * (bottom - top).clamp(min=0)
    return within.clamp(min=0) / area.clamp(min=1)
