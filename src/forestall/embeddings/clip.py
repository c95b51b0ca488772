"""CLIP itself, through `transformers`: the encoder of the paper (Sec. 3).

Called by the state estimator, by retrieval and by the comparisons, wherever the shipped encoder
can stand; calls `contrastive.py`. It comes with the extra [vision], and its weights, which OpenAI
published under the MIT licence, must be on this machine already.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from forestall.embeddings.contrastive import ContrastiveEncoder


class ClipEncoder(ContrastiveEncoder):
    """CLIP, by default OpenAI's ViT-B/32 or what the variable FORESTALL_CLIP names."""

    family = "clip"
    called = "CLIP"
    default_model = "openai/clip-vit-base-patch32"
    variable = "FORESTALL_CLIP"

    def _read(self, library: Any, folder: Path) -> None:
        self._load(library.CLIPModel, library.CLIPTokenizer, library.CLIPImageProcessorPil, folder)

    def _width(self, config: Any) -> int:
        return int(config.projection_dim)

    def _tokens(self, texts: Sequence[str]) -> Any:
        return self._tokenizer(
            list(texts),
            padding=True,
            truncation=True,
            max_length=self._most_tokens,
            return_tensors="np",
        )
