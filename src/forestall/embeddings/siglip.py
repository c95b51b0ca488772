"""SigLIP, through `transformers`: what CLIP is, trained pair by pair (Zhai et al., ICCV 2023).

Stands wherever `clip.py` stands; calls `contrastive.py`. SigLIP 2 of a fixed picture size is read,
too (Tschannen et al., 2025). It comes with the extra [vision], and its weights (Apache-2.0) must be
on this machine already.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from forestall.embeddings.contrastive import ContrastiveEncoder


class SiglipEncoder(ContrastiveEncoder):
    """SigLIP, by default Google's base model or what the variable FORESTALL_SIGLIP names.

    Its scores are sigmoids of scaled and shifted cosines; among the phrases of one question the
    shift is the same for all, so that the scale alone says which of them fits, and how surely.
    """

    family = "siglip"
    called = "SigLIP of a fixed picture size"
    default_model = "google/siglip-base-patch16-224"
    variable = "FORESTALL_SIGLIP"

    def _read(self, library: Any, folder: Path) -> None:
        tokenizer = library.AutoTokenizer  # SigLIP 2 has another one than SigLIP
        self._load(library.SiglipModel, tokenizer, library.SiglipImageProcessorPil, folder)

    def _width(self, config: Any) -> int:
        return int(config.text_config.projection_size)

    def _tokens(self, texts: Sequence[str]) -> Any:
        """All of one length and in small letters, as both were trained."""
        found = self._tokenizer(
            [text.lower() for text in texts],
            padding="max_length",
            truncation=True,
            max_length=self._most_tokens,
            return_tensors="np",
        )
        return {"input_ids": found["input_ids"]}
