"""OWLv2, through `transformers`: boxes around what phrases name.

Called by the segmenter `finder`; calls `loaded.py` and `boxes.py`. Minderer et al., Scaling
Open-Vocabulary Object Detection, NeurIPS 2023. It comes with the extra [vision], and its weights
(Apache-2.0) must be on this machine already.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from forestall.domain.phrases import with_articles
from forestall.pretrained import AUTO
from forestall.types.grounding import GroundedBox
from forestall.types.observation import Rgb
from forestall.vision.boxes import Floats, batches, check_finding, grounded, sigmoid, within
from forestall.vision.loaded import Loaded, Source

SOURCE = Source(
    family="owlv2",
    called="OWLv2",
    default="google/owlv2-base-patch16-ensemble",
    variable="FORESTALL_OWLV2",
    model="Owlv2ForObjectDetection",
    tokenizer="CLIPTokenizer",
    processor="Owlv2ImageProcessorPil",
)

_TEMPLATE = "a photo of a {}"


class Owlv2Finder:
    """Pictures and phrases → boxes (implements `Finder`).

    Every phrase is asked for as a caption of a photograph, as the model's own examples do.

    Args:
        model: a folder, or a name on the hub whose files have been downloaded before; the
            environment variable FORESTALL_OWLV2, else the default of `SOURCE`, by default.
        device: where it runs, as torch calls it ("cpu", "cuda"); "auto": a GPU if there is one.
        batch: how many pictures go through at once.
        least_score: under which there is no box; 0.1 as in transformers' own examples.

    Raises:
        InputError: the extra [vision] is missing, or there is no such device.
        ModelFileError: the model is missing or damaged, or is no OWLv2.
    """

    vocabulary: Sequence[str] | None = None

    def __init__(
        self,
        model: str | None = None,
        *,
        device: str = AUTO,
        batch: int = 4,
        least_score: float = 0.1,
    ) -> None:
        check_finding(least_score, batch)
        self._loaded = Loaded(SOURCE, model, device)
        self._most_tokens = int(self._loaded.config.text_config.max_position_embeddings)
        self._batch, self._least = batch, least_score
        self.name = self._loaded.name

    def find(self, pictures: Sequence[Rgb], phrases: Sequence[str]) -> list[list[GroundedBox]]:
        """See the Protocol."""
        found: list[list[GroundedBox]] = [[] for _ in pictures]
        if not phrases:
            return found
        asked = self._loaded.tokenizer(
            [with_articles(_TEMPLATE.format(phrase)) for phrase in phrases],
            padding="max_length",
            truncation=True,
            max_length=self._most_tokens,
            return_tensors="np",
        )
        for together in batches(pictures, self._batch):
            shown = [pictures[i] for i in together]
            logits, boxes = self._run(self._loaded.processor(shown, return_tensors="np"), asked)
            for row, index in enumerate(together):
                found[index] = self._boxes(logits[row], boxes[row], phrases, pictures[index])
        return found

    def _run(self, seen: Any, asked: Any) -> tuple[Floats, Floats]:
        """Logits (count, patches, phrases) and boxes (count, patches, 4)."""
        pixels = seen["pixel_values"]
        texts = {k: np.tile(asked[k], (len(pixels), 1)) for k in ("input_ids", "attention_mask")}
        inputs = {"pixel_values": pixels, **texts}
        return self._loaded.heads(inputs)

    def _boxes(
        self, logits: Floats, boxes: Floats, phrases: Sequence[str], picture: Rgb
    ) -> list[GroundedBox]:
        """Shares are of the square that the picture was padded to, to the right and below."""
        best = logits.argmax(axis=1)
        scores = sigmoid(logits.max(axis=1))
        kept = np.flatnonzero(scores >= self._least)
        side = max(picture.shape[:2])
        called = [phrases[i] for i in best[kept]]
        return within(grounded(called, scores[kept], boxes[kept], (side, side)), picture)
