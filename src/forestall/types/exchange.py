"""What is asked of a language model, and what came of it.

Made by whoever asks (`diagnosis`, `replanning`), answered by a `seams.LanguageModel`, kept in the
record of a run.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True, slots=True)
class Request:
    """One question to a language model.

    Args:
        purpose: what it is for, in a word or two: "reasoning", "replanning".
        messages: (role, text), the roles "system", "user" and "assistant" in their order.
        schema: JSON schema of the answer, as JSON text.
        images: JPEG files that go with the first message of the user.
        max_tokens: how long the answer may be.
    """

    purpose: str
    messages: tuple[tuple[str, str], ...]
    schema: str
    images: tuple[bytes, ...] = field(default=(), repr=False)
    max_tokens: int = 1000

    def to_json(self) -> dict[str, Any]:
        """Everything that an answer depends on; pictures by their digests."""
        return {
            "purpose": self.purpose,
            "messages": [list(m) for m in self.messages],
            "schema": json.loads(self.schema),
            "images": [hashlib.blake2b(i, digest_size=16).hexdigest() for i in self.images],
            "max_tokens": self.max_tokens,
        }

    def key(self, model: str) -> str:
        """32 hexadecimal digits of the request in its canonical form, asked of a model."""
        text = json.dumps({"model": model, **self.to_json()}, sort_keys=True, separators=(",", ":"))
        return hashlib.blake2b(text.encode("utf-8"), digest_size=16).hexdigest()


@dataclass(frozen=True, slots=True)
class Exchange:
    """One question and what came of it.

    Args:
        purpose: what it was for.
        model: the name of the model that was asked.
        key: of the request (`Request.key`).
        messages: (role, text) as they were sent.
        answer: the text that came, None where none did.
        problem: why there is no answer, or why it was not taken; "" where it was.
        note: what of an answer that was taken was left out, and why.
        images: how many pictures went with it.
        prompt_tokens: as the endpoint counted them; None: it did not say.
        answer_tokens: the same of the answer.
        cost: in dollars; None where a price or a count is not known.
        seconds: from the first try to the last byte.
        tries: how often the endpoint was asked, 0 where it was not asked at all.
    """

    purpose: str
    model: str
    key: str
    messages: tuple[tuple[str, str], ...]
    answer: str | None
    problem: str = ""
    note: str = ""
    images: int = 0
    prompt_tokens: int | None = None
    answer_tokens: int | None = None
    cost: float | None = None
    seconds: float = 0.0
    tries: int = 0
