from __future__ import annotations

from pathlib import Path

import pytest

from forestall.domain.load import shipped
from forestall.embeddings import HashedTextEncoder
from forestall.embeddings.tokens import words
from forestall.errors import FileFormatError, UnknownNameError
from forestall.training.words import GROUPS, Word, accuracy, nearest, word_list

LIST = word_list()


def names(category: str) -> tuple[str, ...]:
    found = shipped("household")[category]
    return (found.words, *found.synonyms)


def shares_a_part(word: Word) -> bool:
    """A whole word, or four letters in a row, with a name of the word's category."""
    text = word.word.lower()
    pieces = {text[i : i + 4] for i in range(len(text) - 3)}
    return any(
        set(words(word.word)) & set(words(name)) or any(p in name.lower() for p in pieces)
        for name in names(word.category)
    )


def test_no_word_is_a_name_of_the_vocabulary() -> None:
    vocabulary = shipped("household")
    taken = {n.lower() for c in vocabulary.categories for n in (c, *names(c))}
    assert not taken & {w.word.lower() for w in LIST}
    assert len({w.word.lower() for w in LIST}) == len(LIST) >= 80
    assert {w.category for w in LIST} <= set(vocabulary.categories)


@pytest.mark.parametrize("word", LIST, ids=lambda w: w.word)
def test_every_word_is_in_its_group(word: Word) -> None:
    assert shares_a_part(word) == (word.group == "spelling")


def test_spelling_is_all_that_hashing_knows() -> None:
    rows = nearest(HashedTextEncoder(), LIST, shipped("household"))
    assert [r.word for r in rows] == list(LIST)
    spelling, meaning = (accuracy(rows, g) for g in GROUPS)
    assert spelling is not None and 0.6 < spelling < 0.9
    assert meaning is not None and meaning < 0.1
    assert all(r.name in names(r.nearest) and -1 <= r.similarity <= 1.001 for r in rows)
    placed = {r.word.word: r for r in rows}
    assert placed["roasting pan"].nearest == "Pan" and placed["roasting pan"].right
    assert not placed["Merlot"].right


def test_a_name_itself_is_placed_with_certainty() -> None:
    (row,) = nearest(HashedTextEncoder(), [Word("skillet", "meaning", "Pan")], shipped("household"))
    assert row.right and row.name == "skillet" and row.similarity == pytest.approx(1.0, abs=1e-5)


def test_accuracy_of_nothing_is_unknown() -> None:
    rows = nearest(HashedTextEncoder(), [Word("wok", "meaning", "Pan")], shipped("household"))
    assert accuracy(rows, "spelling") is None and accuracy([]) is None


def test_an_unknown_category_is_refused() -> None:
    with pytest.raises(UnknownNameError, match="Pann"):
        nearest(HashedTextEncoder(), [Word("wok", "meaning", "Pann")], shipped("household"))


@pytest.mark.parametrize("text", ["[smell]\nwok = 'Pan'", "meaning = 'Pan'", "[meaning"])
def test_a_bad_list_is_refused(text: str, tmp_path: Path) -> None:
    path = tmp_path / "words.toml"
    path.write_text(text)
    with pytest.raises(FileFormatError, match=r"words\.toml"):
        word_list(path)
