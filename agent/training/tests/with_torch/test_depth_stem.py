"""The fixed geometry layer: a plane has its slope, a step shows, a hole does not."""

import pytest

torch = pytest.importorskip("torch", reason="needs PyTorch")

from semascan_training.networks.depth_stem import NOMINAL_FOCAL, DepthStem

NEAR, FAR = 0.25, 0.9
RANGE, VALID, SLOPE_X, SLOPE_Y, BEND = range(5)


def geometry(metres: torch.Tensor, missing: torch.Tensor | None = None) -> torch.Tensor:
    depth = (metres - NEAR) / (FAR - NEAR)
    if missing is not None:
        depth = torch.where(missing, 0.0, depth)
    return DepthStem(NEAR, FAR)(depth[None, None])[0]


def test_a_slanted_plane_has_the_sine_of_its_slope():
    x = torch.arange(32, dtype=torch.float64)
    metres = (0.5 + 0.5 * x / NOMINAL_FOCAL).expand(24, 32).float()  # about 45 degrees
    inner = geometry(metres)[:, 4:-4, 4:10]
    slope = inner[SLOPE_X]
    assert torch.all((slope > 0.68) & (slope < 0.72))
    assert inner[SLOPE_Y].abs().max() < 1e-4
    assert inner[BEND].abs().max() < 0.01


def test_a_step_of_a_millimetre_shows():
    metres = torch.full((24, 32), 0.5)
    metres[:, 16:] += 0.001
    inner = geometry(metres)
    assert inner[SLOPE_X, 12, 16] > 0.25
    assert inner[BEND, 12, 15] > 0.6
    assert inner[SLOPE_X, 12, 8].abs() < 1e-3


def test_a_hole_makes_no_edge():
    metres = torch.full((24, 32), 0.5)
    missing = torch.zeros(24, 32, dtype=torch.bool)
    missing[8:14, 10:20] = True
    out = geometry(metres, missing)
    assert torch.all(out[VALID][missing] == 0) and torch.all(out[VALID][~missing] == 1)
    for channel in (SLOPE_X, SLOPE_Y, BEND):
        assert out[channel].abs().max() < 1e-3
