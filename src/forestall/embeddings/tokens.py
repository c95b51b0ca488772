"""Texts as the numbers that the text tower reads: words, and in each word pieces of its spelling.

Called by `twotower.py` and by the training; calls nothing. A word is its own piece, if training
has seen it, and the three to five letters at each of its places, so that "saucepan" is near "pan"
although nobody ever told the encoder about it. What has no Latin letter or digit has no pieces.
"""

from __future__ import annotations

import re
import unicodedata
import zlib
from collections.abc import Collection, Sequence
from functools import lru_cache

import numpy as np
import numpy.typing as npt

Tokens = npt.NDArray[np.int32]

BUCKETS = 6144
MOST_WORDS = 16
MOST_PIECES = 24

_WORD = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+")
_GRAMS = (3, 4, 5)
_SKIPPED = frozenset({"a", "an", "the"})


@lru_cache(maxsize=65536)
def words(text: str) -> tuple[str, ...]:
    """Lower-case words without articles: "put in Plate-1 a StoveBurner" → put in plate 1 ..."""
    plain = unicodedata.normalize("NFKD", text)
    plain = "".join(c for c in plain if not unicodedata.combining(c))
    found = (w.lower() for w in _WORD.findall(plain))
    return tuple(w for w in found if w not in _SKIPPED)


@lru_cache(maxsize=65536)
def pieces(word: str, known: bool) -> tuple[int, ...]:
    """Buckets of a word's pieces, its own first if training has seen it; 0 is no piece."""
    marked = f"<{word}>"
    grams = [marked[i : i + n] for n in _GRAMS for i in range(len(marked) - n + 1)]
    whole = [f"={word}"] if known else []
    buckets = (1 + zlib.crc32(p.encode()) % (BUCKETS - 1) for p in (*whole, *grams))
    return tuple(buckets)[:MOST_PIECES]


def tokens(texts: Sequence[str], known: Collection[str]) -> Tokens:
    """(n, MOST_WORDS, MOST_PIECES) int32, padded with 0; words beyond the last place are cut off.

    Args:
        texts: what to encode.
        known: the words that training has seen.
    """
    out = np.zeros((len(texts), MOST_WORDS, MOST_PIECES), dtype=np.int32)
    for i, text in enumerate(texts):
        for j, word in enumerate(words(text)[:MOST_WORDS]):
            found = pieces(word, word in known)
            out[i, j, : len(found)] = found
    return out
