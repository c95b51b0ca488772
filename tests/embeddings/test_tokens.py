import numpy as np
import pytest

from forestall.embeddings.tokens import BUCKETS, MOST_PIECES, MOST_WORDS, pieces, tokens, words


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("an open Microwave", ("open", "microwave")),
        ("put in Plate-1 StoveBurner-4", ("put", "in", "plate", "1", "stove", "burner", "4")),
        ("a Café crème", ("cafe", "creme")),
        ("the TVStand", ("tv", "stand")),
        ("開いた電子レンジ", ()),
        ("", ()),
    ],
)
def test_words(text: str, expected: tuple[str, ...]) -> None:
    assert words(text) == expected


def test_alike_spellings_share_pieces_and_others_hardly() -> None:
    def shared(a: str, b: str) -> float:
        one, other = set(pieces(a, False)), set(pieces(b, False))
        return len(one & other) / len(one | other)

    assert shared("saucepan", "saucepans") > 0.6
    assert shared("saucepan", "kettle") < 0.05


def test_a_known_word_has_a_piece_of_its_own() -> None:
    assert pieces("mug", True)[1:] == pieces("mug", False)
    assert tokens(["mug"], {"mug"})[0, 0, 0] != tokens(["mug"], set())[0, 0, 0]


def test_texts_become_padded_numbers() -> None:
    found = tokens(["a mug", "", " ".join(["word"] * 40)], {"mug"})
    assert found.shape == (3, MOST_WORDS, MOST_PIECES) and found.dtype == np.int32
    assert found.max() < BUCKETS
    assert (found[0, 1:] == 0).all() and (found[1] == 0).all()
    assert (found[2, :, 0] > 0).all()
