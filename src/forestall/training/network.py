"""The two towers in PyTorch, and their export to ONNX; needs the extra `[training]`.

Called by `fit.py`. The image tower is a small residual network over a 64 × 64 crop with its mask
as fourth channel; the text tower reads pieces of words (`embeddings/tokens.py`) with two layers of
attention. Both end in unit vectors of one space, as CLIP's do (Radford et al. 2021).
"""

from __future__ import annotations

from pathlib import Path
from typing import cast

import torch
from torch import Tensor, nn

from forestall.embeddings.crops import INPUT_PIXELS
from forestall.embeddings.tokens import BUCKETS, MOST_PIECES, MOST_WORDS

DIMENSIONS = 128
WIDTHS = (32, 64, 128, 192)
WORD_DIMENSIONS = 96
OPSET = 17


def _unit(vectors: Tensor) -> Tensor:
    return vectors / vectors.square().sum(-1, keepdim=True).clamp_min(1e-12).sqrt()


def _step(inputs: int, outputs: int, stride: int) -> nn.Sequential:
    return nn.Sequential(
        nn.Conv2d(inputs, outputs, 3, stride, 1, bias=False), nn.BatchNorm2d(outputs), nn.ReLU()
    )


class _Residual(nn.Module):
    def __init__(self, width: int) -> None:
        super().__init__()
        self.first = _step(width, width, 1)
        self.second = nn.Sequential(
            nn.Conv2d(width, width, 3, 1, 1, bias=False), nn.BatchNorm2d(width)
        )

    def forward(self, x: Tensor) -> Tensor:
        return torch.relu(x + self.second(self.first(x)))


class ImageTower(nn.Module):
    """(n, 4, 64, 64) in 0..255 → (n, DIMENSIONS) unit vectors."""

    def __init__(self) -> None:
        super().__init__()
        first, second, third, fourth = WIDTHS
        self.body = nn.Sequential(
            _step(4, first, 2),
            _step(first, second, 2),
            _Residual(second),
            _step(second, third, 2),
            _Residual(third),
            _step(third, fourth, 2),
            _Residual(fourth),
        )
        self.narrow = nn.Sequential(nn.Conv2d(fourth, 64, 1), nn.ReLU())
        places = (INPUT_PIXELS // 2 ** len(WIDTHS)) ** 2
        self.head = nn.Linear(64 * places + fourth, DIMENSIONS)

    def forward(self, crops: Tensor) -> Tensor:
        """See the class."""
        x = self.body(crops / 127.5 - 1.0)
        where = self.narrow(x).flatten(1)
        return _unit(self.head(torch.cat([where, x.mean((2, 3))], 1)).float())


class TextTower(nn.Module):
    """(n, MOST_WORDS, MOST_PIECES) piece numbers → (n, DIMENSIONS) unit vectors."""

    def __init__(self) -> None:
        super().__init__()
        self.pieces = nn.Embedding(BUCKETS, WORD_DIMENSIONS)
        nn.init.normal_(self.pieces.weight, std=0.02)
        self.places = nn.Parameter(torch.zeros(MOST_WORDS, WORD_DIMENSIONS))
        self.layers = nn.ModuleList(_Attention() for _ in range(2))
        self.head = nn.Linear(WORD_DIMENSIONS, DIMENSIONS)

    def forward(self, tokens: Tensor) -> Tensor:
        """See the class."""
        there = (tokens > 0).float()
        found = self.pieces(tokens) * there[..., None]
        # a word is the mean of its pieces, brought to the scale of one
        words = found.sum(2) / there.sum(2).clamp_min(1.0)[..., None] * 8.0
        used = (there.sum(2) > 0).float()
        x = words + self.places
        for layer in self.layers:
            x = layer(x, used)
        pooled = (x * used[..., None]).sum(1) / used.sum(1).clamp_min(1.0)[..., None]
        return _unit(self.head(pooled))


class _Attention(nn.Module):
    """One pre-norm transformer layer, written out so that it exports to plain operators."""

    def __init__(self, heads: int = 4) -> None:
        super().__init__()
        self.heads = heads
        d = WORD_DIMENSIONS
        self.norm = nn.LayerNorm(d)
        self.qkv = nn.Linear(d, 3 * d)
        self.out = nn.Linear(d, d)
        self.feed = nn.Sequential(
            nn.LayerNorm(d), nn.Linear(d, 2 * d), nn.GELU(), nn.Linear(2 * d, d)
        )

    def forward(self, x: Tensor, used: Tensor) -> Tensor:
        shape = (-1, MOST_WORDS, self.heads, WORD_DIMENSIONS // self.heads)
        q, k, v = (t.reshape(shape).transpose(1, 2) for t in self.qkv(self.norm(x)).chunk(3, -1))
        weight = q @ k.transpose(2, 3) * shape[-1] ** -0.5
        weight = weight + (used - 1.0)[:, None, None, :] * 1e4
        mixed = (weight.softmax(-1) @ v).transpose(1, 2).reshape(x.shape)
        x = x + self.out(mixed)
        return x + cast(Tensor, self.feed(x))


class TwoTowers(nn.Module):
    """Both towers and the scale of their cosines."""

    def __init__(self) -> None:
        super().__init__()
        self.image = ImageTower()
        self.text = TextTower()
        self.log_scale = nn.Parameter(torch.tensor(2.7))

    @property
    def scale(self) -> Tensor:
        """By what cosines are multiplied before a softmax."""
        return self.log_scale.exp().clamp_max(60.0)


def export(towers: TwoTowers, folder: Path) -> None:
    """Write image.onnx and text.onnx."""
    folder.mkdir(parents=True, exist_ok=True)
    towers = towers.cpu().eval()
    crops = torch.zeros(2, 4, INPUT_PIXELS, INPUT_PIXELS)
    pieces = torch.zeros(2, MOST_WORDS, MOST_PIECES, dtype=torch.int32)
    for name, tower, example in (
        ("image", towers.image, crops),
        ("text", towers.text, pieces),
    ):
        torch.onnx.export(
            tower,
            (example,),
            str(folder / f"{name}.onnx"),
            input_names=["input"],
            output_names=["vector"],
            dynamic_axes={"input": {0: "n"}, "vector": {0: "n"}},
            opset_version=OPSET,
            dynamo=False,
        )
