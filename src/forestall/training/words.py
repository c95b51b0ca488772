"""Where a text encoder puts household words that it was never told about.

Called by the measurement of encoders and by its tests; calls an encoder and the domain. The
list is `data/encoder_words.toml`: words that share a part with a name of their category, and words
that only their meaning brings near.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path

import numpy as np

from forestall.domain.model import Domain
from forestall.domain.phrases import with_articles
from forestall.errors import FileFormatError
from forestall.reading.documents import read_toml
from forestall.seams.perceiving import TextEncoder

GROUPS = ("spelling", "meaning")
_TEXT = "a {thing}"


@dataclass(frozen=True, slots=True)
class Word:
    """One word of the list.

    Args:
        word: as a person says it.
        group: one of `GROUPS`, what brings it near its category.
        category: which one a person would call the nearest.
    """

    word: str
    group: str
    category: str


@dataclass(frozen=True, slots=True)
class Placed:
    """Where an encoder puts a word.

    Args:
        word: the word and what would be right.
        nearest: category of the name with the highest cosine.
        name: that name.
        similarity: that cosine.
    """

    word: Word
    nearest: str
    name: str
    similarity: float

    @property
    def right(self) -> bool:
        """Whether a person would agree."""
        return self.nearest == self.word.category


def word_list(path: Path | None = None) -> tuple[Word, ...]:
    """Read a list of words; the shipped one by default.

    Raises:
        FileFormatError: it is no table of words for each group.
    """
    path = path or Path(str(files("forestall").joinpath("data/encoder_words.toml")))
    data = read_toml(path, "list of words")
    if set(data) - set(GROUPS) or not all(isinstance(t, dict) for t in data.values()):
        raise FileFormatError(
            f'{path} must hold tables [{"], [".join(GROUPS)}] of lines such as wok = "Pan"'
        )
    return tuple(Word(w, g, str(c)) for g in GROUPS for w, c in data.get(g, {}).items())


def nearest(encoder: TextEncoder, words: Sequence[Word], domain: Domain) -> tuple[Placed, ...]:
    """Put every word to the category that has the most similar name, in the order of the words.

    Words and names are compared as "a <word>", by their cosines.

    Raises:
        UnknownNameError: a word's category is not in the domain.
    """
    for word in words:
        domain[word.category]
    names = [
        (category, name)
        for category in sorted(domain.categories)
        for name in (domain[category].spoken, *domain[category].synonyms)
    ]
    known = encoder.encode([_said(name) for _, name in names])
    cosines = encoder.encode([_said(w.word) for w in words]) @ known.T
    best = np.argmax(cosines, axis=1)
    return tuple(
        Placed(word, *names[int(i)], float(row[i]))
        for word, row, i in zip(words, cosines, best, strict=True)
    )


def accuracy(rows: Sequence[Placed], group: str | None = None) -> float | None:
    """Share of words that are put right, of one group or of all; None where there is no word."""
    answers = [r.right for r in rows if group in (None, r.word.group)]
    return sum(answers) / len(answers) if answers else None


def _said(word: str) -> str:
    return with_articles(_TEXT.format(thing=word))
