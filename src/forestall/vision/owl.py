"""OWLv2, through `transformers`: boxes around what phrases name.

Called by the segmenter `finder`; calls `pretrained.py` and `boxes.py`. Minderer et al., Scaling
Open-Vocabulary Object Detection, NeurIPS 2023. It comes with the extra [vision], and its weights
(Apache-2.0) must be on this machine already.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from forestall.domain.phrases import with_articles
from forestall.pretrained import (
    AUTO,
    check_family,
    chosen,
    label,
    loading,
    local_folder,
    on_device,
    package,
    read_weights,
)
from forestall.types.grounding import GroundedBox
from forestall.types.observation import Rgb
from forestall.vision.boxes import Floats, batches, check_finding, grounded, sigmoid, within

DEFAULT_MODEL = "google/owlv2-base-patch16-ensemble"
VARIABLE = "FORESTALL_OWLV2"

_EXTRA = "vision"
_TEMPLATE = "a photo of a {}"


class Owlv2Finder:
    """Pictures and phrases → boxes (implements `Finder`).

    Every phrase is asked for as a caption of a photograph, as the model's own examples do.

    Args:
        model: a folder, or a name on the hub whose files have been downloaded before; the
            environment variable FORESTALL_OWLV2, else `DEFAULT_MODEL`, by default.
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
        self._torch = package("torch", _EXTRA)
        library = package("transformers", _EXTRA)
        asked = chosen(model, VARIABLE, DEFAULT_MODEL)
        folder = local_folder(asked, VARIABLE, _EXTRA)
        with loading(folder, _EXTRA):
            config = library.AutoConfig.from_pretrained(folder, local_files_only=True)
            check_family(folder, config.model_type, ("owlv2",), "OWLv2")
            self._model = read_weights(library.Owlv2ForObjectDetection, folder, self._torch)
            self._tokenizer = library.CLIPTokenizer.from_pretrained(folder, local_files_only=True)
            self._processor = library.Owlv2ImageProcessorPil.from_pretrained(
                folder, local_files_only=True
            )
        self._device = on_device(self._model, device, self._torch)
        self._most_tokens = int(config.text_config.max_position_embeddings)
        self._batch, self._least = batch, least_score
        self.name = label("owlv2", asked)

    def find(self, pictures: Sequence[Rgb], phrases: Sequence[str]) -> list[list[GroundedBox]]:
        """See the Protocol."""
        found: list[list[GroundedBox]] = [[] for _ in pictures]
        if not phrases:
            return found
        asked = self._tokenizer(
            [with_articles(_TEMPLATE.format(phrase)) for phrase in phrases],
            padding="max_length",
            truncation=True,
            max_length=self._most_tokens,
            return_tensors="np",
        )
        for together in batches(pictures, self._batch):
            shown = [pictures[i] for i in together]
            logits, boxes = self._run(self._processor(shown, return_tensors="np"), asked)
            for row, index in enumerate(together):
                found[index] = self._boxes(logits[row], boxes[row], phrases, pictures[index])
        return found

    def _run(self, seen: Any, asked: Any) -> tuple[Floats, Floats]:
        """Logits (count, patches, phrases) and boxes (count, patches, 4)."""
        pixels = seen["pixel_values"]
        texts = {k: np.tile(asked[k], (len(pixels), 1)) for k in ("input_ids", "attention_mask")}
        inputs = {"pixel_values": pixels, **texts}
        with self._torch.inference_mode():
            given = {k: self._torch.as_tensor(v).to(self._device) for k, v in inputs.items()}
            out = self._model(**given)
        return out.logits.cpu().numpy(), out.pred_boxes.cpu().numpy()

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
