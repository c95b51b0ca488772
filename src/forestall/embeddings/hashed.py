"""A small deterministic text encoder: hashed words and character n-grams.

Called by retrieval (subtask texts) and by the comparison of graphs (node labels); calls nothing.
It stands where the paper uses CLIP's text encoder (Sec. 3, "Context-Aware Reference Retrieval" and
Eq. 1): it knows spelling and no meaning, needs no download, and gives the same vectors on every
machine.
"""

from __future__ import annotations

import re
import zlib
from collections import OrderedDict
from collections.abc import Sequence
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from forestall.errors import InputError

Vectors = npt.NDArray[np.float32]

_WORD = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+")
_SUFFIXES = ("ing", "ed", "es", "s")
_NGRAM_SIZES = (3, 4, 5)
_WORD_SLOTS = 8


@lru_cache(maxsize=8192)
def words_of(text: str) -> tuple[str, ...]:
    """Lower-cased, lightly stemmed words: "StoveBurner-4" → ("stove", "burner", "4")."""
    return tuple(_stem(w.lower()) for w in _WORD.findall(text))


def _stem(word: str) -> str:
    for suffix in _SUFFIXES:
        if word.endswith(suffix) and len(word) - len(suffix) >= 3 and not word.endswith("ss"):
            return word[: -len(suffix)]
    return word


def _slot(feature: str, dimensions: int) -> tuple[int, float]:
    code = (zlib.crc32(feature.encode()) * 0x9E3779B97F4A7C15) & 0xFFFFFFFFFFFFFFFF
    return (code >> 32) % dimensions, 1.0 if code >> 31 & 1 else -1.0


class HashedTextEncoder:
    """Texts → unit rows, by hashing (implements `TextEncoder`).

    A text is the sum of its words' vectors. A word's vector has a few signed slots for the word
    itself (so that two words seldom share them all) and, together as heavy as `ngram_weight`, one
    for each character n-gram of 3 to 5 letters of "<word>", so that related spellings stay close.
    A text without any word gets a fixed unit vector of its own.

    Args:
        dimensions: length of a row.
        ngram_weight: length of the n-gram part relative to the word's own part.
        cache_size: how many texts are remembered.
    """

    name = "hashed-words"

    def __init__(
        self, dimensions: int = 512, ngram_weight: float = 0.5, cache_size: int = 16384
    ) -> None:
        if dimensions < 8:
            raise InputError(f"an encoder needs at least 8 dimensions, got {dimensions}")
        self.dimensions = dimensions
        self.ngram_weight = ngram_weight
        self._cache_size = cache_size
        self._texts: OrderedDict[str, Vectors] = OrderedDict()
        self._words: OrderedDict[str, Vectors] = OrderedDict()

    def encode(self, texts: Sequence[str]) -> Vectors:
        """(n, dimensions) float32 rows of unit length."""
        rows = np.empty((len(texts), self.dimensions), dtype=np.float32)
        for i, text in enumerate(texts):
            rows[i] = self._text(text)
        return rows

    def _text(self, text: str) -> Vectors:
        row = self._texts.get(text)
        if row is not None:
            self._texts.move_to_end(text)
            return row
        row = np.zeros(self.dimensions, dtype=np.float32)
        for word in words_of(text):
            row += self._word(word)
        length = float(np.sqrt(row @ row))
        if length > 1e-6:
            row /= np.float32(length)
        else:
            row[:] = 0.0
            row[_slot("(empty)", self.dimensions)[0]] = 1.0
        _remember(self._texts, text, row, self._cache_size)
        return row

    def _word(self, word: str) -> Vectors:
        row = self._words.get(word)
        if row is not None:
            return row
        row = np.zeros(self.dimensions, dtype=np.float32)
        marked = f"<{word}>"
        grams = [marked[i : i + n] for n in _NGRAM_SIZES for i in range(len(marked) - n + 1)]
        for gram in grams:
            slot, sign = _slot("#" + gram, self.dimensions)
            row[slot] += sign
        length = float(np.sqrt(row @ row))
        if length > 0:
            row *= np.float32(self.ngram_weight / length)
        for k in range(_WORD_SLOTS):
            slot, sign = _slot(f"{k}{word}", self.dimensions)
            row[slot] += np.float32(sign * _WORD_SLOTS**-0.5)
        _remember(self._words, word, row, self._cache_size)
        return row


def _remember(cache: OrderedDict[str, Vectors], key: str, row: Vectors, size: int) -> None:
    row.setflags(write=False)
    cache[key] = row
    if len(cache) > size:
        cache.popitem(last=False)
