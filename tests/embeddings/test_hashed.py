from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from forestall.embeddings import HashedTextEncoder
from forestall.embeddings.hashed import words_of
from forestall.errors import InputError


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("StoveBurner-4", ("stove", "burner", "4")),
        ("toggle_on TVStand", ("toggle", "on", "tv", "stand")),
        ("CellPhone", ("cell", "phone")),
        ("heated cups, glass", ("heat", "cup", "glass")),
        ("", ()),
        ("--- ()", ()),
    ],
)
def test_words(text: str, words: tuple[str, ...]) -> None:
    assert words_of(text) == words


@given(st.lists(st.text(max_size=30), min_size=1, max_size=8))
def test_rows_have_unit_length(texts: list[str]) -> None:
    rows = HashedTextEncoder().encode(texts)
    assert rows.shape == (len(texts), 512)
    assert rows.dtype == np.float32
    np.testing.assert_allclose(np.linalg.norm(rows, axis=1), 1.0, atol=1e-5)


def test_a_row_does_not_depend_on_company_or_cache() -> None:
    small = HashedTextEncoder(cache_size=2)
    texts = ["pick up Mug", "put in Plate Microwave", "open Fridge", "pick up Mug"]
    np.testing.assert_array_equal(small.encode(texts)[3], HashedTextEncoder().encode(texts[:1])[0])
    np.testing.assert_array_equal(small.encode(texts)[0], small.encode(texts)[3])


def test_texts_without_words_share_one_vector() -> None:
    rows = HashedTextEncoder().encode(["", "   ", "()"])
    np.testing.assert_array_equal(rows[0], rows[1])
    np.testing.assert_array_equal(rows[0], rows[2])


def test_related_texts_are_closer() -> None:
    rows = HashedTextEncoder().encode(
        ["pick up Mug", "pick up Mugs", "pick up Bowl", "open Fridge"]
    )
    same, skill, other = rows[0] @ rows[1:].T
    assert same > 0.99
    assert 0.5 < skill < 0.8
    assert other < 0.3


def test_no_texts() -> None:
    assert HashedTextEncoder().encode([]).shape == (0, 512)


def test_the_same_in_another_process() -> None:
    code = (
        "from forestall.embeddings import HashedTextEncoder as E;"
        "print(E().encode(['put in Plate Microwave']).tobytes().hex())"
    )
    other = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    ).stdout.strip()
    assert other == HashedTextEncoder().encode(["put in Plate Microwave"]).tobytes().hex()


def test_too_few_dimensions() -> None:
    with pytest.raises(InputError, match="at least 8"):
        HashedTextEncoder(dimensions=3)
