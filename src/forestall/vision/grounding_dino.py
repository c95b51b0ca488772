"""Grounding DINO, through `transformers`: boxes around what phrases name.

Called by the segmenter `finder`; calls `loaded.py` and `boxes.py`. Liu et al., Grounding DINO,
ECCV 2024. It comes with the extra [vision], and its weights (Apache-2.0) must be on this machine
already.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from forestall.errors import InputError
from forestall.pretrained import AUTO
from forestall.types.grounding import GroundedBox
from forestall.types.observation import Rgb
from forestall.vision.boxes import Floats, batches, check_finding, grounded, sigmoid
from forestall.vision.loaded import Loaded, Source

SOURCE = Source(
    family="grounding-dino",
    called="Grounding DINO",
    default="IDEA-Research/grounding-dino-tiny",
    variable="FORESTALL_GROUNDING_DINO",
    model="GroundingDinoForObjectDetection",
    tokenizer="BertTokenizer",
    processor="GroundingDinoImageProcessorPil",
)


@dataclass(frozen=True, slots=True)
class _Prompt:
    """Phrases that are asked for at once: the tokens, and where in them each phrase stands."""

    tokens: tuple[int, ...]
    spans: tuple[tuple[str, int, int], ...]


class GroundingDinoFinder:
    """Pictures and phrases → boxes (implements `Finder`).

    Phrases are asked for as the model was trained, one after the other with a dot behind each, and
    as many at once as its text length allows; each further prompt is another pass. A box counts if
    one of its tokens reaches `least_score`, and is called the phrase whose tokens have the highest
    mean: with two machines, the other word decides.

    Args:
        model: a folder, or a name on the hub whose files have been downloaded before; the
            environment variable FORESTALL_GROUNDING_DINO, else the default of `SOURCE`, by default.
        device: where it runs, as torch calls it ("cpu", "cuda"); "auto": a GPU if there is one.
        batch: how many pictures go through at once.
        least_score: under which there is no box; 0.35 as its authors' own demonstration has it.

    Raises:
        InputError: the extra [vision] is missing, or there is no such device.
        ModelFileError: the model is missing or damaged, or is no Grounding DINO.
    """

    vocabulary: Sequence[str] | None = None

    def __init__(
        self,
        model: str | None = None,
        *,
        device: str = AUTO,
        batch: int = 4,
        least_score: float = 0.35,
    ) -> None:
        check_finding(least_score, batch)
        self._loaded = Loaded(SOURCE, model, device)
        self._tokenizer = self._loaded.tokenizer
        self._most_tokens = int(self._loaded.config.max_text_len)
        self._batch, self._least = batch, least_score
        self.name = self._loaded.name

    def find(self, pictures: Sequence[Rgb], phrases: Sequence[str]) -> list[list[GroundedBox]]:
        """See the Protocol.

        Raises:
            InputError: a phrase that is longer than the model reads.
        """
        found: list[list[GroundedBox]] = [[] for _ in pictures]
        prompts = self._prompts(phrases)
        for together in batches(pictures, self._batch):
            shown = [pictures[i] for i in together]
            seen = self._loaded.processor(shown, return_tensors="np")
            for prompt in prompts:
                logits, boxes = self._run(seen, prompt, len(shown))
                for row, index in enumerate(together):
                    high, wide = pictures[index].shape[:2]
                    found[index] += self._boxes(logits[row], boxes[row], prompt, (wide, high))
        return found

    def _prompts(self, phrases: Sequence[str]) -> list[_Prompt]:
        """As few prompts as the model's text length allows.

        A dot parts phrases, so that each is tokenized by itself: where it stands is known then.
        """
        begin, end = self._tokenizer.cls_token_id, self._tokenizer.sep_token_id
        prompts: list[_Prompt] = []
        tokens: list[int] = [begin]
        spans: list[tuple[str, int, int]] = []
        for phrase in phrases:
            text = f"{phrase.lower().replace('.', ' ').strip()}."
            added = self._tokenizer(text, add_special_tokens=False)["input_ids"]
            if len(added) + 2 > self._most_tokens:
                raise InputError(
                    f"{phrase!r} has {len(added)} tokens, and {self.name!r} reads "
                    f"{self._most_tokens - 2} at most"
                )
            if len(tokens) + len(added) + 1 > self._most_tokens:
                prompts.append(_Prompt((*tokens, end), tuple(spans)))
                tokens, spans = [begin], []
            spans.append((phrase, len(tokens), len(tokens) + len(added) - 1))
            tokens += added
        return [*prompts, _Prompt((*tokens, end), tuple(spans))] if spans else prompts

    def _run(self, seen: Any, prompt: _Prompt, count: int) -> tuple[Floats, Floats]:
        """Logits (count, queries, text length) and boxes (count, queries, 4)."""
        ids = np.tile(np.array(prompt.tokens, dtype=np.int64), (count, 1))
        inputs = {
            **seen,
            "input_ids": ids,
            "token_type_ids": np.zeros_like(ids),
            "attention_mask": np.ones_like(ids),
        }
        return self._loaded.heads(inputs)

    def _boxes(
        self, logits: Floats, boxes: Floats, prompt: _Prompt, size: tuple[int, int]
    ) -> list[GroundedBox]:
        shares = sigmoid(logits)
        scores = shares.max(axis=1)
        kept = np.flatnonzero(scores >= self._least)
        if not len(kept):
            return []
        means = np.stack([shares[kept, low:high].mean(axis=1) for _, low, high in prompt.spans])
        called = [prompt.spans[i][0] for i in means.argmax(axis=0)]
        return grounded(called, scores[kept], boxes[kept], size)
