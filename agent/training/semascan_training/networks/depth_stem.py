"""Local geometry from the depth channel, as a fixed first layer inside the graph.

A seam between two components is a step of a millimetre; in normalised range that is 0.0015, which a small network
hardly sees and must first learn to differentiate. So the graph derives what shows it: surface orientation and
curvature, from differences between valid neighbours only, so that a hole makes no false edge.
"""

import torch
from torch import nn

OFFSET = 2
"""Distance of the neighbours, pixels: at one pixel the sensor's noise drowns the slope."""
NOMINAL_FOCAL = 600.0
"""Pixels. Turns a difference a pixel into a slope; near enough for cameras of about 640x480."""
CURVATURE_UNIT = 1e-3
"""A second difference of 1 mm comes out as 1/sqrt(2)."""
CHANNELS = 5


def soft_sign(x):
    """Into -1..1, with slope 1 at 0; for a slope this is the sine of its angle."""
    return x * torch.rsqrt(1.0 + x * x)


class DepthStem(nn.Module):
    """Normalised depth [N, 1, H, W] (0 = missing) to range, validity, two slopes and the Laplacian [N, 5, H, W]."""

    def __init__(self, near: float, far: float):
        super().__init__()
        self.near, self.span = near, far - near
        size, middle = 2 * OFFSET + 1, OFFSET
        places = ((middle, size - 1), (middle, 0), (size - 1, middle), (0, middle))  # right, left, below, above
        kernel = torch.zeros(4, 1, size, size)
        for i, (row, column) in enumerate(places):
            kernel[i, 0, row, column] = 1.0
        self.register_buffer("kernel", kernel, persistent=False)

    def neighbours(self, x):
        """The four neighbours' values [N, 4, H, W]; 0 outside the picture."""
        return nn.functional.conv2d(x, self.kernel, padding=OFFSET)

    def forward(self, depth):
        # A millimetre in half a metre does not survive 16 bits, whatever precision the rest is trained in.
        with torch.autocast(depth.device.type, enabled=False):
            return self.geometry(depth.float())

    def geometry(self, depth):
        """The channels, in the precision of `depth`."""
        valid = (depth > 0).to(depth.dtype)
        metres = (depth * self.span + self.near) * valid
        both = self.neighbours(valid) * valid
        steps = (self.neighbours(metres) - metres) * both
        scale = NOMINAL_FOCAL / OFFSET / (metres + (1.0 - valid))
        right, left, below, above = (steps[:, i : i + 1] for i in range(4))
        has_right, has_left, has_below, has_above = (both[:, i : i + 1] for i in range(4))
        slope_x = (right - left) / (has_right + has_left).clamp(min=1.0)
        slope_y = (below - above) / (has_below + has_above).clamp(min=1.0)
        bend = (right + left) * has_right * has_left + (below + above) * has_below * has_above
        slopes = torch.cat((slope_x, slope_y), 1) * scale
        geometry = soft_sign(torch.cat((slopes, bend / CURVATURE_UNIT), 1))
        return torch.cat((depth, valid, geometry), 1)
