"""What a robot's camera and segmenter do to a crop: light, noise, blur, wrong and missing masks.

Called by `fit.py`; calls PyTorch only. Everything is drawn from the generator that is handed in.
"""

from __future__ import annotations

import math

import torch
import torch.nn.functional as F
from torch import Generator, Tensor

from forestall.embeddings.crops import INPUT_PIXELS

_MASK_WIDTHS = (
    (0.0, 0.12, 3, True),
    (0.12, 0.2, 5, True),
    (0.2, 0.32, 3, False),
    (0.32, 0.4, 5, False),
)
"""Of all masks, from which share to which one grows or shrinks by how wide a window."""


def augment(stored: Tensor, generator: Generator) -> Tensor:
    """(n, s, s, 4) uint8 → (n, 4, INPUT_PIXELS, INPUT_PIXELS) in 0..255, each in its own way."""
    crops = _window(stored.permute(0, 3, 1, 2).float(), generator)
    colour, mask = crops[:, :3].contiguous(), crops[:, 3:].contiguous()
    mask = _mask_errors(mask, generator)
    colour = _far_away(colour, generator)
    colour = _light(colour, generator)
    colour, mask = _occlude(colour, mask, generator)
    return torch.cat([colour, mask], 1)


def _uniform(n: int, low: float, high: float, generator: Generator) -> Tensor:
    return low + (high - low) * torch.rand(n, generator=generator)


def _some(n: int, share: float, generator: Generator) -> Tensor:
    return torch.rand(n, generator=generator) < share


def _window(crops: Tensor, generator: Generator) -> Tensor:
    """Shifted, scaled, slightly turned, mirrored."""
    n = len(crops)
    zoom = INPUT_PIXELS / crops.shape[-1] * _uniform(n, 0.86, 1.18, generator)
    angle = _uniform(n, -0.1, 0.1, generator)
    flip = torch.where(_some(n, 0.5, generator), -1.0, 1.0)
    cos, sin = zoom * angle.cos(), zoom * angle.sin()
    shift = 0.12 * (2 * torch.rand(n, 2, generator=generator) - 1)
    across = torch.stack([cos * flip, -sin, shift[:, 0]], 1)
    down = torch.stack([sin * flip, cos, shift[:, 1]], 1)
    size = [n, crops.shape[1], INPUT_PIXELS, INPUT_PIXELS]
    grid = F.affine_grid(torch.stack([across, down], 1), size, align_corners=False)
    return F.grid_sample(crops, grid, padding_mode="border", align_corners=False)


def _mask_errors(mask: Tensor, generator: Generator) -> Tensor:
    """Some too large, some too small, some shifted, some no more than a box."""
    draw = torch.rand(len(mask), generator=generator)
    for low, high, width, grows in _MASK_WIDTHS:
        some = ((draw >= low) & (draw < high)).nonzero()[:, 0]
        sign = 1.0 if grows else -1.0
        mask[some] = sign * F.max_pool2d(sign * mask[some], width, 1, width // 2)
    shift = torch.randint(-3, 4, (2,), generator=generator).tolist()
    some = ((draw >= 0.4) & (draw < 0.6)).nonzero()[:, 0]
    mask[some] = torch.roll(mask[some], tuple(shift), (2, 3))
    some = (draw >= 0.95).nonzero()[:, 0]
    inside = mask[some] > 127
    mask[some] = 255.0 * (inside.any(2, keepdim=True) & inside.any(3, keepdim=True))
    return mask


def _far_away(colour: Tensor, generator: Generator) -> Tensor:
    """Some are made as coarse as far things are, some a little blurred."""
    draw = torch.rand(len(colour), generator=generator)
    size = int(torch.randint(14, 48, (1,), generator=generator))
    some = (draw < 0.15).nonzero()[:, 0]
    small = F.interpolate(colour[some], (size, size), mode="area")
    colour[some] = F.interpolate(small, colour.shape[-2:], mode="bilinear", align_corners=False)
    some = ((draw >= 0.15) & (draw < 0.3)).nonzero()[:, 0]
    colour[some] = F.avg_pool2d(colour[some], 3, 1, 1, count_include_pad=False)
    return colour


def _light(colour: Tensor, generator: Generator) -> Tensor:
    """Exposure, contrast, white balance, gamma, sensor noise."""
    n = len(colour)
    unit = (colour / 255.0).clamp(1e-4, 1.0)
    gamma = torch.exp(_uniform(n, -math.log(1.3), math.log(1.3), generator))
    unit = unit ** gamma[:, None, None, None]
    contrast = _uniform(n, 0.8, 1.2, generator)[:, None, None, None]
    level = unit.mean((1, 2, 3), keepdim=True)
    unit = (unit - level) * contrast + level
    gain = _uniform(n, 0.75, 1.25, generator)[:, None]
    tint = 1 + 0.07 * (2 * torch.rand(n, 3, generator=generator) - 1)
    unit = unit * (gain * tint)[:, :, None, None]
    noisy = _some(n, 0.4, generator).nonzero()[:, 0]
    sigma = _uniform(len(noisy), 0.0, 0.04, generator)[:, None, None, None]
    unit[noisy] += sigma * torch.randn(unit[noisy].shape, generator=generator)
    return unit.clamp_(0.0, 1.0) * 255.0


def _occlude(colour: Tensor, mask: Tensor, generator: Generator) -> tuple[Tensor, Tensor]:
    """Something of another crop stands before a part of some."""
    n, edge = len(colour), colour.shape[-1]
    size = torch.randint(edge // 8, edge // 3, (2, n), generator=generator)
    start = torch.randint(0, edge - edge // 3, (2, n), generator=generator)
    places = torch.arange(edge)
    rows = (places >= start[0][:, None]) & (places < (start[0] + size[0])[:, None])
    columns = (places >= start[1][:, None]) & (places < (start[1] + size[1])[:, None])
    hidden = rows[:, None, :, None] & columns[:, None, None, :]
    hidden &= _some(n, 0.12, generator)[:, None, None, None]
    some = hidden.flatten(1).any(1).nonzero()[:, 0]
    over = hidden[some]
    before = colour[some - 1]
    colour[some] = torch.where(over, before, colour[some])
    mask[some] = mask[some].masked_fill(over, 0.0)
    return colour, mask
