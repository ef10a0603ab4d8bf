"""The two-stream network of [Wang 2023]: a colour and a depth network, weighed against each other pixel by pixel.

The paper gives no formula for its contribution layer; read as P = l P_colour + (1 - l) P_depth, renormalised, with l by
a 1x1 convolution over the 2K probabilities and a sigmoid, and l = 1 where depth is missing.
"""

import torch
from torch import nn

TINY = 1e-6


class TwoStream(nn.Module):
    """Two networks that each give class scores, and the layer that weighs them. [N, 4, H, W] in."""

    outputs = ("contribution",)

    def __init__(self, colour: nn.Module, depth: nn.Module, classes: int):
        super().__init__()
        self.colour, self.depth = colour, depth
        self.contribution = nn.Conv2d(2 * classes, 1, 1)
        nn.init.zeros_(self.contribution.weight)  # begins with equal shares
        nn.init.zeros_(self.contribution.bias)

    def forward(self, x):
        colour_logits, depth_logits = self.colour(x)["logits"], self.depth(x)["logits"]
        by_colour, by_depth = colour_logits.softmax(1), depth_logits.softmax(1)
        share = torch.sigmoid(self.contribution(torch.cat((by_colour, by_depth), 1)))
        measured = (x[:, -1:] > 0).to(share.dtype)
        share = share * measured + (1.0 - measured)
        probabilities = share * by_colour + (1.0 - share) * by_depth
        probabilities = probabilities / probabilities.sum(1, keepdim=True)
        return {
            "logits": torch.log(probabilities + TINY),
            "probabilities": probabilities,
            "contribution": share,
            "colour_logits": colour_logits,
            "depth_logits": depth_logits,
        }
